"""Which problems of an environment are planned: drawn ones, all of a list, or those of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.storage.problem_file import GivenProblems
from envs import Environment, InputError, Problem
from envs.seeding import TEST_SEEDS, derived_seed, training_seed

PROBLEMS = 50
"""In an environment that can have any number, unless another is asked for."""


@dataclass(frozen=True)
class ProblemChoice:
    """Problems as they are asked for.

    Attributes:
        count: how many; None for all that there are, or `PROBLEMS` where any number can be drawn.
        seed: of problems that are drawn, and of planners' seeds. Of a file's problems one that
            stands for the file as well, so that equal seeds mean equal problems.
        given: those of a file, in place of the environment's own.
    """

    count: int | None
    seed: int
    given: GivenProblems | None = None

    @staticmethod
    def checked(count: int | None, seed: int, file: Path | None = None) -> ProblemChoice:
        """Raises InputError if a number is out of range, or the file is malformed."""
        if count is not None:
            check_range("--problems", count, 1, 1_000_000)
        check_range("--seed", seed, 0, TEST_SEEDS - 1)
        if file is None:
            return ProblemChoice(count, seed)
        given = GivenProblems.read(file)
        of_both = derived_seed(f"problem file {given.digest}", seed)
        return ProblemChoice(count, of_both, given)

    @staticmethod
    def of_selection(selection: Mapping[str, Any]) -> ProblemChoice:
        """What a run was asked for; see `settings` and `data`."""
        given = selection.get("given_problems")
        return ProblemChoice(
            selection["problems"], selection["seed"], given and GivenProblems.of_data(given)
        )

    def of(self, env: Environment) -> list[Problem]:
        """The problems of an environment.

        Raises:
            InputError: it has too few, or those of the file do not fit it.
        """
        if self.given is None:
            return env.sample_problems(self.count or env.problem_count or PROBLEMS, self.seed)
        found = self.given.problems(env, self.seed)
        if self.count is not None and self.count > len(found):
            raise InputError(f"{self.given.file} has {len(found)} problems, not {self.count}")
        return found[: self.count]

    def at(self, env: Environment, indices: Sequence[int]) -> list[Problem]:
        """The problems of an environment with these indices.

        Raises:
            InputError: there is none of one of them.
        """
        if self.given is None:
            return env.problems_at(indices, self.seed)
        found = self.given.problems(env, self.seed)
        return [found[index] for index in indices]

    def warm_up(self, env: Environment) -> Problem:
        """A throw-away problem of the same kind: no test problem, but where the environment has no
        other. Then it leads back from the goal of the first."""
        try:
            return env.sample_problems(1, training_seed("warm-up", self.seed))[0]
        except InputError:
            if self.given is None:
                raise
        [first] = self.at(env, [0])
        return Problem(first.goal, first.start, 0, training_seed("warm-up", self.seed))

    @property
    def settings(self) -> dict[str, Any]:
        """What measurements depend on, of problems that are not drawn."""
        return {} if self.given is None else {"problem_file": self.given.digest}

    @property
    def data(self) -> dict[str, Any]:
        """As a run's selection has it, besides number and seed."""
        return {} if self.given is None else {"given_problems": self.given.data}


def check_range(option: str, value: float, low: float, high: float) -> None:
    """Raises InputError if the value of an option is not between two others, or not a number."""
    if not low <= value <= high:
        raise InputError(f"{option} must be between {low} and {high}, not {value}")
