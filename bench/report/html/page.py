"""The page: a template, filled in, with everything in it that it needs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.colors import to_hex, to_rgb
from plotly.offline import get_plotlyjs

from bench.analysis.run_results import RunResults
from bench.report import formatting
from bench.report.chosen_paths import colours
from bench.report.html.geometry import TOLERANCE, compressed
from bench.report.html.overview import (
    common_table,
    facts_of,
    further_table,
    offline_table,
    overview_data,
    success_table,
)
from bench.report.html.problems import columns, problem_sets_of, problems_data
from bench.report.html.sweeps import difficulty_charts

_SCRIPTS = ("unpack.js", "tables.js", "charts.js", "scene.js", "problems.js", "report.js")


def write(run: RunResults, file: Path) -> None:
    """Writes the report as one file that asks nothing of a network.

    Scenes are made again, and paths that the judge refused are followed to where they first
    collide, which may take some seconds. Paths are drawn to `geometry.TOLERANCE`.
    """
    file.write_text(text(run), encoding="utf-8")


def text(run: RunResults) -> str:
    """The page's source."""
    problem_sets = problem_sets_of(run)
    planners = list(
        dict.fromkeys(name for problem_set in problem_sets for name in problem_set.planners)
    )
    numbers = {name: number for number, name in enumerate(planners)}
    shown = columns(run)
    data = {
        "planners": planner_styles(planners),
        "columns": [title for _, title, _ in shown],
        "tolerance": TOLERANCE,
        "problem_sets": [
            overview_data(problem_set, numbers, run.metrics) for problem_set in problem_sets
        ],
        "difficulty": difficulty_charts(problem_sets, numbers, run.metrics),
    }
    page: str = _template().render(
        run=run,
        environments=[problem_set.env for problem_set in problem_sets],
        data=data,
        packages=[
            compressed(_json(problems_data(problem_set, shown))) for problem_set in problem_sets
        ],
        plotly=compressed(get_plotlyjs()),
        success=success_table(run),
        further=further_table(run),
        common=common_table(run),
        offline=offline_table(run),
        facts=facts_of(run),
        notes=formatting,
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


_DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
_SYMBOLS = ("circle", "square", "diamond", "circle-open", "square-open", "diamond-open")
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of sRGB, ITU-R BT.709
_DARK_MOST, _LIGHT_LEAST = 0.75, 0.35  # luminances on a light and on a dark page


def planner_styles(planners: Sequence[str]) -> list[dict[str, Any]]:
    """For each planner its `name`; `light` and `dark`, its colour on such pages, which differ only
    where it could hardly be seen; and `dash` and `symbol` for those who cannot tell colours apart,
    by plotly's names."""
    return [
        {
            "name": name,
            "light": _within(colour, 0.0, _DARK_MOST),
            "dark": _within(colour, _LIGHT_LEAST, 1.0),
            "dash": _DASHES[number % len(_DASHES)],
            "symbol": _SYMBOLS[number % len(_SYMBOLS)],
        }
        for number, (name, colour) in enumerate(colours(planners).items())
    ]


def _within(colour: str, least: float, most: float) -> str:
    """A colour, mixed with white or black until its luminance is between two others."""
    rgb = np.array(to_rgb(colour))
    luminance = float(_LUMINANCE @ rgb)
    if luminance < least:
        rgb = 1 - (1 - rgb) * (1 - least) / (1 - luminance)
    if luminance > most:
        rgb = rgb * most / luminance
    return to_hex(tuple(rgb.clip(0, 1)))
