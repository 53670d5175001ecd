"""What is imported where: large libraries cost those alone who use them."""

from __future__ import annotations

import subprocess
import sys

import pytest

LARGE = ("matplotlib", "plotly", "pandas", "scipy.interpolate")

TEXT = """
import sys
import bench.execution.worker
import envs, planners
world = envs.make({env!r})
planners.make({planner!r}).setup(world, seed=0)
print(*[name for name in {large} if name in sys.modules])
"""


@pytest.mark.parametrize(
    ("planner", "env", "large"),
    [
        ("rrtconnect", "arm4", ("torch", "skfmm", *LARGE)),
        pytest.param(
            *("ntfields", "c3d", ("trimesh", "scipy.ndimage", "scipy.optimize", *LARGE)),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_planners_processes_do_without_large_libraries(
    planner: str, env: str, large: tuple[str, ...]
) -> None:
    """They would start a second later, and take 200 MB more that counts as theirs."""
    text = TEXT.format(planner=planner, env=env, large=large)
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


NUMERICAL = ("numpy", "scipy", "numba", "pandas", "torch", "matplotlib", "trimesh", "fcl", "ompl")
SLOW = (*NUMERICAL, "pydantic")


@pytest.mark.parametrize(
    "arguments",
    [
        ["--version"],
        ["--help"],
        ["run", "--help"],
        ["list"],
        ["list", "--json"],
        ["list", "robots"],
    ],
)
def test_nothing_slow_is_imported_before_it_is_used(arguments: list[str]) -> None:
    text = (
        "import sys\nfrom bench.cli import main\n"
        f"code = main({arguments})\n"
        f"print([name for name in {SLOW} if name in sys.modules], file=sys.stderr)\n"
        "sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout
    assert done.stderr.strip() == "[]"
