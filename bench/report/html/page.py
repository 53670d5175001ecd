"""The page: a template, filled in, with everything that it needs in it."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from plotly.offline import get_plotlyjs

from bench.report import cells
from bench.report.html.arenas import arenas_of
from bench.report.html.facts import facts_of
from bench.report.html.geometry import TOLERANCE
from bench.report.html.looks import looks
from bench.report.html.overview import overview_data
from bench.report.html.packing import compressed
from bench.report.html.problems import COLUMNS, problems_data
from bench.report.html.tables import common_table, offline_table, success_table
from bench.report.recorded import RecordedRun

_SCRIPTS = ("unpack.js", "tables.js", "charts.js", "scene.js", "problems.js", "report.js")


def write(run: RecordedRun, file: Path) -> None:
    """Writes the report as one file that asks nothing of a network.

    Scenes are made again, and paths that the judge refused are followed to where they first
    collide, which may take some seconds. Paths are drawn to `geometry.TOLERANCE`.
    """
    file.write_text(text(run), encoding="utf-8")


def text(run: RecordedRun) -> str:
    """The page's source."""
    arenas = arenas_of(run)
    planners = list(dict.fromkeys(name for arena in arenas for name in arena.planners))
    numbers = {name: number for number, name in enumerate(planners)}
    data = {
        "planners": looks(planners),
        "columns": [title for title, _ in COLUMNS.values()],
        "tolerance": TOLERANCE,
        "arenas": [overview_data(arena, numbers) for arena in arenas],
    }
    page: str = _template().render(
        run=run,
        environments=[arena.env for arena in arenas],
        data=data,
        packages=[compressed(_json(problems_data(arena))) for arena in arenas],
        plotly=compressed(get_plotlyjs()),
        success=success_table(run.summary, run.spread),
        common=common_table(run.common),
        offline=offline_table(run.summary),
        facts=facts_of(run),
        notes=cells,
        style=_asset("report.css"),
        scripts="\n".join(_asset(name) for name in _SCRIPTS),
    )
    return page


def _template() -> Any:
    loader = PackageLoader("bench.report.html", "assets")
    environment = Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # `tojson` escapes what could end a script.
    environment.policies["json.dumps_function"] = _json
    environment.policies["json.dumps_kwargs"] = {}
    return environment.get_template("report.html")


def _json(data: Any) -> str:
    return json.dumps(data, allow_nan=False, separators=(",", ":"))


def _asset(name: str) -> str:
    return resources.files("bench.report.html").joinpath("assets").joinpath(name).read_text("utf-8")
