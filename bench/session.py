"""What one call of `runner.run` cost."""

from __future__ import annotations

import threading
import uuid
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from typing import Any

from bench import machine
from bench.suite import Suite

BLOCK = 10
"""Problems after which the order of the planners is drawn anew."""


@dataclass(frozen=True)
class Costs:
    """Sums over what was measured: attempts, and seconds of setting up, solving and judging."""

    attempts: int = 0
    setup_s: float = 0.0
    solve_s: float = 0.0
    judge_s: float = 0.0


class Session:
    """The costs of measuring; several threads may add to them at once.

    Attributes:
        run_id: of the records that were made.
        wall_s: seconds that it all took.
    """

    def __init__(self) -> None:
        self.run_id = uuid.uuid4().hex[:12]
        self.wall_s = 0.0
        self._started = now()
        self._costs = Costs()
        self._lock = threading.Lock()

    @property
    def costs(self) -> Costs:
        """So far."""
        return self._costs

    def add(self, more: Costs) -> None:
        """Adds what something cost."""
        with self._lock:
            sums = {
                name: value + getattr(more, name) for name, value in asdict(self._costs).items()
            }
            self._costs = Costs(**sums)

    def described(self, suite: Suite) -> dict[str, Any]:
        """JSON data for store and manifest, the share of overhead included."""
        costs = {"run_id": self.run_id, "started": self._started, **asdict(self.costs)}
        costs["wall_s"] = self.wall_s
        rounded = {k: round(v, 3) if isinstance(v, float) else v for k, v in costs.items()}
        planning = self.costs.setup_s + self.costs.solve_s
        overhead = 1 - planning / (self.wall_s * suite.jobs)
        return {
            **rounded,
            "overhead_share": round(overhead, 4),
            "jobs": suite.jobs,
            "order": {"seed": suite.seed, "shuffled_every": BLOCK},
            "settings": suite.settings,
            **machine.describe(),
        }


def now() -> str:
    """The time in UTC, to the second, as records and sessions have it."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
