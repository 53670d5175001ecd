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
from envs.errors import input_error_of, reason
from envs.files.paths import atomic_write
from envs.processors import physical_cores

Item = TypeVar("Item")
Result = TypeVar("Result")
D = TypeVar("D", bound="Pieces")

_NOT_OURS = (
    *(OSError, EOFError, BadZipFile, zlib.error),
    *(LookupError, ValueError, TypeError, AttributeError, NotImplementedError, RuntimeError),
)
"""What NumPy raises of files that hold no pieces, or are damaged."""


class Pieces(ABC):
    """A frozen dataclass of arrays, each of which grows along its first axis."""

    @property
    @abstractmethod
    def consistent(self) -> bool:
        """Whether the lengths of its arrays, and the numbers in them, go together."""

    @property
    @abstractmethod
    def finished(self) -> int:
        """How many items of work it holds the results of."""

    def continues(self: D, none: D) -> bool:
        """Whether it may have been begun as `none`: arrays of the same type and shape but for how
        many there are, which go together."""
        alike = all(
            own.dtype == other.dtype and own.ndim == other.ndim and own.shape[1:] == other.shape[1:]
            for own, other in zip(vars(self).values(), vars(none).values(), strict=True)
        )
        return alike and self.consistent

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
        InputError: what is kept is damaged, or of something else, or cannot be written.
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
        # Not by its name: NumPy would leave the file open where it is damaged.
        with kept.open("rb") as opened, np.load(opened) as stored:
            made = type(none)(*(stored[name] for name in vars(none)))
            seconds = float(stored["seconds"])
    except _NOT_OURS as error:
        raise InputError(f"cannot go on from {kept}, delete it: {reason(error)}") from error
    if not (made.continues(none) and made.finished <= items and 0 <= seconds < math.inf):
        raise InputError(f"cannot go on from {kept}, delete it: it holds something else")
    return made, seconds


def _write(kept: Path, made: Pieces, seconds: float) -> None:
    with input_error_of(f"cannot write {kept}"), atomic_write(kept) as part:
        np.savez(part, seconds=seconds, **vars(made))


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
    processes = physical_cores()
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
