"""What an arm is too near to, in words: why a world has too few problems."""

from __future__ import annotations

from collections.abc import Sequence

from envs.collision.checked_pairs import CheckedPairs
from envs.problem import Array
from envs.robots.arm import Arm

_NAMED = 3
"""Causes that are named, the most frequent ones."""


def causes(
    arm: Arm,
    pairs: CheckedPairs,
    names: Sequence[str],
    q: Array,
    clear: float,
    kept: Array,
) -> list[str]:
    """What is too near at some of the configurations (n, d), the most frequent first.

    Args:
        arm: the robot.
        pairs: of its parts, and of these and obstacles, that must not touch.
        names: of the obstacles.
        q: where to look.
        clear: what links keep from obstacles, in metres.
        kept: (p, p) what parts keep from each other, in metres.
    """
    parts = len(arm.parts)
    most = [float(kept[i, j]) if j < parts else clear for i, j in pairs.numbers]
    called = [
        _of_links(arm, i, j) if j < parts else f"link {arm.links[i]!r} to {names[j - parts]}"
        for i, j in pairs.numbers
    ]
    too_near: dict[str, set[int]] = {}
    for n, one in enumerate(q):
        for name, apart, least in zip(called, pairs.distances(one, most), most, strict=True):
            if apart < least:
                too_near.setdefault(name, set()).add(n)
    often = sorted(too_near.items(), key=lambda item: -len(item[1]))
    return [f"{name} in {len(which) / len(q):.0%}" for name, which in often[:_NAMED]]


def _of_links(arm: Arm, i: int, j: int) -> str:
    first, second = sorted((arm.links[i], arm.links[j]))
    return f"links {first!r} and {second!r} to each other"
