"""Generated houses and their scans."""

from __future__ import annotations

import numpy as np
import pytest

import envs
from envs import Environment, InputError
from envs.problem import Array
from envs.scenes.floor_plan import CELL, Plan, make_plan
from envs.scenes.furniture import ROOMS
from envs.scenes.gibson import GeneratedHouse
from envs.scenes.scan import scanned

SCENES = (0, 1)


@pytest.fixture(params=SCENES, scope="module")
def house(request: pytest.FixtureRequest) -> GeneratedHouse:
    return GeneratedHouse(request.param)


@pytest.mark.parametrize("scene", range(12))
def test_plans_have_rooms_joined_by_doors(scene: int) -> None:
    plan = make_plan(scene)
    kinds = [room.kind for room in plan.rooms]
    assert len(kinds) - kinds.count("hall") >= 8
    assert set(kinds) <= {"hall", *ROOMS}
    assert kinds.count("hall") == 1 + scene % 2
    assert (plan.spaces[:, 0] < plan.spaces[:, 1]).all()
    assert (plan.solids[:, 0] < plan.solids[:, 1]).all()
    assert _joined(plan) == len(plan.spaces)


def _joined(plan: Plan) -> int:
    """How many of the spaces can be reached from the first, through common faces."""
    reached, left = [plan.spaces[0]], list(plan.spaces[1:])
    for a in reached:
        touching = [b for b in left if _touch(a, b)]
        reached += touching
        left = [b for b in left if not any(b is t for t in touching)]
    return len(reached)


def _touch(a: Array, b: Array) -> bool:
    overlap = np.minimum(a[1], b[1]) - np.maximum(a[0], b[0])
    return bool((overlap >= 0).all() and (overlap > 0).sum() == 2)


@pytest.mark.parametrize("scene", range(12))
def test_furniture_stands_in_rooms_and_leaves_doorways_free(scene: int) -> None:
    plan = make_plan(scene)
    furniture = plan.solids[12 * (scene % 2) :]  # without the steps, which reach into the stairwell
    within = [
        any((box[0] >= room.low).all() and (box[1] <= room.high).all() for room in plan.rooms)
        for box in furniture
    ]
    assert all(within)
    rooms = len(plan.rooms)
    openings = plan.spaces[: len(plan.spaces) - rooms]
    for box in furniture:
        overlap = np.minimum(box[1], openings[:, 1]) - np.maximum(box[0], openings[:, 0])
        assert not (overlap > 0).all(axis=1).any()


@pytest.mark.slow
def test_scans_are_flawed_and_the_same_each_time(house: GeneratedHouse) -> None:
    first, again = (scanned(make_plan(house.scene), house.scene) for _ in range(2))
    assert (first.vertices == again.vertices).all()
    assert (first.faces == again.faces).all()
    assert 50_000 <= len(first.faces) <= 150_000
    corners = first.vertices[first.faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert 0.05 < np.quantile(edges, 0.05) < 0.7 * np.quantile(edges, 0.95) < 0.2
    signed_volume = np.linalg.det(corners).sum() / 6
    assert signed_volume < -200, "wound inward: the normals point into the rooms"
    assert len(house.obstacles) == 2, "the holes have lids"


@pytest.mark.slow
def test_problems_are_across_rooms(house: GeneratedHouse) -> None:
    problems = house.sample_problems(500, 1)
    model = house.collision_model()
    ends = np.array([end for p in problems for end in (p.start, p.goal)])
    assert min(house.clearance(ends)) >= 1.0
    assert house.allowed is not None
    assert house.allowed(ends).all()
    blocked = np.mean([not model.segment_is_free(p.start, p.goal) for p in problems])
    assert blocked >= 0.6
    if house.scene % 2:
        scale, offset = house.transform.scale, house.transform.offset
        heights = ((ends - offset) / scale)[:, 2].reshape(-1, 2) > 2.8
        assert 0.2 < (heights[:, 0] != heights[:, 1]).mean() < 0.8, "many between the levels"


@pytest.mark.slow
def test_outside_is_out_of_bounds(house: GeneratedHouse) -> None:
    q = np.random.default_rng(0).uniform(house.lower, house.upper, (4000, 3))
    low, high = house.free_bounds
    outside = ((q < low) | (q > high)).any(axis=1)
    assert outside.sum() > 1000
    assert (house.clearance(q[outside]) < 0).all()
    assert 0.5 < (house.clearance(q[~outside]) > 0).mean() < 0.9


@pytest.mark.slow
def test_houses_differ_by_scene_and_have_their_own_name() -> None:
    assert GeneratedHouse(0).fingerprint != GeneratedHouse(2).fingerprint
    assert envs.REGISTRY.entry("gibson").id == "gibson-generated"
    assert envs.REGISTRY.entry("gibson:scene=1").id == "gibson-generated:scene=1"
    assert isinstance(envs.make("gibson-generated"), Environment)


@pytest.mark.slow
def test_rough_clearances_are_near_the_exact_ones(house: GeneratedHouse) -> None:
    q = np.random.default_rng(0).uniform(*house.free_bounds, (5000, 3))
    error = np.abs(house.approximate_clearance(q) - house.clearance(q))
    assert error.max() <= 0.08 * house.speed_model.d_max
    assert np.median(error) < 0.01


@pytest.mark.slow
def test_beside_a_narrow_hole_the_judge_refuses_no_motion_that_planners_find_free() -> None:
    """Past a missing patch of a wall, where the winding number varies about a half."""
    house = envs.make("gibson-generated")
    a = np.array([-3.0504947270784513, -6.46532896127882, 0.04108671654280793])
    b = np.array([-5.2813539567128736, -4.855539241821832, -0.27059099499537975])
    assert house.collision_model(house.planning_tolerance).segment_is_free(a, b)
    judge = house.collision_model()
    assert judge.min_clearance(np.array([a, b])) > judge.tolerance


@pytest.mark.parametrize("scene", [0, 1, 2, 3])
def test_doors_are_as_wide_as_asked_and_all_else_stays(scene: int) -> None:
    """Rooms do not move, and from each one comes to each other by the narrowest doors, too."""
    plain = make_plan(scene)
    for door in (0.48, 0.72, 1.44):
        plan = make_plan(scene, door)
        for room, other in zip(plan.rooms, plain.rooms, strict=True):
            assert (room.low == other.low).all() and (room.high == other.high).all()
        differing = (plan.spaces != plain.spaces).any(axis=(1, 2))
        widths = {
            (int(new[1, axis] - new[0, axis]), int(old[1, axis] - old[0, axis]))
            for new, old in zip(plan.spaces[differing], plain.spaces[differing], strict=True)
            for axis in range(2)
            if (new[:, axis] != old[:, axis]).any()
        }
        assert (round(door / CELL), 8) in widths


def test_houses_with_narrow_doors_have_problems_all_the_same() -> None:
    house = envs.make("gibson:door=0.48")
    assert len(house.sample_problems(3, 0)) == 3
    assert house.fingerprint != envs.make("gibson").fingerprint


@pytest.mark.parametrize("door", ["0.3", "2", "nan"])
def test_doors_that_fit_in_no_wall_are_refused(door: str) -> None:
    with pytest.raises(InputError, match="door"):
        envs.make(f"gibson:door={door}")
