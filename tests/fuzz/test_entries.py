"""Texts that name environments and planners, and rules of when planners stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from fuzzing import fuzzed
from mutations import texts

import envs
import planners
from bench.execution.stop_rule import StopRule
from envs import Environment
from envs.registry import Entry, Registry

ENVIRONMENTS = (
    "c3d",
    "c3d:scene=3,boxes=20,robot_radius=0.2",
    "c3d,c3d:scene=1,boxes=20,box:side=4.5",
    "box:side=1e-3,robot_radius=.5",
    "gibson:scene=1",
    "gibson:root=data,scene=Allensville,robot_radius=0.1",
    "gibson-generated:scene=4,robot_radius=0.05",
    "arm4:scene=7,self_collision=true",
    "arm6,arm5:self_collision=1",
    "arm:urdf=my_arm.urdf,scene=my_scene.yaml,self_collision=False",
    "mesh:file=rooms/room.ply,kind=interior,robot_radius=0.15,scale=2",
    "mesh:file=\"my room, v2.ply\",scale=2,arm:urdf='an arm, old.urdf',self_collision=off",
)

PLANNERS = (
    "all",
    "paper,rrt*",
    "fmm:resolution=50,order=1",
    "ntfields:attempts=1,weights=a/b.safetensors,device=cpu",
    "ief3d:device=cuda:0,eikonet",
    "mpnet:fallback=rrtstar:range=2",
    "mpnet:fallback='rrtstar:range=2,goal_bias=0.1',weights=\"a, b\",fmm",
    "rrtstar:range=2,goal_bias=0.1,informed_sampling=true",
    "lazyprmstar:roadmap_s=10,simplify=true,rrtconnect:range=0.5",
    "bitstar:samples_per_batch=100,rewire_factor=1.1,use_k_nearest=0",
    "fmt:num_samples=1000,nearest_k=1,radius_multiplier=1.1",
)

RULES = (
    "first",
    "limit",
    "match:mpnet",
    "match:fmm:0.1",
    "match:rrtstar:range=2,goal_bias=0.1:1e-3",
    "match:ntfields:attempts=1",
    "match:ntfields:weights='a, b:0.5',attempts=2:0.1",
    "match:lazyprmstar:roadmap_s=10,simplify=true:0.25",
    "match:bitstar:samples_per_batch=100,rewire_factor=1.1:2",
)

COSTLY = ("bunny", "gibson-generated")
"""Environments that take seconds to make, or a download."""


@pytest.fixture(scope="module", autouse=True)
def all_loaded() -> None:
    """Importing them takes longer than one input may."""
    for spec in [*envs.REGISTRY.specs(), *planners.REGISTRY.specs()]:
        spec.load()


def entries_of(registry: Registry[Any]) -> Callable[[str], tuple[list[Entry[Any]], list[Any]]]:
    """What a text names, and what is made of it, but for what is `COSTLY`."""

    def parse(text: str) -> tuple[list[Entry[Any]], list[Any]]:
        found = registry.entries(text)
        return found, [entry.make() for entry in found if entry.spec.id not in COSTLY]

    return parse


def assert_named_by_their_ids(registry: Registry[Any], found: Sequence[Entry[Any]]) -> None:
    """Each of the entries, and all of them in one text."""
    assert [registry.entry(entry.id) for entry in found] == list(found)
    assert registry.entries(",".join(entry.id for entry in found)) == list(found)


def assert_finite(env: Environment) -> None:
    middle = (env.lower + env.upper) / 2
    assert np.isfinite(np.array([env.lower, env.upper, middle])).all()
    assert (env.lower < env.upper).all()
    assert len(env.fingerprint) == 16
    if env.dimension == 3:
        assert np.isfinite(env.clearance(middle[None])).all()


def test_environments() -> None:
    def check(made: tuple[list[Entry[Any]], list[Environment]]) -> None:
        assert_named_by_their_ids(envs.REGISTRY, made[0])
        for env in made[1]:
            assert_finite(env)

    fuzzed("environments", texts(ENVIRONMENTS), entries_of(envs.REGISTRY), check)


def test_planners() -> None:
    def check(made: tuple[list[Entry[Any]], list[Any]]) -> None:
        assert_named_by_their_ids(planners.REGISTRY, made[0])

    fuzzed("planners", texts(PLANNERS), entries_of(planners.REGISTRY), check)


def test_stop_rules() -> None:
    def check(rule: StopRule) -> None:
        assert StopRule.parse(rule.text) == rule
        assert 0 <= rule.tolerance < math.inf
        assert rule.stop_cost(2.0) >= 0

    fuzzed("stop rules", texts(RULES), StopRule.parse, check)


def test_a_planner_cannot_fall_back_on_itself() -> None:
    with pytest.raises(envs.InputError, match="fall back on itself"):
        planners.make("mpnet:" + "fallback=mpnet:" * 600 + "fallback=fmm")
