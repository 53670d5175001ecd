"""Metrics that users add: of installed packages, by entry points, and of files nobody installed.

They are computed where paths are judged, so their modules are imported there; a command that has
begun looks afterwards whether they have changed this program (`bench.execution.launch`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

from bench.judging import METRIC_GROUP, metrics
from bench.judging.metric import Metric
from bench.storage.record import COLUMNS
from envs import InputError
from envs.errors import reason
from envs.registry.plugins import announced, entry_points
from envs.registry.sources import package_digest
from envs.registry.spec import digest, is_file, module_of


@contextmanager
def registered(files: Sequence[Path]) -> Iterator[None]:
    """The metrics of packages and of some files, as long as the context lasts.

    Raises:
        InputError: a file cannot be read or run, or has no metric, or a name is taken.
    """
    added = [metric for file in files for metric in metrics_of_file(file)]
    with metrics.registered([*_of_packages(), *added], COLUMNS):
        yield


def metrics_of_file(file: Path) -> list[Metric]:
    """The metrics that a file of Python defines in variables, in its order.

    Raises:
        InputError: it cannot be read or run, or defines none.
    """
    if not is_file(file.name):
        raise InputError(f"{file} is no file of Python, whose name ends in .py")
    try:
        module = module_of(str(file.resolve()))
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(f"{file} cannot be loaded: {reason(error)}") from error
    found = [value for value in vars(module).values() if isinstance(value, Metric)]
    made = [metric for metric in dict.fromkeys(found) if not metric.origin]
    if not made:
        raise InputError(f"{file} defines no bench.Metric; give one a name, as in METRIC = Metric(")
    version = digest(file)
    return [replace(metric, origin=str(file), version=version) for metric in made]


def _of_packages() -> list[Metric]:
    """A broken one is named in a warning."""
    return list(announced("metric", entry_points(METRIC_GROUP), _announced_metric))


def _announced_metric(point: EntryPoint) -> Metric:
    metric = point.load()
    if not isinstance(metric, Metric):
        raise TypeError(f"{point.value} is a {type(metric).__name__}, not a Metric")
    if point.dist is None:
        return replace(metric, origin=point.value)
    version = metric.version or package_digest(point.module) or point.dist.version
    return replace(metric, origin=point.dist.name, version=version)
