"""Counts what collision models are asked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from envs.collision.fcl_model import CollisionModel

_QUESTIONS = ("is_valid", "clearance", "segment_is_free", "stays_free", "may_plan_at", "keeps")


def counted_checks(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the questions that models are asked from now on, in their order. What a model
    asks itself to answer one is not counted."""
    asked: list[str] = []
    answering = [False]

    def counted(name: str) -> Callable[..., Any]:
        real = getattr(CollisionModel, name)

        def ask(model: CollisionModel, *arguments: Any) -> Any:
            if answering[0]:
                return real(model, *arguments)
            asked.append(name)
            answering[0] = True
            try:
                return real(model, *arguments)
            finally:
                answering[0] = False

        return ask

    for name in _QUESTIONS:
        monkeypatch.setattr(CollisionModel, name, counted(name))
    return asked
