"""Prints how the checks of arms agree with Pinocchio and coal:
python tests/benchmarks/arms_against_coal.py [FOLDER] [SHARE]

Over 60 arms made at random and, of MotionBenchMaker's in a folder, a UR5, a Panda and a Fetch,
50,000 configurations and 20,000 motions in all, or a share of them.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path
from time import perf_counter

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]

from arm_agreement import Agreement, agreement  # noqa: E402
from exact_arms import ExactArm  # noqa: E402
from made_arms import made_arm  # noqa: E402
from real_arms import ROBOTS, real_arm  # noqa: E402

import envs  # noqa: E402
from envs.scenes.arm_world import ArmWorld  # noqa: E402

MADE, CONFIGURATIONS, MOTIONS = 60, 50_000, 20_000


def main(data: str, share: float) -> None:
    whole = Agreement()
    arms = [*(f"made {n}" for n in range(MADE)), *(ROBOTS if data else ())]
    counts = tuple(math.ceil(share * n / len(arms)) for n in (CONFIGURATIONS, MOTIONS))
    for number, name in enumerate(arms):
        with tempfile.TemporaryDirectory() as folder:
            begin = perf_counter()
            if name in ROBOTS:
                text = real_arm(Path(data), Path(folder), name)
            else:
                text = made_arm(Path(folder), number)
            env = envs.make(text)
            assert isinstance(env, ArmWorld)
            exact = ExactArm(Path(folder) / "arm.urdf", env.obstacles, [Path(folder)])
            ours = {frozenset((env.robot.links[i], env.robot.links[j])) for i, j in env.robot.pairs}
            found = agreement(env, exact, *counts, number)
            whole += found
            same = "the same pairs" if ours == exact.pairs_of_links else "OTHER PAIRS"
            print(f"{name}, {same}, {perf_counter() - begin:.0f} s: {found}", flush=True)
    print("all:", whole)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "", float(sys.argv[2]) if sys.argv[2:] else 1.0)
