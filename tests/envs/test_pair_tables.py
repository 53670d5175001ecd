"""Tables of where links may be near each other, against the links' distances."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, sliding, turning
from made_trees import distances_of

from envs.collision.shapes import Mesh, PlacedShape
from envs.problem import Array
from envs.robots.arm import Arm, Part
from envs.robots.arm_prover import ArmProver
from envs.robots.kinematic_tree import Joint
from envs.robots.pair_tables import PairTables, split
from envs.robots.table_proofs import place_in_tables

KEPT = 1e-3


def box(body: int, x: float, y: float, z: float, *sides: float) -> Part:
    made = trimesh.creation.box(sides)
    return Part(body, PlacedShape(Mesh(made.vertices, made.faces), at(x, y, z)))


def folding(*joints: Joint) -> Arm:
    """A forearm that turns past a post on the base, which two joints part, or more; a speck on each
    link between, without which the two would be neighbours."""
    last = len(joints)
    specks = [box(body, 0, 0, 2, 0.01, 0.01, 0.01) for body in range(1, last)]
    return arm_of(
        list(joints),
        *specks,
        box(last, 0.2, 0, 0, 0.4, 0.05, 0.05),
        box(0, 0.35, 0.1, 0, 0.05, 0.05, 0.3),
        self_collision=True,
    )


def two_joints() -> Arm:
    return folding(turning("z"), turning("z", at(0.1, 0, 0)))


def slider() -> Arm:
    return folding(turning("z"), sliding("z"))


def endless() -> Arm:
    ends = Joint("turns", at(0, 0, 0), np.eye(3)[2], False, -math.pi, math.pi, wraps=True)
    return folding(ends, turning("z", at(0.1, 0, 0)))


def least(arm: Arm, a: Array, b: Array) -> float:
    steps = np.linspace(0, 1, 801)[:, None]
    return float(apart(arm, a + steps * (b - a)).min())


def apart(arm: Arm, q: Array) -> Array:
    """Of forearm and post."""
    last = len(arm.parts) - 1
    return distances_of(arm, last - 1, last, q)


@pytest.mark.parametrize("make", [two_joints, slider])
def test_motions_are_proved_where_links_stay_apart(make: Callable[[], Arm]) -> None:
    arm = make()
    others, tables = split(arm)
    assert len(others) == 0 and len(tables.pairs) == 1
    rng, proved = np.random.default_rng(0), 0
    for a, b in rng.uniform(arm.tree.lower, arm.tree.upper, (150, 2, 2)):
        place = place_in_tables(arm.arrays, tables, a, b, 2 * KEPT, KEPT)
        if place < 0:
            proved += 1
            assert least(arm, a, b) > KEPT
        else:
            there = a + place * (b - a)
            assert apart(arm, there[None])[0] <= 2 * KEPT
    assert 30 < proved < 145


def test_what_is_known_gives_the_same_answers() -> None:
    arm = two_joints()
    _, tables = split(arm)
    rng = np.random.default_rng(1)
    motions = rng.uniform(arm.tree.lower, arm.tree.upper, (60, 2, 2))

    def free(tables: PairTables, motion: Array) -> bool:
        return bool(place_in_tables(arm.arrays, tables, *motion, 2 * KEPT, KEPT) < 0)

    first = [free(tables, motion) for motion in motions]
    asked = int((tables.proved >= 0).sum())
    assert asked > 0
    assert [free(tables, motion) for motion in motions] == first
    assert (tables.proved >= 0).sum() == asked  # none is asked again
    assert [free(split(arm)[1], motion) for motion in reversed(motions)] == first[::-1]


def test_tables_go_round_where_joints_wrap() -> None:
    arm = endless()
    _, tables = split(arm)
    assert tables.wraps[0, 0] and not tables.wraps[0, 1]
    a, b = np.array([3.0, 0.2]), np.array([3.5, 0.2])  # beyond pi, as motions are given
    assert place_in_tables(arm.arrays, tables, a, b, 2 * KEPT, KEPT) < 0
    assert place_in_tables(arm.arrays, tables, a - 2 * math.pi, b, 2 * KEPT, KEPT) >= 0


def test_pairs_that_three_joints_part_have_no_table() -> None:
    others, tables = split(folding(turning("z"), turning("z"), turning("z")))
    assert len(others) == 1 and tables.coordinates.tolist() == [[0, 1], [1, 2]]


def test_motions_through_cells_that_are_not_parted_are_asked_for_themselves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("envs.robots.pair_tables._MOST_PARTED", 0)
    arm = two_joints()
    _, tables = split(arm)
    _, full = split(two_joints())
    rng = np.random.default_rng(2)
    for a, b in rng.uniform(arm.tree.lower, arm.tree.upper, (40, 2, 2)):
        found = place_in_tables(arm.arrays, tables, a, b, 2 * KEPT, KEPT)
        assert (found < 0) == (place_in_tables(arm.arrays, full, a, b, 2 * KEPT, KEPT) < 0)


def test_more_than_planners_ask_for_is_proved_without_tables() -> None:
    """A judge asks for something else of each path, for which all cells would be asked again."""
    arm, other = two_joints(), two_joints()
    quick, tabled = ArmProver(arm, [], None, KEPT / 2), ArmProver(other, [], None, KEPT)
    rng, proved = np.random.default_rng(3), 0
    for a, b in rng.uniform(arm.tree.lower, arm.tree.upper, (60, 2, 2)):
        place, _ = quick.prove(a, b, 2 * KEPT, KEPT)
        assert (place < 0) == (tabled.prove(a, b, 2 * KEPT, KEPT)[0] < 0)
        proved += place < 0
        if place >= 0:
            assert apart(arm, (a + place * (b - a))[None])[0] <= 2 * KEPT
    assert 10 < proved < 55
    assert tables_asked(tabled) and not tables_asked(quick)


def tables_asked(prover: ArmProver) -> bool:
    """Whether anything is known of cells of the arm's tables."""
    _, tables = prover.known.tabled
    return bool((tables.proved >= 0).any())
