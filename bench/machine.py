"""What a run was measured on: machine, versions, state of the source."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

import psutil

from bench.process import ONE_THREAD
from envs.cores import usable_cores

_PACKAGES = (
    "plannerbench",
    "numpy",
    "scipy",
    "torch",
    "ompl",
    "scikit-fmm",
    "trimesh",
    "python-fcl",
    "pandas",
)


def physical_cores() -> int:
    """Physical cores that this process may use, as far as the system tells."""
    return usable_cores()


def _usable_cpus() -> list[int]:
    """The logical processors that this process may use, by the system's numbers."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def describe() -> dict[str, Any]:
    """JSON data that names the machine, the versions in use, the git state ("-dirty" if tracked
    files have changes) and how threads are pinned."""
    return {
        "machine": {
            "system": platform.platform(),
            "processor": _processor(),
            "physical_cores": physical_cores(),
            "usable_cpus": _usable_cpus(),
            "memory_mb": psutil.virtual_memory().total // 2**20,
        },
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in _PACKAGES},
        "git": _git_state(),
        "threads_per_worker": 1,
        "thread_variables": dict(ONE_THREAD),
    }


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _git_state() -> str | None:
    """The commit of the source tree and whether it has changes, None outside a checkout."""
    root = Path(__file__).parents[1]
    if not (root / ".git").exists():
        return None
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],
            cwd=root,
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout.strip() or None
