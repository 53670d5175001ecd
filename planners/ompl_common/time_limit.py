"""How much of a budget OMPL is given."""

from __future__ import annotations

from planners.base import Budget

_LEAD_S = 0.01
_LEAD_SHARE = {"LazyPRMstar": 0.05, "AITstar": 0.1, "BITstar": 0.05}
_LEAD_SHARE_OTHERS = 0.02
"""How long before the deadline OMPL is told to stop, in seconds and as a share of the time given.
It ends its current iteration after that, and these planners' iterations grow long: with 5 s, 0.1 s
were seen in LazyPRM* and 0.3 s in AIT*."""

_UNPRUNED_S = 1.0
_UNPRUNED_SHARE = 0.2
"""For how long before it stops BIT* no longer prunes its graph, in seconds or as a share of its
time, whichever is more. It prunes in one iteration, and 0.5 s of it were seen after 1.1 s, 1 s
after 4 s; without, iterations take 0.01 s. A graph with more samples than needed is no worse."""


def usable(budget: Budget, algorithm: str) -> float:
    """Seconds to give OMPL, so that it has ended when the budget does."""
    lead = _LEAD_SHARE.get(algorithm, _LEAD_SHARE_OTHERS)
    return max(0.0, budget.remaining() * (1 - lead) - _LEAD_S)


def unpruned(seconds: float) -> float:
    """Of so many seconds of BIT*, how many at the end are without pruning."""
    return max(_UNPRUNED_S, _UNPRUNED_SHARE * seconds)
