"""Work spread over processes, for making data."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from multiprocessing import get_context
from typing import Any, TypeVar

import psutil

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_parallel(
    make: Callable[..., Callable[[Item], Result]],
    arguments: tuple[Any, ...],
    items: Iterable[Item],
    block: int,
) -> Iterator[list[Result]]:
    """The results of `make(*arguments)(item)` in the order of the items, in lists of `block` for
    each process, of which there are as many as physical cores.

    `make` is called once in each process. Everything that passes between has to be picklable.
    """
    processes = psutil.cpu_count(logical=False) or 1
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
