"""Problems whose ends are drawn at random, as many as are asked for."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from envs.environment import Environment
from envs.errors import InputError
from envs.problem import Array


@dataclass
class SampledEnds:
    """Ends of problems, as they are found.

    Attributes:
        pairs: start and goal of each problem, (size,) each.
        dropped: how many pairs besides were not joined by the search.
    """

    pairs: list[tuple[Array, Array]] = field(default_factory=list)
    dropped: int = 0


class SampledProblems(Environment):
    """An environment whose problems have ends that are drawn at random.

    A subclass says which pairs of configurations may be ends (`_candidates`), which of them are
    taken (`_take`), and in words why there are no more (`_cause`).

    Attributes:
        most_unjoined: pairs of ends that no path joins, before a world is found to have no problem
            at all.
        most_fruitless: pairs of ends in a row that will not do, before it is found to have too few.
    """

    most_unjoined: int
    most_fruitless: float = math.inf
    _last_sampled: tuple[tuple[int, int], SampledEnds] | None = None

    @abstractmethod
    def _random_numbers(self, seed: int) -> np.random.Generator:
        """The stream that the problems of a seed are drawn from."""

    @abstractmethod
    def _candidates(self, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Pairs of configurations, (size,) each, that may be ends, until there seem to be none."""

    @abstractmethod
    def _take(
        self, found: SampledEnds, rng: np.random.Generator, start: Array, goal: Array
    ) -> bool:
        """Adds a pair that may be ends to what was found if it will do: whether it does."""

    @abstractmethod
    def _cause(self, found: SampledEnds) -> str:
        """Why there are no more problems."""

    def sampled_ends(self, n: int, seed: int) -> SampledEnds:
        """Of the first `n` problems of a seed. The last are kept.

        Raises:
            InputError: there are fewer.
        """
        if self._last_sampled is None or self._last_sampled[0] != (n, seed):
            self._last_sampled = (n, seed), self._sample(n, seed)
        return self._last_sampled[1]

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
        return {"pairs_dropped_as_unsolved": self.sampled_ends(n, seed).dropped}

    def _is_free_for_planners(self, start: Array, goal: Array) -> bool:
        """Whether the shortest way between two configurations (size,) is proved free to the
        tolerance that planners keep."""
        [free] = self.paths_are_free([np.array([start, goal])], self.planning_tolerance)
        return bool(free)

    def _sample(self, n: int, seed: int) -> SampledEnds:
        found, fruitless = SampledEnds(), 0
        if n <= 0:
            return found
        rng = self._random_numbers(seed)
        for start, goal in self._candidates(rng):
            fruitless = 0 if self._take(found, rng, start, goal) else fruitless + 1
            if len(found.pairs) == n:
                return found
            hopeless = found.dropped == self.most_unjoined and not found.pairs
            if hopeless or fruitless == self.most_fruitless:
                break
        raise InputError(f"found only {len(found.pairs)} of {n} problems: {self._cause(found)}")
