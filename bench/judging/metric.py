"""What a metric is, and measuring an attempt by some of them."""

from __future__ import annotations

import logging
import math
import re
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any

from envs import Environment, InputError, Problem
from envs.errors import reason
from envs.problem import Array

logger = logging.getLogger(__name__)

LOWER, HIGHER = "lower", "higher"
RATIO, DIFFERENCE = "ratio", "difference"

CONFIGURATION_UNIT, WORKSPACE_UNIT = "configuration", "workspace"
"""As a metric's unit: that of an environment's configurations, or of lengths in its workspace."""

_MOST_DIGITS = 12


@dataclass(frozen=True)
class Simplified:
    """A path that was simplified.

    Attributes:
        path: (k, d).
        seconds: that it took.
    """

    path: Array
    seconds: float


@dataclass(frozen=True)
class SolvedAttempt:
    """What is known of an attempt besides its path, which was judged to be valid.

    Attributes:
        solve_s: float, planning time in seconds; None of a path that no planner was timed for.
        cpu_s: float, the processor's time in seconds, or None.
        safety_margin: float, the judge's: least clearance along the path, in workspace units.
        cost_history: float64 (n, 2), in order of time: seconds since the start of `solve`, and the
            length of the best path so far. Empty if the planner keeps none.
        stats: what else the planner said, by name.
        simplified: the path after `--simplify`, if that was asked for and the judge takes it.
    """

    solve_s: float | None
    cpu_s: float | None
    safety_margin: float
    cost_history: Array
    stats: Mapping[str, Any] = field(default_factory=dict)
    simplified: Simplified | None = None


Compute = Callable[[Environment, Problem, Array, SolvedAttempt], float | None]


@dataclass(frozen=True)
class Metric:
    """A number that says how good a verified solution is.

    Attributes:
        name: str, in records, files and on the command line: small letters, digits and _.
        title: str, in tables.
        unit: str, as "s"; empty for a number without one. `CONFIGURATION_UNIT` and
            `WORKSPACE_UNIT` are the environment's.
        digits: int, decimals in tables.
        better: "lower" or "higher".
        compute: function of the environment, the problem, the path's waypoints (float64 (k, d), in
            the environment's unit, valid by the judge) and the `SolvedAttempt`. It gives a float,
            or None where the metric has no meaning.
        effect: "ratio" or "difference", by which two planners are compared on a problem; where a
            value is not positive it is the difference in any case.
        timed: bool, whether it depends on the machine and how busy that is, so that it compares
            only where these are the same.
        primary: bool, whether it stands in the main table and is compared unless others are asked
            for.
        origin: str, the file or package that it is from; empty for this program's.
        version: str, changes with how it is computed: values of another one are computed anew.

    Raises:
        InputError: one of them is none.

    Example:
        >>> import numpy as np
        >>> def detour(env, problem, path, attempt):
        ...     steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
        ...     return steps.sum() / np.linalg.norm(problem.goal - problem.start)
        >>> Metric("detour", "detour", "", 2, "lower", detour).heading()
        'detour'
    """

    name: str
    title: str
    unit: str
    digits: int
    better: str
    compute: Compute = field(compare=False)
    effect: str = RATIO
    timed: bool = False
    primary: bool = False
    origin: str = ""
    version: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not re.fullmatch("[a-z_][a-z0-9_]*", self.name):
            raise InputError(
                f"metric {self.name!r}: its name must be of small letters, digits and _"
            )
        texts = [self.title, self.unit, self.origin, self.version]
        if not self.title or not all(isinstance(t, str) and t.isprintable() for t in texts):
            raise InputError(f"metric {self.name!r}: its title and unit must be printable texts")
        if isinstance(self.digits, bool) or self.digits not in range(_MOST_DIGITS + 1):
            raise InputError(f"metric {self.name!r}: digits must be from 0 to {_MOST_DIGITS}")
        if self.better not in (LOWER, HIGHER):
            raise InputError(f"metric {self.name!r}: better must be {LOWER!r} or {HIGHER!r}")
        if self.effect not in (RATIO, DIFFERENCE):
            raise InputError(f"metric {self.name!r}: effect must be {RATIO!r} or {DIFFERENCE!r}")
        if not callable(self.compute):
            raise InputError(f"metric {self.name!r}: compute must be a function")

    @property
    def higher_is_better(self) -> bool:
        """Else lower is."""
        return self.better == HIGHER

    def heading(self, units: Sequence[Mapping[str, str]] = ()) -> str:
        """Title and unit, where environments have these units ("configuration", "workspace")."""
        names = [self._unit_where({**_UNITS, **each}) for each in units or ({},)]
        return f"{self.title} {' or '.join(dict.fromkeys(names))}".strip()

    def _unit_where(self, units: Mapping[str, str]) -> str:
        named = {CONFIGURATION_UNIT: units["configuration"], WORKSPACE_UNIT: units["workspace"]}
        return named.get(self.unit, self.unit)

    @property
    def definition(self) -> dict[str, Any]:
        """JSON data that `defined` makes it from again, but for how it is computed."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "compute"}


_UNITS = {"configuration": "units", "workspace": "units"}
"""Of environments that do not say theirs, as in older stores."""


def defined(definition: Mapping[str, Any]) -> Metric:
    """A metric that a run has values of, but that is not registered now.

    Raises:
        InputError: the definition is none.
    """
    try:
        return Metric(**definition, compute=_not_known)
    except TypeError as error:
        raise InputError(f"what is said to be a metric is none: {error}") from error


def _not_known(*_: object) -> None:
    """How the metric is computed is not known any more."""


def measure(
    metrics: Iterable[Metric],
    env: Environment,
    problem: Problem,
    path: Array,
    attempt: SolvedAttempt,
) -> dict[str, float | None]:
    """A valid path's value of each metric, by name; None where it has none. A metric that fails is
    named in a warning, once, and left out: no attempt is lost by it, and it can be mended.

    Args:
        path: (k, d).
    """
    values = {}
    for metric in metrics:
        try:
            value = metric.compute(env, problem, path, attempt)
            number = None if value is None else float(value)
        except Exception as error:  # noqa: BLE001  a stranger's may fail in any way
            _warn(metric.name, reason(error), _place(error))
            continue
        values[metric.name] = None if number is None or math.isnan(number) else number
    return values


def _place(error: BaseException) -> str:
    """The file and line where it was raised."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{last.filename}, line {last.lineno}"


@cache
def _warn(name: str, why: str, where: str) -> None:
    logger.warning("metric %r fails, and has no value there: %s (%s)", name, why, where)
