"""Options and arguments that several commands have, and what a shell completes of them.

Nothing of the rest of the program is imported here; see `interface`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import click


class Numbers(click.ParamType):  # type: ignore[type-arg]
    """Numbers with commas between."""

    name = "numbers"

    def convert(
        self, value: Any, parameter: click.Parameter | None, context: click.Context | None
    ) -> tuple[float, ...]:
        try:
            return tuple(float(part) for part in value.split(","))
        except ValueError:
            self.fail(f"{value!r} is not numbers with commas between", parameter, context)


def _ids(package: str) -> Callable[[click.Context, click.Parameter, str], list[str]]:
    """What a shell completes the last of some names with commas between to: ids of a registry."""

    def complete(context: click.Context, parameter: click.Parameter, text: str) -> list[str]:
        names = [spec.id for spec in import_module(package).REGISTRY.specs()]
        before, comma, last = text.rpartition(",")
        return [before + comma + name for name in names if name.startswith(last)]

    return complete


ENVS, PLANNERS = _ids("envs"), _ids("planners")


def folder(name: str) -> Callable[[Any], Any]:
    """A folder that run wrote."""
    return click.argument(name, type=click.Path(path_type=Path), metavar=name.upper())


def file(*names: str, metavar: str, help: str, **more: Any) -> Callable[[Any], Any]:
    return click.option(*names, type=click.Path(path_type=Path), metavar=metavar, help=help, **more)


planner_file = file(
    "--planner-file",
    metavar="FILE.py",
    help="of Python whose planners are to be known too; may be given several times",
    multiple=True,
)
metric_file = file(
    "--metric-file",
    metavar="FILE.py",
    help="of Python whose metrics are to be measured too; may be given several times",
    multiple=True,
)
metrics = click.option(
    "--metrics",
    metavar="NAMES",
    help="to compare by, besides success (default: time_s,length,safety_margin)",
)
wide = click.option(
    "--wide", is_flag=True, help="print tables whole, also where the terminal is narrower"
)
device = click.option(
    "--device",
    default="cpu",
    metavar="DEVICE",
    help="of learned planners, cpu or cuda (default: cpu)",
)
env = click.option(
    "--env",
    required=True,
    metavar="ENV",
    shell_complete=ENVS,
    help="an environment, as in c3d:scene=3",
)
problem_file = file(
    "--problem-file",
    metavar="FILE",
    help="of problems (.csv, .json, .yaml), in place of drawn ones",
)
problems = click.option(
    "--problems",
    type=int,
    metavar="N",
    help="an environment (default: 50, of sets of problems all)",
)
