"""`bench list`: what is registered. Nothing numerical is imported for planners and environments."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import envs
import planners
from bench.cli.terminal import tell
from envs.errors import printable
from envs.registry import Registry


def list_(chosen: SimpleNamespace) -> int:
    """`bench list`."""
    listed = _metrics() if chosen.what == "metrics" else _registered(chosen.what)
    if chosen.json:
        tell(json.dumps(listed, indent=2))
        return 0
    for what, entries in listed.items():
        tell(f"{what}:")
        for entry in entries:
            tell(f"  {entry['id']:<20} {printable(str(entry['description']))}")
    return 0


def _metrics() -> dict[str, list[dict[str, Any]]]:
    from bench.judging import metrics, user_metrics

    with user_metrics.registered(()):
        known = metrics.known_metrics()
    return {
        "metrics": [
            {
                "id": metric.name,
                "description": f"{metric.heading()}, better {metric.better}",
                **{key: getattr(metric, key) for key in ("title", "unit", "better", "effect")},
                **{key: getattr(metric, key) for key in ("timed", "primary", "version", "origin")},
            }
            for metric in known
        ]
    }


def _registered(what: str | None) -> dict[str, list[dict[str, Any]]]:
    wanted: dict[str, Registry[Any]] = {"planners": planners.REGISTRY, "envs": envs.REGISTRY}
    if what is not None:
        wanted = {what: wanted[what]}
    return {
        kind: [
            {
                "id": spec.id,
                "description": spec.description,
                "version": spec.version,
                "aliases": list(spec.aliases),
                "groups": list(spec.groups),
                "not_repeatable": spec.not_repeatable,
                "origin": spec.origin,
            }
            for spec in registry.specs()
        ]
        for kind, registry in wanted.items()
    }
