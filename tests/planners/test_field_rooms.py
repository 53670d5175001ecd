"""Fields in rooms: what is about, modes of free space, bounds along straight lines, execution."""

from __future__ import annotations

import math
from copy import deepcopy
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
import torch

from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld
from envs.speed_model import SpeedModel
from planners.fields import planner as planner_module
from planners.fields.clearance_field import ClearanceMap, clearance_map_of
from planners.fields.indoor_features import CLEARANCES, RoomInputs
from planners.fields.laplacian_eigenmaps import modes_of
from planners.fields.layers import FieldShape
from planners.fields.networks import TimeField
from planners.fields.objectives import LargestSubsolutionInRooms
from planners.fields.path_extraction import Descent, gradients
from planners.fields.physics import Space, steepness_along
from planners.fields.single_query import CompiledField
from planners.learning.trainer import Method

MODES = 6


class TwoRooms(BoxWorld):
    """The cube, halved by a wall at x = 0 that is 0.8 thick, with a door for 6 < y < 9."""

    kind_of_problems = "two rooms"
    advice = ""

    def __init__(self) -> None:
        walls = [
            Box(np.array([0.0, -2.0, 0.0]), np.array([0.8, 16.0, 20.0])),
            Box(np.array([0.0, 9.5, 0.0]), np.array([0.8, 1.0, 20.0])),
        ]
        super().__init__(walls, robot_radius=0.0)
        self.speed_model = SpeedModel(d_min=0.4, d_max=4.0, contact=0.02)

    @property
    def is_interior(self) -> bool:
        return True

    def definition(self) -> dict[str, object]:
        return {"class": "TwoRooms"}


@pytest.fixture(scope="module")
def world() -> TwoRooms:
    return TwoRooms()


@pytest.fixture(scope="module")
def clearances(world: TwoRooms) -> ClearanceMap:
    return clearance_map_of(world)


@pytest.fixture(scope="module")
def rooms(world: TwoRooms) -> RoomInputs:
    inputs = RoomInputs(world, MODES)
    inputs.modes.solve(0)
    return inputs


@pytest.fixture(scope="module")
def net(rooms: RoomInputs) -> TimeField:
    torch.manual_seed(1)
    shape = FieldShape(
        3, frequencies=8, width=32, below=2.0, opening=0.0, computed=CLEARANCES + MODES, modes=MODES
    )
    return TimeField(shape, inputs=rooms).eval()


def points(n: int, seed: int = 0) -> np.ndarray:
    """Free ones (n, 3), in the networks' space, off the wall and inside the door's height."""
    x = np.random.default_rng(seed).uniform(-0.45, 0.45, (4 * n, 3))
    return x[np.abs(x[:, 0]) > 0.05][:n]


def test_clearances_are_the_worlds(world: TwoRooms, clearances: ClearanceMap) -> None:
    x = np.random.default_rng(0).uniform(-0.5, 0.5, (500, 3))
    exact = world.clearance(20 * x) / 4
    assert np.abs(clearances.clearance(x) - exact).max() <= 0.07 * math.sqrt(3) / 2


def test_straight_times_are_integrals_of_slowness(clearances: ClearanceMap) -> None:
    def time(a: list[float], b: list[float]) -> float:
        return float(clearances.straight_times(np.array(a) / 20, np.array(b) / 20))

    assert time([5, -9, 0], [5, 3, 0]) == pytest.approx(12 / 20, rel=1e-3), "at full speed"
    # 2 from the wall all along: half of d_max, half the speed
    assert time([2.4, -9, 0], [2.4, 3, 0]) == pytest.approx(2 * 12 / 20, rel=0.02)
    # away from the wall, from 1 to 4: speed c / 4, time 4 log 4
    assert time([1.4, -5, 0], [4.4, -5, 0]) == pytest.approx(4 * math.log(4) / 20, rel=0.02)
    assert time([5, -5, 0], [-5, -5, 0]) == math.inf, "through the wall"
    assert time([3, 7.5, 0], [-3, 7.5, 0]) < math.inf, "through the door"


def test_straight_times_broadcast(clearances: ClearanceMap) -> None:
    x = points(12).reshape(3, 4, 3)
    times = clearances.straight_times(x[:, :, None], x[:, None])
    assert times.shape == (3, 4, 4)
    assert (times == times.swapaxes(1, 2)).all() or times == pytest.approx(times.swapaxes(1, 2))
    assert (np.diagonal(times, axis1=1, axis2=2) == 0).all()


