"""Prints what exact checks of real robots cost, one at a time, among ten boxes and cylinders:

    python tests/benchmarks/validity_cost.py DATA/mbm [ROBOT ...]

of panda, ur5, fetch and baxter: the mean of a validity check of random configurations, of those
that are valid, of the least distance, and of a certified motion of 0.3 rad from such a one that is
free; each the least of five rounds. Compilation is not counted. Beside it Pinocchio and coal, by
whose broad phase contact is asked for, and the distances of all pairs; insides they do not see.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import coal
import numpy as np
import pinocchio as pin

import envs
from envs.problem import Array

GROUPS = {
    "panda": "panda_arm",
    "ur5": "manipulator",
    "fetch": "arm_with_torso",
    "baxter": "both_arms",
}
CONFIGURATIONS, MOTIONS, ROUNDS, STEP = 500, 100, 5, 0.3

COLUMNS = (
    *("robot", "joints", "shapes", "check us", "valid", "of valid ones us", "distance us"),
    *("free motion us", "free", "coal: contact us", "coal: distances us"),
)


def main(data: Path, names: Sequence[str]) -> None:
    print("|", " | ".join(COLUMNS), "|")
    print("|" + "---|" * len(COLUMNS))
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.yaml"
        scene.write_text(json.dumps({"obstacles": obstacles()}))
        for name in names or GROUPS:
            row(data / name / name, GROUPS[name], scene)


def obstacles() -> list[dict[str, Any]]:
    """Five boxes and five cylinders within reach, none at the base."""
    rng = np.random.default_rng(5)
    found: list[dict[str, Any]] = []
    while len(found) < 10:
        place = rng.uniform([-0.9, -0.9, 0.0], [0.9, 0.9, 1.2])
        if np.hypot(*place[:2]) < 0.35:
            continue
        if len(found) % 2:
            sizes = {"cylinder": rng.uniform([0.03, 0.1], [0.08, 0.4]).tolist()}
        else:
            sizes = {"box": rng.uniform(0.08, 0.3, 3).tolist()}
        found.append({**sizes, "position": place.tolist()})
    return found


def row(robot: Path, group: str, scene: Path) -> None:
    env = envs.make(f"arm:urdf={robot}.urdf,srdf={robot}.srdf,group={group},scene={scene}")
    model, rng = env.collision_model(), np.random.default_rng(0)
    q = rng.uniform(env.lower, env.upper, (CONFIGURATIONS, env.dimension))
    valid = np.array([model.is_valid(one) for one in q])
    begin = q[valid][:MOTIONS]
    step = rng.normal(size=begin.shape)
    step *= STEP / np.linalg.norm(step, axis=1, keepdims=True)
    motions = [
        (a, b) for a, b in zip(begin, begin + step, strict=True) if model.segment_is_free(a, b)
    ]
    of_all, of_valid = mean_us(model.is_valid, q[:, None]), mean_us(model.is_valid, q[valid, None])
    of_distance = mean_us(model.clearance, q[valid, None][:MOTIONS])
    of_motions = mean_us(model.segment_is_free, motions)
    contact, distances = by_coal(robot, scene)
    print(
        f"| {robot.name} | {env.dimension} | {len(env.robot.shapes)} | {of_all:.1f} | "
        f"{valid.mean():.0%} | {of_valid:.1f} | {of_distance:.0f} | {of_motions:.0f} | "
        f"{len(motions)} of {len(begin)} | {contact:.1f} | {distances:.0f} |",
        flush=True,
    )


def by_coal(robot: Path, scene: Path) -> tuple[float, float]:
    """Microseconds of a contact check and of all distances, of random configurations."""
    file, folder = str(robot.with_suffix(".urdf")), str(robot.parent)
    model = pin.buildModelFromUrdf(file)
    shapes = pin.buildGeomFromUrdf(model, file, pin.GeometryType.COLLISION, package_dirs=[folder])
    for number, entry in enumerate(json.loads(scene.read_text())["obstacles"]):
        solid = coal.Box(*entry["box"]) if "box" in entry else coal.Cylinder(*entry["cylinder"])
        place = pin.SE3(np.eye(3), np.array(entry["position"]))
        shapes.addGeometryObject(pin.GeometryObject(f"obstacle {number}", 0, 0, place, solid))
    shapes.addAllCollisionPairs()
    pin.removeCollisionPairs(model, shapes, str(robot.with_suffix(".srdf")))
    data, at = model.createData(), shapes.createData()
    limits = model.lowerPositionLimit, model.upperPositionLimit
    low, high = (limit.clip(-3.2, 3.2) for limit in limits)
    q = [pin.randomConfiguration(model, low, high) for _ in range(CONFIGURATIONS)]
    manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(model, shapes, at)

    def touches(one: Array) -> bool:
        return bool(pin.computeCollisions(model, data, manager, one, True))

    def distances(one: Array) -> None:
        pin.updateGeometryPlacements(model, data, shapes, at, one)
        pin.computeDistances(shapes, at)

    return mean_us(touches, [(one,) for one in q]), mean_us(distances, [(one,) for one in q[:20]])


def mean_us(function: Callable[..., object], calls: Sequence[Sequence[Array]] | Array) -> float:
    """Of the calls with such arguments, in the fastest round."""
    rounds = []
    for _ in range(ROUNDS):
        begin = perf_counter()
        for arguments in calls:
            function(*arguments)
        rounds.append((perf_counter() - begin) / len(calls))
    return min(rounds) * 1e6


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
