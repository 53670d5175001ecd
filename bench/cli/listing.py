"""`bench list`: what is registered. Nothing numerical is imported for it."""

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
    wanted: dict[str, Registry[Any]] = {"planners": planners.REGISTRY, "envs": envs.REGISTRY}
    if chosen.what:
        wanted = {chosen.what: wanted[chosen.what]}
    listed = {
        what: [
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
        for what, registry in wanted.items()
    }
    if chosen.json:
        tell(json.dumps(listed, indent=2))
        return 0
    for what, specs in listed.items():
        tell(f"{what}:")
        for spec in specs:
            tell(f"  {spec['id']:<20} {printable(str(spec['description']))}")
    return 0
