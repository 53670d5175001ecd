"""How a run came about, as titled lists of names and texts."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from bench.report.recorded import RecordedRun

_OF_PLACES = (
    "machine",
    "python",
    "versions",
    "git",
    "threads_per_worker",
    "thread_variables",
)
"""What a session says of where it was measured; the rest is when, and at what cost."""

_TOLD_ELSEWHERE = ("settings", "order")


@dataclass(frozen=True)
class Facts:
    """Names and texts under a title."""

    title: str
    lines: list[tuple[str, str]]


def facts_of(run: RecordedRun) -> list[Facts]:
    """What was asked for in each folder; the machines and versions, each once; the sessions."""
    asked = [
        Facts(f"Asked for: {folder.name}", list(_lines(selection)))
        for folder, selection in zip(run.folders, run.selections, strict=True)
    ]
    places: dict[str, Facts] = {}
    sessions = []
    for session in run.sessions:
        place = {name: session[name] for name in _OF_PLACES if name in session}
        if place:
            places.setdefault(json.dumps(place), Facts("Machine", list(_lines(place))))
        rest = {n: v for n, v in session.items() if n not in (*_OF_PLACES, *_TOLD_ELSEWHERE)}
        sessions.append(Facts("Session", list(_lines(rest))))
    return [*asked, *places.values(), *sessions]


def _lines(data: dict[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    """JSON data line by line, names of what is within others after theirs."""
    for name, value in data.items():
        words = f"{above} {name.replace('_', ' ')}".strip()
        if isinstance(value, dict):
            yield from _lines(value, words)
        elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
            for number, item in enumerate(value, 1):
                yield from _lines(item, f"{words} {number}")
        elif isinstance(value, list):
            yield words, ", ".join(str(item) for item in value)
        else:
            yield words, "unknown" if value is None else str(value)
