"""Compiled loops over many items, on several threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numba

from envs import processors


def in_blocks(work: Callable[[slice], None], items: int, block: int) -> None:
    """Calls `work` for slices of at most `block` of the items, on as many threads as Numba may
    use, but no more than there are cores; it must let go of the interpreter's lock (`nogil`) for
    that to help."""
    slices = [slice(begin, begin + block) for begin in range(0, items, block)]
    # Not numba.get_num_threads(): that starts Numba's own threads, and OpenMP's with them, which
    # then spin against PyTorch's.
    most: int = min(numba.config.NUMBA_NUM_THREADS, processors.physical_cores())  # type: ignore[attr-defined]
    if min(len(slices), most) <= 1:
        for part in slices:
            work(part)
        return
    with ThreadPoolExecutor(min(len(slices), most)) as pool:
        list(pool.map(work, slices))
