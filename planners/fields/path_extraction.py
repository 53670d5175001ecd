"""Bidirectional execution: both ends follow the time field until they meet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from planners.learning.circles import NO_CIRCLES, Circles

Field = Callable[[Tensor, Tensor], tuple[Tensor, Tensor, Tensor]]
"""Starts and goals (n, d) to stretch (n,) and its gradients (n, d) at both ends."""


@dataclass(frozen=True)
class Descent:
    """How the ends move. Lengths are in the networks' space.

    Attributes:
        step: alpha of equation 5, the length of a step at speed 1.
        moves: whether the start's end moves, and the goal's.
        meeting: the ends are joined by a straight line when they are this close.
        most_steps: after which an attempt is given up.
        true_speed: whether a step at a place is as long as the environment's speed there allows,
            instead of the field's own.
        margin: clearance, by d_max, out to which ends are pushed after a step, and out of which
            they are not joined; 0 for none.
        escapes: how often an attempt goes on that has not met after `most_steps`: from the best
            of some places that can be seen from an end and have a smaller T, best by T and the
            time of going there. As the two before, only for compiled fields of rooms.
    """

    step: float = 0.03
    moves: tuple[bool, bool] = (True, True)
    meeting: float = 0.06
    most_steps: int = 500
    true_speed: bool = False
    margin: float = 0.0
    escapes: int = 0


def descend(
    field: Field,
    starts: Tensor,
    goals: Tensor,
    lower: Tensor,
    upper: Tensor,
    descent: Descent,
    circles: Circles = NO_CIRCLES,
) -> list[Tensor | None]:
    """Paths for many pairs at once  (equation 5).

    Each end steps by alpha S^2 grad T downhill, which with S = 1 / |grad T| has the length
    alpha S: short near obstacles. Ends are kept within the bounds, since obstacles touch them and
    paths would otherwise slide round outside.

    Args:
        starts, goals: (n, d), in the networks' space.
        lower, upper: (d,) bounds there, infinite of coordinates that wrap.
        circles: which these are.

    Returns:
        For each pair a path (k, d) from start to goal, or None if the ends did not meet.
        Coordinates that wrap may be beyond their bounds, and more so on one side of where the ends
        met than on the other.
    """
    from_start, from_goal = [starts], [goals]
    open_pairs = torch.arange(len(starts), device=starts.device)
    met_at = torch.full((len(starts),), -1)
    a, b = starts.clone(), goals.clone()
    for step in range(descent.most_steps + 1):
        apart = circles.shortest(a[open_pairs] - b[open_pairs])
        met = apart.norm(dim=-1) <= descent.meeting
        met_at[open_pairs[met].cpu()] = step
        open_pairs = open_pairs[~met]
        if len(open_pairs) == 0 or step == descent.most_steps:
            break
        a, b = a.clone(), b.clone()
        moved = _step(field, a[open_pairs], b[open_pairs], descent.step, circles)
        for ends, new, moves in zip((a, b), moved, descent.moves, strict=True):
            if moves:
                ends[open_pairs] = new.clamp(lower, upper)
        from_start.append(a)
        from_goal.append(b)
    there, back = torch.stack(from_start, dim=1).cpu(), torch.stack(from_goal, dim=1).cpu()
    return [
        torch.cat([there[i, : m + 1], back[i, : m + 1].flip(0)]) if m >= 0 else None
        for i, m in enumerate(met_at.tolist())
    ]


def gradients(
    field: Field, a: Tensor, b: Tensor, circles: Circles = NO_CIRCLES
) -> tuple[Tensor, Tensor, Tensor]:
    """Travel times (n,) between (n, d) and (n, d), and their gradients (n, d) at both ends."""
    stretch, slope_a, slope_b = field(a, b)
    offset = circles.shortest(a - b)
    distance = offset.norm(dim=-1, keepdim=True)
    ratio = stretch.exp()[:, None]
    return (
        (ratio * distance).squeeze(-1),
        ratio * (offset / distance + distance * slope_a),
        ratio * (-offset / distance + distance * slope_b),
    )


@torch.no_grad()
def _step(
    field: Field, a: Tensor, b: Tensor, alpha: float, circles: Circles
) -> tuple[Tensor, Tensor]:
    """Both ends (n, d) after one step of equation 5."""
    _, *both = gradients(field, a, b, circles)
    squares = [(g**2).sum(-1, keepdim=True).clamp_min(1e-12) for g in both]
    return a - alpha * both[0] / squares[0], b - alpha * both[1] / squares[1]
