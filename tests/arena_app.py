"""Planner Arena's own application, asked for its plots without a browser."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from plannerarena import app as arena

SHOWN = (
    "performance-plot",
    "performance-missing_data_table",
    "progress-plot",
    "progress-plot_num_measurements",
    "database_info-benchmark_info",
    "database_info-planner_configs",
)
"""Its outputs."""

_SCOPE = {
    "type": "websocket",
    "path": "/websocket/",
    "root_path": "",
    "query_string": b"",
    "headers": [],
    "subprotocols": [],
    "scheme": "ws",
    "client": ("here", 1),
    "server": ("here", 2),
    "asgi": {"version": "3.0"},
}
_ANSWER_S = 60


def start_values(planners: Sequence[str], experiment: str, version: str) -> dict[str, Any]:
    """What its widgets send at first: planners, an environment and a version are chosen."""
    pages = {
        f"{page}-{widget}": value
        for page in ("performance", "progress")
        for widget, value in {
            "problem": experiment,
            "version": version,
            "planners": list(planners),
        }.items()
    }
    boxes = ("hide_outliers", "show_as_cdf", "show_simplified", "y_log_scale")
    sizes = {"hidden": False, "width": 300, "height": 200}
    return {
        **pages,
        **{f"performance-{box}": False for box in boxes},
        "performance-attribute": "time",
        "progress-attribute": "best cost",
        "progress-show_measurements": True,
        "progress-opacity": 50,
        "database": None,
        ".clientdata_pixelratio": 1,
        ".clientdata_url_search": "",
        **{
            f".clientdata_output_{output}_{what}": value
            for output in SHOWN
            for what, value in sizes.items()
        },
    }


def outputs(database: Path, values: Mapping[str, Any]) -> dict[str, Any]:
    """What each output shows of a database with its widgets so set.

    Raises:
        AssertionError: an output shows an error.
    """
    before = arena.DATABASE
    arena.DATABASE = database
    try:
        return asyncio.run(_session(values))
    finally:
        arena.DATABASE = before


async def _session(values: Mapping[str, Any]) -> dict[str, Any]:
    sent: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    answered: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    started = json.dumps({"method": "init", "data": values})
    await sent.put({"type": "websocket.connect"})
    await sent.put({"type": "websocket.receive", "text": started})
    session = asyncio.create_task(arena.app(_SCOPE, sent.get, answered.put))
    shown: dict[str, Any] = {}
    while not set(SHOWN) <= set(shown):
        message = await asyncio.wait_for(answered.get(), _ANSWER_S)
        answer = json.loads(message.get("text", "{}"))
        assert not answer.get("errors"), answer["errors"]
        assert message["type"] != "websocket.close", "it gave up"
        shown |= answer.get("values", {})
    await sent.put({"type": "websocket.disconnect", "code": 1000})
    await session
    return shown