def test_modes_part_what_a_wall_parts(rooms: RoomInputs) -> None:
    def resistance(a: list[float], b: list[float]) -> float:
        modes = rooms.at(np.array([a, b]) / 20, slopes=False)[:, 0, CLEARANCES:]
        return float((((modes[0] - modes[1]) / 2) ** 2).sum())

    across = resistance([0.7, -6, 0], [-0.7, -6, 0])
    within = resistance([0.7, -6, 0], [4.0, -6, 0])
    through = resistance([0.7, 7.5, 0], [-0.7, 7.5, 0])
    assert across > 5 * within
    assert across > 3 * through
    assert resistance([5, -6, 0], [-5, -6, 0]) > resistance([5, 6, 0], [-5, 6, 0]), "the way round"


def test_the_median_resistance_is_the_median_distance(rooms: RoomInputs, world: TwoRooms) -> None:
    space = Space.of(world)
    a, b = space.uniform(np.random.default_rng(3), 2, 4000)
    modes = [modes_of(rooms.modes.arrays, rooms.clearances.field, x) for x in (a, b)]
    resistance = (((modes[0] - modes[1]) / 2) ** 2).sum(axis=1)
    distance = np.linalg.norm(a - b, axis=1)
    assert np.median(resistance) == pytest.approx(np.median(distance), rel=0.1)


def test_code_that_is_compiled_for_solved_modes_is_that_for_modes_of_a_file(
    rooms: RoomInputs, world: TwoRooms
) -> None:
    read = RoomInputs(world, MODES)
    as_in_files = {name: value.contiguous() for name, value in rooms.state_dict().items()}
    read.load_state_dict(as_in_files)
    assert numba.typeof(rooms.mode_arrays) == numba.typeof(read.mode_arrays)


def test_modes_come_back_from_weights(net: TimeField, world: TwoRooms) -> None:
    fresh = TimeField(net.shape, inputs=RoomInputs(world, MODES)).eval()
    fresh.load_state_dict(net.state_dict())
    a, b = (torch.from_numpy(points(20, seed)).float() for seed in (1, 2))
    for wanted, found in zip(net(a, b), fresh(a, b), strict=True):
        assert torch.equal(wanted, found)
    assert deepcopy(fresh).inputs.clearances is fresh.inputs.clearances
    with pytest.raises((RuntimeError, ValueError), match="modes"):
        RoomInputs(world, MODES + 1).load_state_dict(net.inputs.state_dict())


@pytest.mark.slow
def test_solving_twice_gives_the_same(world: TwoRooms, rooms: RoomInputs) -> None:
    again = RoomInputs(world, MODES)
    again.modes.solve(0)
    assert torch.equal(again.modes.table, rooms.modes.table)


@pytest.mark.slow
def test_inputs_derivatives_are_finite_differences(rooms: RoomInputs) -> None:
    x = points(200)
    rows = rooms.at(x)
    h = 1e-5
    errors = []
    for axis in range(3):
        step = h * np.eye(3)[axis]
        difference = rooms.at(x + step, slopes=False) - rooms.at(x - step, slopes=False)
        errors.append(np.abs(difference[:, 0] / (2 * h) - rows[:, 1 + axis]))
    scale = np.abs(rows[:, 1:]).mean()
    # Both are piecewise smooth, and differences straddle the pieces' borders now and then.
    assert np.quantile(np.stack(errors), 0.9) < 0.05 * scale


@pytest.mark.slow
def test_the_compiled_field_is_the_networks(net: TimeField) -> None:
    a, b = (points(30, seed).astype(np.float32) for seed in (1, 2))
    with torch.no_grad():
        stretch, *slopes = (x.numpy() for x in net(torch.from_numpy(a), torch.from_numpy(b)))
    compiled = CompiledField(net)
    for i in range(30):
        found, by_ends = compiled.pair(a[i], b[i])
        assert found == pytest.approx(stretch[i], abs=1e-4)
        assert by_ends == pytest.approx(np.stack([s[i] for s in slopes]), rel=1e-3, abs=2e-3)


def test_swapping_start_and_goal_changes_nothing(net: TimeField) -> None:
    a, b = (torch.from_numpy(points(30, seed)).float() for seed in (1, 2))
    there, back = net(a, b), net(b, a)
    assert torch.allclose(there[0], back[0], atol=1e-5)
    assert torch.allclose(there[1], back[2], rtol=1e-3, atol=1e-3)


