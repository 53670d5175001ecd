"""Problem files in the form of OMPL.app's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fuzzing import fuzzed
from mutations import contents
from omplapp_files import PLANAR, SPATIAL, cfg

from envs.files.omplapp_cfg import RigidBodyProblem, read_problem


def test_problems_of_omplapp(tmp_path: Path) -> None:
    file = tmp_path / "own.cfg"

    def parse(content: bytes) -> RigidBodyProblem:
        file.write_bytes(content)
        return read_problem(file)

    def check(problem: RigidBodyProblem) -> None:
        for pose in (problem.start, problem.goal):
            assert np.isfinite(pose.position).all()
            assert np.linalg.norm(pose.quaternion) == pytest.approx(1)
        if problem.volume is not None:
            lower, upper = problem.volume
            assert (lower < upper).all()
            assert len(lower) == (2 if problem.planar else 3)

    fuzzed("problems of OMPL.app", contents([cfg(SPATIAL), cfg(PLANAR)]), parse, check)
