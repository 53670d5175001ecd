"""Named random streams, so that data made for different purposes never overlap.

Test problems, warm-up problems and training draw from streams of different purposes: with equal
integer seeds they still share no random numbers.
"""

from __future__ import annotations

import hashlib

import numpy as np

TEST_SEEDS = 2**32
"""Seeds of test problems are below this, seeds of problems for training at or above it."""


def stream(purpose: str, *seeds: int) -> np.random.Generator:
    """A generator (PCG64) for `purpose` ("scene", "problems", ...) and non-negative `seeds`.

    The same arguments give the same numbers on every machine.
    """
    return np.random.default_rng([*_words(purpose), *seeds])


def derived_seed(purpose: str, *seeds: int) -> int:
    """A 31-bit positive seed for libraries that take one integer."""
    return int(stream(purpose, *seeds).integers(1, 2**31 - 1))


def training_seed(purpose: str, *seeds: int) -> int:
    """A seed of problems for training and warming up: at least 2^32, which no test seed is."""
    return TEST_SEEDS + derived_seed(purpose, *seeds)


def _words(purpose: str) -> list[int]:
    digest = hashlib.sha256(purpose.encode()).digest()
    return [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