def test_the_stretch_of_all_pairs_is_that_of_each(net: TimeField) -> None:
    starts = torch.from_numpy(points(6, 1)).float().reshape(2, 3, 3)
    goals = torch.from_numpy(points(8, 2)).float().reshape(2, 4, 3)
    stretch, at_start, at_goal = net.all_pairs(starts, goals)
    one, one_start, one_goal = net(starts[1, 2][None], goals[1, 3][None])
    assert torch.allclose(stretch[1, 2, 3], one[0], atol=1e-5)
    assert torch.allclose(at_start[1, 2, 3], one_start[0], atol=1e-3)
    assert torch.allclose(at_goal[1, 2, 3], one_goal[0], atol=1e-3)
    alone = net.stretch(starts[:, 0], goals)
    assert torch.allclose(alone, stretch[:, 0], atol=1e-5)


def test_gradients_of_the_stretch_are_finite_differences(net: TimeField) -> None:
    a, b = (torch.from_numpy(points(60, seed)).double() for seed in (1, 2))
    net = deepcopy(net).double()
    h = 1e-5
    with torch.no_grad():
        _, at_a, _ = net(a, b)
        for axis in range(3):
            step = h * torch.eye(3, dtype=torch.float64)[axis]
            difference = (net(a + step, b)[0] - net(a - step, b)[0]) / (2 * h)
            error = (difference - at_a[:, axis]).abs()
            assert error.quantile(0.8) < 0.05 * at_a.abs().mean()


def test_only_rises_that_are_too_steep_cost(net: TimeField) -> None:
    inf = math.inf
    rise = torch.tensor([1.0, -2.0, 0.5, 9.0, 9.0])
    time = torch.tensor([1.0, 1.0, 1.0, inf, 0.0])
    # Counted are the first three; only the second costs: 2 sinh(log(2) / 2) = sqrt(2) - 1/sqrt(2)
    wanted = (math.sqrt(2) - 1 / math.sqrt(2)) / 3
    assert steepness_along(rise, time).item() == pytest.approx(wanted)
    rise = torch.tensor([3.0, 9.0], requires_grad=True)
    steepness_along(rise, torch.tensor([1.0, inf])).backward()  # type: ignore[no-untyped-call]
    assert rise.grad is not None
    assert rise.grad.isfinite().all()
    assert rise.grad[0] > 0
    assert rise.grad[1] == 0


def test_points_and_times_of_the_objective(net: TimeField, world: TwoRooms) -> None:
    objective = LargestSubsolutionInRooms()
    objective.prepare(world, 0, Path("unused"), lambda share: None)
    drawn, log_speed, times = objective.draw(np.random.default_rng(0))
    plan = objective.plan
    assert drawn.shape == (plan.groups, plan.points, 3)
    assert times.shape == (plan.groups, plan.points, plan.points)
    clearance = world.clearance(20 * drawn.numpy().reshape(-1, 3).astype(np.float64))
    assert (clearance > 0).all(), "within no wall"
    speed = world.speed_model(clearance).reshape(log_speed.shape)
    assert log_speed.numpy() == pytest.approx(np.log(speed), abs=1e-3)
    starts_apart = (drawn[:, 0] - drawn[:, 1]).norm(dim=-1).median()
    goals_apart = (drawn[:, 0] - drawn[:, plan.starts]).norm(dim=-1).median()
    assert starts_apart < goals_apart / 2, "starts are close to each other, goals elsewhere"
    loss = objective.loss(net, (drawn, log_speed, times), 0.5)
    assert loss.isfinite()


@pytest.mark.slow
def test_a_true_speed_step_is_as_long_as_the_speed_allows(net: TimeField, world: TwoRooms) -> None:
    compiled = CompiledField(net)
    start, goal = (np.array(x, dtype=np.float32) / 20 for x in ([2.4, -5, 0], [7, 5, 0]))
    low, high = np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32)
    few = Descent(step=0.01, moves=(True, False), most_steps=400, true_speed=True, meeting=0.6)
    assert compiled.descend(start, goal, low, high, few) is not None, "near enough at once"
    one = Descent(step=0.01, most_steps=1, meeting=1e-3, true_speed=True)
    ends = np.stack([start, goal])
    moved = compiled.after(ends, low, high, one)
    assert np.linalg.norm(moved[0] - start) == pytest.approx(0.01 * 2.0 / 4, rel=0.05)
    assert np.linalg.norm(moved[1] - goal) == pytest.approx(0.01, rel=0.01)
    _, at_start, _ = gradients(net, *(torch.from_numpy(x)[None] for x in (start, goal)))
    down = -at_start[0].detach().numpy() / np.linalg.norm(at_start[0].detach().numpy())
    assert (moved[0] - start) @ down == pytest.approx(np.linalg.norm(moved[0] - start), rel=1e-2)


