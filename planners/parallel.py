"""Data made in several processes, and kept on the way."""

from __future__ import annotations

import math
import signal
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar
from zipfile import BadZipFile

import numpy as np

from envs import InputError
from envs.cores import usable_cores
from envs.errors import reason
from envs.whole_file import whole_file

_NOT_OURS = (
    *(OSError, EOFError, BadZipFile, zlib.error, RuntimeError, MemoryError),
    *(LookupError, ValueError, TypeError, AttributeError),
)
"""What is raised of files that are no results, or not of this kind."""

Item = TypeVar("Item")
Result = TypeVar("Result")
D = TypeVar("D", bound="Pieces")


class Pieces(ABC):
    """A frozen dataclass of arrays, each of which grows along its first axis."""

    @property
    @abstractmethod
    def finished(self) -> int:
        """How many items of work it holds the results of."""

    @abstractmethod
    def is_consistent(self) -> bool:
        """Whether the arrays' lengths belong together."""

    def joined(self: D, others: Sequence[D]) -> D:
        """These and others."""
        parts = zip(*(vars(one).values() for one in (self, *others)), strict=True)
        return type(self)(*(np.concatenate(part) for part in parts))


def made_in_parallel(
    make: Callable[..., Callable[[int], D]],
    arguments: tuple[Any, ...],
    items: int,
    *,
    none: D,
    block: int,
    kept: Path,
    report: Callable[[float], None],
) -> tuple[D, float]:
    """The joined results of `make(*arguments)(item)` for all items from 0, see `in_parallel`.

    Args:
        none: the result of no items.
        kept: a file in which results are kept, to go on from.
        report: is told the share that is done.

    Returns:
        The results, and the seconds that they took, those in earlier calls included.

    Raises:
        InputError: the file is damaged, holds something else, or cannot be written.
    """
    made, spent = _read(kept, none, items)
    begin = monotonic()
    for finished in in_parallel(make, arguments, range(made.finished, items), block):
        made = made.joined(finished)
        _write(kept, made, spent + monotonic() - begin)
        report(made.finished / items)
    return made, spent + monotonic() - begin


def _read(kept: Path, none: D, items: int) -> tuple[D, float]:
    if not kept.is_file():
        return none, 0.0
    try:
        with kept.open("rb") as file, np.load(file) as held:
            made = type(none)(*(held[name] for name in vars(none)))
            seconds = float(held["seconds"])
        _check(made, none)
        if not (made.finished <= items and made.is_consistent() and 0 <= seconds < math.inf):
            raise ValueError("its parts do not belong together")
    except _NOT_OURS as error:
        raise InputError(f"cannot go on from {kept}, delete it: {reason(error)}") from error
    return made, seconds


def _check(made: D, none: D) -> None:
    """Raises ValueError if arrays are not of the kinds that results are of."""
    for name, empty in vars(none).items():
        found = vars(made)[name]
        if found.dtype != empty.dtype or found.shape[1:] != empty.shape[1:] or not found.ndim:
            raise ValueError(f"{name} is {found.dtype} {found.shape}")
        if not np.isfinite(found).all():
            raise ValueError(f"{name} holds NaN or infinite numbers")


def _write(kept: Path, made: Pieces, seconds: float) -> None:
    try:
        with whole_file(kept) as part:
            np.savez(part, seconds=seconds, **vars(made))
    except OSError as error:
        raise InputError(f"cannot write {kept}: {reason(error)}") from error


def in_parallel(
    make: Callable[..., Callable[[Item], Result]],
    arguments: tuple[Any, ...],
    items: Iterable[Item],
    block: int,
) -> Iterator[list[Result]]:
    """The results of `make(*arguments)(item)` in the order of the items, in lists of `block` for
    each process, of which there are as many as physical cores that this one may use.

    `make` is called once in each process. Everything that passes between has to be picklable.
    """
    processes = usable_cores()
    left = iter(items)
    with ProcessPoolExecutor(
        processes, mp_context=get_context("spawn"), initializer=_start, initargs=(make, arguments)
    ) as pool:
        while chunk := list(islice(left, block * processes)):
            yield list(pool.map(_call, chunk))


_work: Callable[[Any], Any] | None = None  # of a process of the pool


def _start(make: Callable[..., Callable[[Any], Any]], arguments: tuple[Any, ...]) -> None:
    global _work
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is the parent's to handle
    _work = make(*arguments)


def _call(item: Any) -> Any:
    assert _work is not None
    return _work(item)
