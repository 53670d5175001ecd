"""Planners as `bench test-planner` takes them: by name, or in a file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import planners
from envs import loading
from envs.registry import Entry
from planners import Planner, files


@contextmanager
def named(text: str) -> Iterator[Entry[Planner]]:
    """What "NAME", "NAME:key=value,...", "FILE.py:CLASS" or "FILE.py" names; a file's planners are
    registered as long as the context lasts.

    Raises:
        InputError: there is no such planner, or its file is not in order.
    """
    source, _, cls = (text, "", "") if loading.is_file(text) else text.rpartition(":")
    if not loading.is_file(source):
        yield planners.REGISTRY.entry(text)
        return
    with files.registered([Path(source)]):
        yield planners.REGISTRY.entry(files.spec_of_class(Path(source), cls).id)