@pytest.mark.slow
def test_ends_are_pushed_out_of_walls(net: TimeField, world: TwoRooms) -> None:
    compiled = CompiledField(net)
    low, high = np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32)
    ends = np.array([[0.41, -5, 0], [0.3, 3, 0]], dtype=np.float32) / 20  # at the wall, within it
    pushed = Descent(step=1e-6, most_steps=1, meeting=1e-3, margin=0.15)
    after = compiled.after(ends, low, high, pushed)
    assert world.clearance(20 * after.astype(np.float64)) / 4 == pytest.approx(0.15, abs=0.03)


@pytest.mark.slow
def test_ends_on_both_sides_of_a_wall_are_not_joined(net: TimeField) -> None:
    compiled = CompiledField(net)
    low, high = np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32)
    a, b = (np.array(x, dtype=np.float32) / 20 for x in ([0.5, -5, 0], [-0.5, -5, 0]))
    joined = Descent(step=1e-6, most_steps=1, meeting=0.1)
    assert compiled.descend(a, b, low, high, joined) is not None
    careful = Descent(step=1e-6, most_steps=1, meeting=0.1, margin=0.01)
    assert compiled.descend(a, b, low, high, careful) is None


@pytest.mark.slow
@pytest.mark.parametrize("descent", planner_module.ATTEMPTS_IN_ROOMS)
@pytest.mark.parametrize("x", [0.405, 0.41, 0.2, 5.0], ids=["touching", "near", "within", "far"])
def test_ends_in_one_place_have_met(net: TimeField, descent: Descent, x: float) -> None:
    low, high = np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32)
    place = np.array([x, -5, 0], dtype=np.float32) / 20
    path = CompiledField(net).descend(place, place.copy(), low, high, descent)
    assert path is not None
    assert (path == place).all()


@pytest.mark.slow
def test_where_every_place_is_behind_a_wall_there_is_no_escape(net: TimeField) -> None:
    """Times through walls are infinite."""
    within = np.array([[0.0, -5, 0], [0.1, -5.3, 0]], dtype=np.float32) / 20
    assert CompiledField(net).escaped(within, 0) is None


@pytest.mark.slow
def test_an_escape_is_to_a_place_in_sight_with_a_smaller_time(net: TimeField) -> None:
    compiled = CompiledField(net)
    world = TwoRooms()
    clearances = clearance_map_of(world)
    low, high = np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32)

    def time(ends: np.ndarray) -> float:
        return float(np.exp(compiled.pair(*ends)[0]) * np.linalg.norm(ends[0] - ends[1]))

    stays = Descent(step=1e-7, most_steps=1, meeting=1e-3, escapes=1)
    escaped = 0
    for start, goal in points(40).astype(np.float32).reshape(20, 2, 3):
        ends = np.stack([start, goal])
        found = compiled.escaped(ends, 0)
        if found is not None:
            escaped += 1
            [end] = np.flatnonzero((found != ends).any(axis=1))
            assert clearances.straight_times(ends[end], found[end]) < np.inf
            assert time(found) < time(ends)
    assert escaped > 10
    assert compiled.descend(start, goal, low, high, stays) is None


@pytest.mark.slow
def test_a_path_with_escapes_is_in_one_piece(net: TimeField) -> None:
    compiled = CompiledField(net)
    low, high = np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32)
    hasty = Descent(step=0.02, most_steps=2, meeting=0.3, true_speed=True, escapes=40)
    paths = 0
    for start, goal in points(40, 3).astype(np.float32).reshape(20, 2, 3):
        path = compiled.descend(start, goal, low, high, hasty)
        if path is not None:
            paths += 1
            assert (path[0] == start).all()
            assert (path[-1] == goal).all()
            assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= 5.0 * 4 / 20 + 1e-6
    assert paths > 0


@pytest.mark.slow
def test_nothing_is_left_to_be_compiled_on_the_clock(
    net: TimeField, world: TwoRooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: dict[str, Any] = {}
    for name in ("descend", "escaped"):
        whole = getattr(CompiledField, name)

        def noted(
            self: CompiledField, *arguments: Any, name: str = name, whole: Any = whole
        ) -> Any:
            compiled[name] = whole(self, *arguments)
            return compiled[name]

        monkeypatch.setattr(CompiledField, name, noted)
    same = Method(lambda env: deepcopy(net), LargestSubsolutionInRooms)
    monkeypatch.setattr(planner_module, "method", lambda name, env: same)
    planner = planner_module.FieldPlanner("ntfields")
    planner.load(world, {name: value.numpy() for name, value in net.state_dict().items()})
    assert set(compiled) == {"descend", "escaped"}
    assert compiled["descend"] is not None, "what is done to a path that is found is compiled too"
