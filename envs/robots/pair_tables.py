"""Tables of where links may be near each other, of pairs that one or two joints part, compiled.

How such links lie to each other depends on these joints alone. So what they can be is parted into
cells, and what is proved of a cell once, by `swept_pairs`, is known for every motion that comes
through it; see `table_proofs`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array
from envs.robots.arm import Arm

_CELL = math.pi / 64
"""The longest side of a cell, in radians, or in metres where a joint slides."""

_MOST_CELLS = 1 << 18
"""Of a pair; with more, cells are larger."""

FINER = 8
"""Into how many along each axis a cell without a proof is parted; and so many of whole cells are
asked together, before any is alone."""

_MOST_PARTED = 4096
"""Cells of all pairs that are parted; motions through others are asked for themselves."""


class PairTables(NamedTuple):
    """Of k pairs of parts, each with two axes of cells; of one joint alone the second has one cell.

    Attributes:
        pairs: (k, 3) rows of `RobotArrays.branches`.
        coordinates: (k, 2) which numbers of a configuration the axes are; -1 for none.
        lower, width: (k, 2) where an axis begins, and the side of its cells.
        counts: (k, 2) of cells along each.
        wraps: (k, 2) whether an axis has no ends.
        firsts: (k + 1,) where each pair's cells begin.
        together: (n,) the least that was asked of cells together, at the first of them, without a
            proof; infinite if none was.
        parts: (n,) where the cells begin that a cell is parted into, -1 of those that are not.
        used: (1,) where the next ones begin.
        proved: (n + m,) what the two keep more than all over a cell, in metres, as far as it was
            asked; negative where it was not. Those of parts come last.
        open: (n + m,) the least that was asked of a cell without a proof; infinite if none was.
        filled: (1,) what all cells have been asked for, see `table_proofs.fill`.
    """

    pairs: NDArray[np.int64]
    coordinates: NDArray[np.int64]
    lower: Array
    width: Array
    counts: NDArray[np.int64]
    wraps: NDArray[np.bool_]
    firsts: NDArray[np.int64]
    together: Array
    parts: NDArray[np.int64]
    used: NDArray[np.int64]
    proved: Array
    open: Array
    filled: Array


def split(arm: Arm) -> tuple[NDArray[np.int64], PairTables]:
    """The pairs of an arm, rows (k, 3) of `RobotArrays.branches`: those that have no tables, and
    the tables of the others, which are meshes that one or two joints part."""
    arrays = arm.arrays
    roots, found, rest = arrays.shapes.roots, [], []
    for pair in arrays.branches:
        between = _between(arm, pair)
        are_meshes = roots[pair[0]] >= 0 and roots[pair[1]] >= 0
        if are_meshes and 1 <= len(between) <= 2:
            found.append((pair, [*between, -1][:2]))
        else:
            rest.append(pair)
    return np.array(rest, dtype=np.int64).reshape(-1, 3), tables_of(arm, found)


def _between(arm: Arm, pair: NDArray[np.int64]) -> list[int]:
    """The numbers of a configuration that part two parts; none where a spherical joint does."""
    tree, found = arm.arrays.tree, set()
    for body in arm.arrays.bodies[pair[:2]].tolist():
        while body != pair[2]:
            joint = body - 1
            if tree.spherical[joint]:
                return []
            found.add(int(tree.coordinates[joint]))
            body = int(tree.parents[joint])
    return sorted(found)


def tables_of(arm: Arm, pairs: list[tuple[NDArray[np.int64], list[int]]]) -> PairTables:
    """Tables of some of its pairs, rows of `RobotArrays.branches`, each with the one or two numbers
    of a configuration that part them, and -1 for none."""
    k = len(pairs)
    coordinates = np.array([of for _, of in pairs], dtype=np.int64).reshape(k, 2)
    lower, width = np.zeros((k, 2)), np.ones((k, 2))
    counts, wraps = np.ones((k, 2), dtype=np.int64), np.zeros((k, 2), dtype=np.bool_)
    for n in range(k):
        axes = np.flatnonzero(coordinates[n] >= 0)
        of = coordinates[n, axes]
        low, high = arm.tree.lower[of], arm.tree.upper[of]
        most = int(_MOST_CELLS ** (1 / len(axes)))
        cells = np.clip(np.ceil((high - low) / _CELL), 1, most).astype(np.int64)
        lower[n, axes], counts[n, axes] = low, cells
        width[n, axes] = np.where(high > low, (high - low) / cells, 1.0)
        wraps[n, axes] = arm.arrays.tree.wraps[of]
    firsts = np.cumsum([0, *counts.prod(axis=1)])
    rows = np.array([pair for pair, _ in pairs], dtype=np.int64).reshape(k, 3)
    cells = int(firsts[-1])
    many = cells + (_MOST_PARTED * FINER**2 if k else 0)
    none, used = np.full(cells, -1), np.array([cells])
    proved, unproved = np.full(many, -1.0), np.full(many, np.inf)
    together = np.full(cells, np.inf)
    return PairTables(
        rows,
        coordinates,
        lower,
        width,
        counts,
        wraps,
        firsts,
        together,
        none,
        used,
        proved,
        unproved,
        np.zeros(1),
    )
