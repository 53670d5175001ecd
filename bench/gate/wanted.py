"""What somebody wants checked, from the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import planners
from bench.gate.baseline import MEASURES, Baseline
from envs import InputError
from envs.errors import suggestion


@dataclass(frozen=True)
class Wanted:
    """How to check.

    Attributes:
        alpha: the probability of any false alarm in a check, in (0, 1).
        measures: names of `MEASURES` to compare.
        reference: the planner by whose they are measured, without which times do not compare; None
            compares lengths and margins themselves.
        tolerance: the fraction by which they may get worse.
    """

    alpha: float = 0.01
    measures: tuple[str, ...] = ()
    reference: str | None = None
    tolerance: float = 0.1

    @staticmethod
    def parse(
        *,
        alpha: float,
        ratios: str | None,
        reference: str | None,
        tolerance: float,
        update: bool = False,
    ) -> Wanted:
        """Checks the options; `ratios` is as in "length,time". An update needs no reference.

        Raises:
            InputError: a name is unknown, a number is out of its range, or one is given without
                what it needs.
        """
        if not 0 < alpha < 1:
            raise InputError(f"--alpha {alpha:g}: choose a probability above 0 and below 1")
        if not 0 <= tolerance < math.inf:
            raise InputError(f"--tolerance {tolerance:g}: choose a fraction of at least 0")
        measures = tuple(ratios.split(",")) if ratios is not None else ()
        for name in measures:
            if name not in MEASURES:
                raise InputError(f"--ratios: unknown {name!r}; {suggestion(name, MEASURES)}")
        if reference is not None and not measures:
            raise InputError("--reference: name with --ratios what to compare with it")
        if "time" in measures and reference is None and not update:
            raise InputError("--ratios time: name with --reference the planner to compare with")
        return Wanted(alpha, tuple(m for m in MEASURES if m in measures), reference, tolerance)

    def of(self, held: Baseline, where: str) -> Wanted:
        """With the reference by its id, as in a run or a baseline, which holds what is wanted.

        Raises:
            InputError: it does not.
        """
        missing = [name for name in self.measures if name not in held.measures]
        if missing:
            raise InputError(
                f"--ratios: {where} holds no {', '.join(missing)}; write it with "
                f"--update --ratios {','.join(self.measures)}"
            )
        return self if self.reference is None else replace(self, reference=self._id(held, where))

    def _id(self, held: Baseline, where: str) -> str:
        known, name = held.planners, self.reference or ""
        id = planners.REGISTRY.id_among(name, known)
        if id not in known:
            raise InputError(f"--reference: {where} has no {name!r}; {suggestion(name, known)}")
        return id
