"""Fuzzing of parsers: whatever they are given they accept, or refuse in one clear line."""

from __future__ import annotations

import random
import signal
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from envs import InputError

CASES = {
    "environments": 2600,
    "planners": 2600,
    "stop rules": 1000,
    "suites": 150,
    "command lines": 500,
    "checks": 500,
    "baselines": 1800,
    "manifests": 1800,
    "experiments": 1200,
    "URDFs": 1200,
    "SRDFs": 1200,
    "scenes": 1200,
    "Collada meshes": 1200,
    "problems of OMPL.app": 1200,
    "paths as JSON": 1200,
    "paths as CSV": 1200,
    "paths as matrices": 1200,
    "paths as arrays": 600,
    "maps of ROS": 1200,
    "maps of Moving AI": 1200,
    "voxels of Moving AI": 1200,
    "images and arrays of maps": 1200,
    "problems of Moving AI": 1200,
    "planning scenes": 1200,
    "scenes in text": 1200,
    "motion requests": 1200,
    "archives of problems": 300,
    "problems of robometrics": 1200,
    "problems as JSON": 1200,
    "problems as YAML": 1200,
    "problems as CSV": 1200,
    "meshes of text": 1200,
    "meshes of bytes": 600,
}
"""How many inputs each parser is given."""

SHARE = 1.0
"""Of these, what is tried, but never fewer than `FEWEST`; a fixture of tests/fuzz sets it."""

FEWEST = 60

UNLIKELY = 0.1
"""The share of them that are any text or bytes at all."""

DISTINCT = 0.7
"""The share of them, at least, that are not the same as another."""

_BOTH = 0.05
"""The share of them, at least, that are accepted, and that are refused."""

_MOST_S = 5.0
"""Seconds of this process for one input, with whatever is imported for the first."""

_MOST_CHARACTERS = 1100

T = TypeVar("T")
Input = TypeVar("Input", bound=Hashable)


def fuzzed(
    name: str,
    inputs: Sequence[st.SearchStrategy[Input]],
    parse: Callable[[Input], T],
    check: Callable[[T], None],
) -> None:
    """Gives a parser as many inputs as `CASES` and `SHARE` say; `check` looks at what it accepts.

    Args:
        inputs: likely ones, and unlikely ones, if any, which are `UNLIKELY` of all.
    """
    tried: set[Input] = set()
    ran, accepted = 0, 0

    def one(given_input: Input) -> None:
        nonlocal ran, accepted
        ran += 1
        tried.add(given_input)
        with in_time(_MOST_S):
            made = accepted_or_refused(lambda: parse(given_input))
            if made:
                check(made[0])
                accepted += 1

    cases = max(FEWEST, int(SHARE * CASES[name]))
    unlikely = int(UNLIKELY * cases) if len(inputs) > 1 else 0
    for count, source in zip((cases - unlikely, unlikely), inputs, strict=False):
        settings(
            max_examples=count,
            derandomize=True,
            deadline=None,
            phases=(Phase.generate,),
            suppress_health_check=list(HealthCheck),
        )(given(source)(one))()
    assert ran >= cases
    assert len(tried) >= DISTINCT * ran, f"only {len(tried)} of {ran} were distinct"
    assert _BOTH * ran <= accepted <= (1 - _BOTH) * ran, f"{accepted} of {ran} were accepted"


def flipped(seed: bytes, content: bytes) -> bytes:
    """Some content of a file with a few of its bytes changed, those at the beginning oftenest, or
    cut off."""
    rng = random.Random(seed)
    changed = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = int(len(changed) * rng.random() ** rng.choice((1, 3)))
        changed[at] = rng.choice((0, 255, 10, 32, 57, rng.randrange(256)))
    kept = len(changed) if rng.random() < 0.9 else rng.randrange(len(changed))
    return bytes(changed[:kept])


def accepted_or_refused(parse: Callable[[], T]) -> tuple[T] | None:
    """What was made of an input, or None if it was refused in one line that says something."""
    try:
        return (parse(),)
    except InputError as error:
        said = str(error)
        assert said.strip(), "it says nothing"
        assert said.isprintable(), said
        assert len(said) <= _MOST_CHARACTERS, said
        assert "Traceback" not in said, said
        return None


class _Late(BaseException):
    """No `Exception`, which a parser might take for one of its own."""


@contextmanager
def in_time(seconds: float) -> Iterator[None]:
    """Fails if what is done takes this process more than so many seconds of its own."""

    def late(_signal: int, _frame: FrameType | None) -> None:
        raise _Late

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    except _Late:
        raise AssertionError(f"took more than {seconds} s") from None
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
