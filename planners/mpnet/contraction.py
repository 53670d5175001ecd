"""Lazy vertex contraction."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from envs.problem import Array

IsFree = Callable[[Array, Array], bool]
"""Whether the straight motion between two configurations (d,) is free."""


def contracted(path: Sequence[Array], is_free: IsFree) -> list[Array]:
    """A path without the waypoints that a free straight motion can skip.

    Goes from each waypoint to the last one that it sees. Neighbours are kept as they are, whether
    or not the motion between them is free.

    Args:
        path: waypoints (d,).
    """
    kept = [path[0]]
    here = 0
    while here < len(path) - 1:
        ahead = range(len(path) - 1, here + 1, -1)
        here = next((there for there in ahead if is_free(path[here], path[there])), here + 1)
        kept.append(path[here])
    return kept
