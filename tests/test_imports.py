"""What is imported where: large libraries cost those alone who use them."""

from __future__ import annotations

import subprocess
import sys

import pytest

LARGE = ("torch", "matplotlib", "plotly", "skfmm", "pandas")

TEXT = f"""
import sys
import bench.execution.worker
import envs, planners
world = envs.make("arm4")
planners.make("rrtconnect").setup(world, seed=0)
print(*[name for name in {LARGE} if name in sys.modules])
"""


def test_sampling_planners_do_without_large_libraries() -> None:
    """Their processes would start a second later, and take 200 MB more that counts as theirs."""
    done = subprocess.run([sys.executable, "-c", TEXT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


NUMERICAL = ("numpy", "scipy", "numba", "pandas", "torch", "matplotlib", "trimesh", "fcl", "ompl")
SLOW = (*NUMERICAL, "pydantic")


@pytest.mark.parametrize(
    "arguments", [["--version"], ["--help"], ["run", "--help"], ["list"], ["list", "--json"]]
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
