"""Fields of arms: what networks are told, compiled execution, which methods there are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

import envs
import planners
from envs.scenes.arm_world import ArmWorld
from planners.fields import methods
from planners.fields.computed_inputs import PER_CLEARANCE
from planners.fields.networks import TimeField
from planners.fields.objectives import LargestSubsolution
from planners.fields.path_extraction import Descent, gradients
from planners.fields.planner import ATTEMPTS_FOR_ARMS, FieldPlanner
from planners.fields.robot_features import ArmInputs, arm_clearance_at, arm_outward, size_of_inputs
from planners.fields.single_query import CompiledField
from planners.learning.training_loop import Recipe, Steps, TrainingState, train


@pytest.fixture(scope="module", params=["arm4", "arm6"])
def world(request: pytest.FixtureRequest) -> ArmWorld:
    made = envs.make(request.param)
    assert isinstance(made, ArmWorld)
    return made


@pytest.fixture(scope="module")
def net(world: ArmWorld) -> TimeField:
    torch.manual_seed(0)
    made = methods.method("ntfields", world).network(world)
    assert isinstance(made, TimeField)
    return made.eval()


def points(world: ArmWorld, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (n, world.dimension))


@pytest.mark.slow
def test_inputs_have_their_derivatives(world: ArmWorld) -> None:
    inputs = ArmInputs(world)
    x = points(world, 400)
    rows = inputs.at(x)
    assert rows.shape == (400, 1 + world.dimension, inputs.size)
    assert inputs.size == size_of_inputs(world.robot.arrays) == (2 + 3 + 3) * world.dimension
    for axis in range(world.dimension):
        step = 1e-6 * np.eye(world.dimension)[axis]
        slope = (inputs.at(x + step)[:, 0] - inputs.at(x - step)[:, 0]) / 2e-6
        error = np.abs(slope - rows[:, 1 + axis]).max(axis=1)
        # Where another sphere or obstacle becomes the nearest there is a kink.
        assert np.quantile(error, 0.98) < 1e-4


@pytest.mark.slow
def test_inputs_know_sines_places_and_clearances(world: ArmWorld) -> None:
    d = world.dimension
    x = points(world, 50)
    inputs = ArmInputs(world)
    first = inputs.at(x)[:, 0]
    q = x * inputs.field.extent + inputs.field.middle
    assert first[:, :d] == pytest.approx(np.sin(q))
    assert first[:, d : 2 * d] == pytest.approx(np.cos(q))
    # The far end of body 1 is the origin of joint 2, which carries body 2.
    link = next(n for n, link in enumerate(world.robot.tree.links) if link.body == 2)
    assert first[:, 2 * d : 2 * d + 3] == pytest.approx(
        world.robot.tree.forward(q)[:, link, :3, 3], abs=1e-9
    )
    nearness = first[:, 5 * d + 2 :: 3]  # of each body: 1 less its clearance, between 0 and 1.5
    clearance = world.approximate_clearance(q) / world.speed_model.d_max
    assert nearness.max(axis=1) == pytest.approx(np.clip(1 - clearance, 0, 1.5))


@pytest.mark.slow
def test_inputs_of_a_body_are_told_what_it_must_not_touch() -> None:
    """Those of the last link, which may touch all but a few obstacles, are as if only these were
    there, and those of the others as if it must not touch any."""
    made = envs.make("arm4")
    assert isinstance(made, ArmWorld)
    arm, last, m = made.robot, made.robot.links[made.robot.moving - 1], made.dimension
    names = [f"o{n}" for n in range(len(made.obstacles))]
    kept = {"o1", "o5", "o9"}
    few = [one for one, name in zip(made.obstacles, names, strict=True) if name in kept]
    world = ArmWorld(
        arm,
        made.obstacles,
        "test",
        names=names,
        allows=lambda link, name: link == last and name not in kept,
    )
    x = points(world, 200)
    found, every, of_few = (
        ArmInputs(one).at(x) for one in (world, made, ArmWorld(arm, few, "test"))
    )
    first = world.robot.arrays.bodies[world.robot.moving - 1] - 1
    of_last = slice(2 * m + 3 * m + PER_CLEARANCE * first, None)
    assert first == m - 1
    assert (found[..., : of_last.start] == every[..., : of_last.start]).all()
    assert (found[..., of_last] == of_few[..., of_last]).all()
    assert (found != every).any()
    assert_pushes_lead_out(world)


@pytest.mark.slow
def test_the_compiled_network_is_the_network(world: ArmWorld, net: TimeField) -> None:
    compiled = CompiledField(net)
    starts, goals = (torch.from_numpy(points(world, 30, seed)).float() for seed in (1, 2))
    with torch.no_grad():
        stretch, at_start, at_goal = net(starts, goals)
    for n in range(30):
        found, slopes = compiled.pair(starts[n].numpy(), goals[n].numpy())
        assert found == pytest.approx(float(stretch[n]), abs=1e-4)
        assert slopes[0] == pytest.approx(at_start[n].numpy(), abs=2e-3, rel=2e-3)
        assert slopes[1] == pytest.approx(at_goal[n].numpy(), abs=2e-3, rel=2e-3)


@pytest.mark.slow
def test_the_field_is_symmetric_with_the_right_gradients(world: ArmWorld, net: TimeField) -> None:
    a, b = (torch.from_numpy(points(world, 40, seed)).double() for seed in (3, 4))
    net64 = methods.method("ntfields", world).network(world).double()
    net64.load_state_dict(net.state_dict())
    step = 1e-6 * torch.eye(world.dimension, dtype=torch.float64)[1]
    with torch.no_grad():
        times, at_a, _ = gradients(net64, a, b)
        assert torch.equal(times, gradients(net64, b, a)[0])
        rise = (gradients(net64, a + step, b)[0] - gradients(net64, a - step, b)[0]) / 2e-6
    error = (rise - at_a[:, 1]).abs() / at_a[:, 1].abs().clamp_min(1)
    assert float(error.quantile(0.95)) < 1e-4


@pytest.mark.slow
def test_pushes_lead_out_of_obstacles(world: ArmWorld) -> None:
    assert_pushes_lead_out(world)


def assert_pushes_lead_out(world: ArmWorld) -> None:
    field = ArmInputs(world).field
    step = np.empty(world.dimension)
    gained = []
    for x in points(world, 1000):
        before = arm_clearance_at(field, x)
        if -0.05 < before < 0.1:
            arm_outward(field, x, 0.05, step)
            assert np.linalg.norm(step) <= 0.02 + 1e-9
            gained.append(arm_clearance_at(field, x + step) - before)
    assert len(gained) > 10
    assert np.median(gained) == pytest.approx(0.05, abs=0.02)
    assert np.mean(np.array(gained) > 0) > 0.9


@pytest.mark.slow
def test_execution_keeps_within_the_joints_limits(world: ArmWorld, net: TimeField) -> None:
    compiled = CompiledField(net)
    low, high = (np.full(world.dimension, end, dtype=np.float32) for end in (-0.5, 0.5))
    pushed = Descent(step=0.02, most_steps=60, true_speed=True, margin=0.3)
    for ends in points(world, 20, 5).astype(np.float32).reshape(10, 2, -1):
        assert (np.abs(compiled.after(ends, low, high, pushed)) <= 0.5).all()


@pytest.mark.slow
def test_ends_in_one_place_have_met_however_near_an_obstacle(
    world: ArmWorld, net: TimeField
) -> None:
    compiled = CompiledField(net)
    low, high = (np.full(world.dimension, end, dtype=np.float32) for end in (-0.5, 0.5))
    field = ArmInputs(world).field
    near = [x for x in points(world, 2000, 3) if -0.1 < arm_clearance_at(field, x) < 0.02][:5]
    assert near
    for place in np.array(near, dtype=np.float32):
        for descent in ATTEMPTS_FOR_ARMS:
            path = compiled.descend(place, place.copy(), low, high, descent)
            assert path is not None
            assert (path == place).all()


def test_methods_that_do_not_fit_say_why() -> None:
    arm4, arm6 = envs.make("arm4"), envs.make("arm6")
    for name in ("ntfields-wenc", "ntfields-wenc-early", "ntfields-paper"):
        assert "point" in str(planners.make(name).unsupported(arm4))
    assert planners.make("ief3d").unsupported(arm4) is None
    assert "6 dimensions" in str(planners.make("ief3d").unsupported(arm6))
    assert "resolution" in str(planners.make("fmm").unsupported(arm6))
    assert planners.make("fmm:resolution=11").unsupported(arm6) is None
    assert planners.make("mpnet").unsupported(arm4) is not None


@pytest.mark.training
def test_a_short_training_solves_most_problems(tmp_path: Path) -> None:
    world = envs.make("arm4")
    method = methods.method("ntfields", world)
    torch.manual_seed(0)
    state = TrainingState.begin(method.network(world), method.recipe)
    objective = LargestSubsolution()
    objective.prepare(world, 0, tmp_path, lambda share: None)
    recipe = Recipe(steps=250, averaging=0.98)
    average = train(state, objective, recipe, Steps(250), seed=0)
    planner = FieldPlanner("ntfields")
    planner._use(world, average)
    problems = world.sample_problems(40, 2**33)
    results = planner.solve_batch(problems)
    solved = [r for r in results if r.status is planners.Status.EXACT_SOLUTION]
    assert len(solved) >= 30
    model = world.collision_model()
    assert all(model.min_clearance(r.path) > model.tolerance for r in solved)
