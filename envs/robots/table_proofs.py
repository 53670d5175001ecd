"""Proofs that links stay apart, by tables of where they may be near each other, compiled.

Cells are asked when a motion first comes there, or all of them before any does; what is not proved
is parted further, once.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.compiled import njit_cached, njit_hot, njit_inline
from envs.robots.pair_tables import FINER
from envs.robots.swept_pairs import nearing_between, place_of_nearing

_STEPS = 2
"""Levels for each doubling of what is asked of cells."""

_WIDER = 1e-9
"""By how much of a cell what is proved of it goes beyond its sides, for rounding."""

_BEFORE = -(1 << 40)
"""A column before all others."""


@njit_cached
def place_in_tables(arm: Any, tables: Any, a: Any, b: Any, asked: float, kept: float) -> float:
    """A place t of the straight motion from a to b (d,) at which the parts of one of the pairs are
    no more than `asked` apart, or -1 if all are proved to keep more than `kept`, which is less, all
    along: where tables do not prove that, the motion itself is asked."""
    n, column, fine, level = 0, _BEFORE, _BEFORE, _level(kept)
    while True:
        n, column, fine = _next_unproved(arm, tables, a, b, level, n, column, fine)
        if n == len(tables.pairs):
            return -1.0
        _, x, dx, _, _ = _course(tables, n, a, b)
        begin, end = _stretch(x, dx, fine, 1.0 / FINER)
        place = _place_between(arm, tables, n, begin, end, a, b, asked, kept)
        if place >= 0:
            return place


@njit_cached
def fill(arm: Any, tables: Any, kept: float) -> None:
    """Asks all cells, but no parts of them, whether pairs keep more than `kept`; once."""
    level = _level(kept)
    if level <= tables.filled[0]:
        return
    for n in range(len(tables.pairs)):
        for i in range(tables.counts[n, 0]):
            for j in range(tables.counts[n, 1]):
                _is_proved(arm, tables, n, i, j, 1, level)
    tables.filled[0] = level


@njit_cached
def keep_by_cells(arm: Any, tables: Any, a: Any, b: Any, asked: float, kept: float) -> bool:
    """Whether the parts of all pairs are proved to keep more than `kept` on the motion from a to b
    (d,) by whole cells. Only of pairs whose cell at a is not proved the motion itself is asked, for
    no more than `asked`, which is more than `kept`."""
    n, column, level = 0, _BEFORE, _level(kept)
    while True:
        n, column = _next_in_doubt(tables, a, b, level, n, column)
        if n == len(tables.pairs):
            return True
        swaps, x, dx, y, dy = _course(tables, n, a, b)
        begin, end = _stretch(x, dx, column, 1.0)
        rows = (y + begin * dy, y + end * dy)
        if _are_proved(arm, tables, n, swaps, column, 1, rows, level):
            continue
        if _are_proved(arm, tables, n, swaps, math.floor(x), 1, (y, y), level):
            return False
        if _place_between(arm, tables, n, begin, end, a, b, asked, kept) >= 0:
            return False


@njit_cached
def _place_between(
    arm: Any,
    tables: Any,
    n: int,
    begin: float,
    end: float,
    a: Any,
    b: Any,
    asked: float,
    kept: float,
) -> float:
    """Where between two places of a motion from a to b a pair comes too near to each other, or -1;
    see `place_in_tables`."""
    there, beyond = a + begin * (b - a), a + end * (b - a)
    place = place_of_nearing(arm, tables.pairs[n : n + 1], there, beyond, asked, kept)
    return begin + place * (end - begin) if place >= 0 else -1.0


@njit_hot
def are_known_by_tables(tables: Any, a: Any, b: Any, kept: float) -> bool:
    """Whether that is known from what cells, and their parts, have been asked already."""
    return bool(_next_in_doubt(tables, a, b, _level(kept), 0, _BEFORE)[0] == len(tables.pairs))


@njit_hot
def _level(kept: float) -> float:
    """What cells are asked for where so much is to be kept: in steps, so that they are not asked
    again for each a little more."""
    return float(2.0 ** (math.ceil(_STEPS * math.log2(kept)) / _STEPS))


@njit_cached
def _next_unproved(
    arm: Any, tables: Any, a: Any, b: Any, level: float, n: int, column: int, fine: int
) -> tuple[int, int, int]:
    """The first pair from n on, the column of its cells, and the column of their parts, in which a
    motion comes through cells that are not proved to keep more than a level; of pair n only what
    comes after a column and the parts of it that are named counts. Cells are asked for that, which
    were not yet.
    """
    while True:
        if fine == _BEFORE:
            n, column = _next_in_doubt(tables, a, b, level, n, column)
            if n == len(tables.pairs):
                return n, column, fine
            fine = FINER * column - 1
        swaps, x, dx, y, dy = _course(tables, n, a, b)
        begin, end = _stretch(x, dx, column, 1.0)
        rows = (y + begin * dy, y + end * dy)
        first = fine + 1
        if first > FINER * column or not _are_proved(arm, tables, n, swaps, column, 1, rows, level):
            for fine in range(first, FINER * (column + 1)):
                begin, end = _stretch(x, dx, fine, 1.0 / FINER)
                rows = (y + begin * dy, y + end * dy)
                if begin > end:
                    continue
                if not _are_proved(arm, tables, n, swaps, fine, FINER, rows, level):
                    return n, column, fine
        fine = _BEFORE


@njit_hot
def _next_in_doubt(
    tables: Any, a: Any, b: Any, kept: float, n: int, column: int
) -> tuple[int, int]:
    """The first pair from n on, and column of its cells, on a motion from a to b (d,) where it is
    not yet known to keep more than `kept`; of pair n only columns after one count.

    One call walks through the tables of all pairs: to pass an arm on for each column takes longer
    than to look.
    """
    while n < len(tables.pairs):
        swaps, x, dx, y, dy = _course(tables, n, a, b)
        column, last = max(column + 1, math.floor(min(x, x + dx))), math.floor(max(x, x + dx))
        while column <= last:
            begin, end = _stretch(x, dx, column, 1.0)
            rows = (y + begin * dy, y + end * dy)
            if not _are_known(tables, n, swaps, column, 1, rows, kept):
                for fine in range(FINER * column, FINER * (column + 1)):
                    begin, end = _stretch(x, dx, fine, 1.0 / FINER)
                    rows = (y + begin * dy, y + end * dy)
                    if begin > end or _are_known(tables, n, swaps, fine, FINER, rows, kept):
                        continue
                    return n, column
            column += 1
        n, column = n + 1, _BEFORE
    return n, column


@njit_inline
def _course(tables: Any, n: int, a: Any, b: Any) -> tuple[bool, float, float, float, float]:
    """How a motion goes through the cells of a pair: whether columns are those of the second axis,
    where it begins among them and how far it goes, and so of rows. It is columns that it goes
    through more of."""
    x, dx = _along(tables, n, 0, a, b)
    y, dy = _along(tables, n, 1, a, b)
    if abs(dy) > abs(dx):
        return True, y, dy, x, dx
    return False, x, dx, y, dy


@njit_hot
def _stretch(x: float, dx: float, column: int, width: float) -> tuple[float, float]:
    """From where to where on a motion from x to x + dx it is in a column of cells; the first is
    more than the second if nowhere."""
    low, high = column * width, (column + 1) * width
    if dx == 0.0:
        return (0.0, 1.0) if low <= x <= high else (1.0, 0.0)
    t, s = (low - x) / dx, (high - x) / dx
    return max(min(t, s), 0.0), min(max(t, s), 1.0)


@njit_cached
def _are_proved(
    arm: Any, tables: Any, n: int, swaps: bool, column: int, finer: int, rows: Any, kept: float
) -> bool:
    """Whether the cells in a column between two rows, in cells, are proved to keep more than
    `kept`: those of cells that are parted into `finer` along each axis, or 1."""
    row, last = _between_rows(rows, finer)
    while row <= last:
        i, j = (row, column) if swaps else (column, row)
        if not _is_proved(arm, tables, n, i, j, finer, kept):
            return False
        row += 1
    return True


@njit_inline
def _are_known(
    tables: Any, n: int, swaps: bool, column: int, finer: int, rows: Any, kept: float
) -> bool:
    """Whether that is known already, see `_are_proved`, which does not ask for it then."""
    row, last = _between_rows(rows, finer)
    while row <= last:
        i, j = (row, column) if swaps else (column, row)
        cell = _number(tables, n, i // finer, j // finer)
        if cell < 0:
            return False
        if kept > tables.proved[cell]:
            part = tables.parts[cell]
            if finer == 1 or part < 0:
                return False
            if kept > tables.proved[part + (i % finer) * finer + j % finer]:
                return False
        row += 1
    return True


@njit_inline
def _between_rows(rows: Any, finer: int) -> tuple[int, int]:
    """The first and last row of cells between two places, in cells."""
    low, high = min(rows[0], rows[1]) * finer, max(rows[0], rows[1]) * finer
    return math.floor(low - _WIDER), math.floor(high + _WIDER)


@njit_hot
def _along(tables: Any, n: int, axis: int, a: Any, b: Any) -> tuple[float, float]:
    """Where a motion begins on an axis, and how far it goes, in cells."""
    k = tables.coordinates[n, axis]
    if k < 0:
        return 0.5, 0.0
    width = tables.width[n, axis]
    return (a[k] - tables.lower[n, axis]) / width, (b[k] - a[k]) / width


@njit_hot
def _cell(tables: Any, n: int, axis: int, number: int) -> int:
    """The number of a cell on an axis, where it wraps; -1 where there is none: at an end the last
    one is meant."""
    count = tables.counts[n, axis]
    if tables.wraps[n, axis]:
        return int(number % count)
    if number == count or number == -1:
        return int(min(max(number, 0), count - 1))
    return number if 0 <= number < count else -1


@njit_hot
def _number(tables: Any, n: int, i: int, j: int) -> int:
    """That of a cell of a pair; -1 where there is none."""
    i, j = _cell(tables, n, 0, i), _cell(tables, n, 1, j)
    return int(tables.firsts[n] + i * tables.counts[n, 1] + j) if i >= 0 and j >= 0 else -1


@njit_cached
def _is_proved(arm: Any, tables: Any, n: int, i: int, j: int, finer: int, kept: float) -> bool:
    """Whether a cell is proved to keep more than `kept`; see `_are_proved`."""
    cell = _number(tables, n, i // finer, j // finer)
    if cell < 0:
        return False
    if kept <= tables.proved[cell]:
        return True
    if finer > 1:
        if tables.parts[cell] < 0:
            if tables.used[0] + finer**2 > len(tables.proved):
                return False
            tables.parts[cell] = tables.used[0]
            tables.used[0] += finer**2
        cell = tables.parts[cell] + (i % finer) * finer + j % finer
        if kept <= tables.proved[cell]:
            return True
    if kept >= tables.open[cell]:
        return False
    if finer == 1 and _are_proved_together(arm, tables, n, i, j, kept):
        return True
    if _keeps(arm, tables, n, i, j, 1, 1, finer, kept):
        tables.proved[cell] = kept
        return True
    tables.open[cell] = kept
    return False


@njit_cached
def _are_proved_together(arm: Any, tables: Any, n: int, i: int, j: int, kept: float) -> bool:
    """Whether a cell and those about it are proved to keep more than `kept`."""
    first_i = _cell(tables, n, 0, i) // FINER * FINER
    first_j = _cell(tables, n, 1, j) // FINER * FINER
    first = _number(tables, n, first_i, first_j)
    if kept >= tables.together[first]:
        return False
    size = min(FINER, tables.counts[n, 0] - first_i), min(FINER, tables.counts[n, 1] - first_j)
    if not _keeps(arm, tables, n, first_i, first_j, size[0], size[1], 1, kept):
        tables.together[first] = kept
        return False
    for row in range(size[0]):
        begin = first + row * tables.counts[n, 1]
        for cell in range(begin, begin + size[1]):
            tables.proved[cell] = max(tables.proved[cell], kept)
    return True


@njit_cached
def _keeps(
    arm: Any, tables: Any, n: int, i: int, j: int, rows: int, columns: int, finer: int, kept: float
) -> bool:
    """Whether the parts are proved to keep more than `kept` all over some cells from one on."""
    low = np.zeros(len(arm.tree.wraps))
    high = low.copy()
    for axis in range(2):
        k, width = tables.coordinates[n, axis], tables.width[n, axis] / finer
        if k >= 0:
            begin = tables.lower[n, axis] + (i if axis == 0 else j) * width
            size = (rows if axis == 0 else columns) * width
            low[k], high[k] = begin - _WIDER * width, begin + size + _WIDER * width
    part, other, branch = tables.pairs[n, 0], tables.pairs[n, 1], tables.pairs[n, 2]
    return bool(nearing_between(arm, part, other, branch, low, high, kept)[0] == math.inf)
