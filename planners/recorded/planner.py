"""Replays paths that were planned elsewhere, so that they stand in the tables beside ours."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from envs import Environment, InputError, Problem
from envs.registry.spec import digest
from planners.base import Budget, Planner, PlannerResult, Status
from planners.recorded.path_file import PathFile, RecordedPath, check_fits, read


class RecordedPaths(Planner):
    """Gives for each problem the path that a file has for it, with the time that it claims.

    A problem that the file says nothing of was not solved: its status is `TIMEOUT`. What the file
    has for problems that nobody asks about is left alone.

    Args:
        file: of paths, each with its problem's index; see `planners.recorded.path_file`. It must
            be given.

    Raises:
        InputError: it is not.
    """

    improves = False
    planned_elsewhere = True

    def __init__(self, file: Path | None = None) -> None:
        if file is None:
            raise InputError("recorded: name a file of paths, as in recorded:file=paths.json")
        self._file = file

    @cached_property
    def _said(self) -> PathFile:
        return read(self._file)

    @cached_property
    def _by_problem(self) -> dict[int, RecordedPath]:
        """Raises InputError if it is not clear which path is for which problem."""
        found: dict[int, RecordedPath] = {}
        for path in self._said.paths:
            if path.problem is None:
                raise InputError(f"{self._file}: {path.place} does not say for which problem it is")
            other = found.setdefault(path.problem, path)
            if other is not path:
                raise InputError(
                    f"{self._file}: {path.place} and {other.place} are both for problem "
                    f"{path.problem}; keep one path a problem"
                )
        return found

    def weights_digest(self, env: Environment) -> str:
        """The digest of the file, so that its paths are judged again once it is another.

        Raises:
            InputError: it cannot be read, is malformed, or is not for this environment.
        """
        self._check(env)
        return digest(self._file)

    def setup(self, env: Environment, *, seed: int) -> None:
        """Reads the file.

        Raises:
            InputError: as `weights_digest`.
        """
        self._check(env)

    def set_scene(self, env: Environment) -> None:
        """There is nothing to prepare: paths are as they are."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        """What the file says of the problem, by its index."""
        path = self._by_problem.get(problem.index)
        if path is None:
            return PlannerResult(Status.TIMEOUT, None, {"failure": "the file has no path for it"})
        said = {"claimed_solve_s": path.solve_s, "failure": path.failure or None}
        stats = {name: value for name, value in said.items() if value is not None}
        return PlannerResult(path.status, path.waypoints, stats)

    def _check(self, env: Environment) -> None:
        check_fits(self._said, env, self._file)
        assert self._by_problem
