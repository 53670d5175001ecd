"""What others add to a registry: installed packages by entry points, and files nobody installed.

Their modules may do anything when they are imported. `PlugIns` imports them into this process;
whoever must not be reached by them has another ask a process of its own the same.

A class in a file may say more of itself in class attributes that are called like the fields of a
`Spec`: `id` (by default its name, `MyPlanner` as `my-planner`), `description` (by default the
first line of its docstring), `version`, `groups`, `in_all` and `not_repeatable`. The version is by
default made of the file's content, so that results of a changed file can be told apart; that of a
package's spec of the package's files.
"""

from __future__ import annotations

import inspect
import logging
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from envs.errors import InputError, reason
from envs.registry.arguments import typed_arguments
from envs.registry.sources import package_digest
from envs.registry.spec import Spec, check_form, digest, is_file, load_class, module_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

logger = logging.getLogger(__name__)

T = TypeVar("T")

_SAID = {
    "id": str,
    "description": str,
    "version": int,
    "groups": tuple,
    "in_all": bool,
    "not_repeatable": str,
}
"""Fields of a spec that a class in a file may set, and their types."""

_VERSION_DIGITS = 7  # hexadecimal, of the file's digest


def entry_points(group: str) -> Iterable[EntryPoint]:
    """Where packages say what they announce under the name of a group."""
    from importlib import metadata  # not for help and version

    return metadata.entry_points(group=group)


def announced(
    kind: str, points: Iterable[EntryPoint], read: Callable[[EntryPoint], T]
) -> Iterator[T]:
    """What is read at each point. A broken one is named in a warning and left out.

    Args:
        kind: what packages announce, for messages ("planner").
        points: see `entry_points`.
        read: may fail in any way, as it runs what strangers wrote.
    """
    for point in points:
        try:
            found = read(point)
        except (Exception, SystemExit) as error:  # noqa: BLE001, PERF203
            _skip(kind, repr(point.name), error)
        else:
            yield found


def origin_of(point: EntryPoint) -> str:
    """The distribution that an entry point is of."""
    return point.dist.name if point.dist else point.value


def _skip(kind: str, what: str, error: BaseException) -> None:
    logger.warning("%s plug-in %s is skipped: %s", kind, what, reason(error))


class PlugIns:
    """Looks at what others offer, in this process.

    Args:
        kind: what they offer, for messages ("planner").
        group: of the entry points under which packages announce them; each loads to a `Spec`.
        base: what their classes must be subclasses of, or its entry point, to be imported when it
            is needed.
    """

    def __init__(self, kind: str, group: str, base: type | str) -> None:
        self.kind, self.group, self.declared_base = kind, group, base

    @property
    def base(self) -> type:
        """What their classes must be subclasses of."""
        declared = self.declared_base
        return load_class(declared) if isinstance(declared, str) else declared

    def of_packages(self) -> list[Spec]:
        """The specs that installed packages announce. A broken one is named in a warning."""
        return list(announced(self.kind, self.points(), self._spec))

    def points(self) -> Iterable[EntryPoint]:
        """Where packages say what they announce."""
        return entry_points(self.group)

    def _spec(self, point: EntryPoint) -> Spec:
        spec = point.load()
        if not isinstance(spec, Spec):
            raise TypeError(f"{point.value} is a {type(spec).__name__}, not a Spec")
        check_form(self.kind, spec)
        return replace(spec, origin=origin_of(point), version=_version_of(spec))

    def skip(self, what: str, error: BaseException) -> None:
        """Warns that something is left out, and why."""
        _skip(self.kind, what, error)

    def of_file(self, file: Path) -> list[Spec]:
        """A spec for each public subclass of `base` that a file of Python defines, in its order.

        Raises:
            InputError: the file cannot be read or run, or defines none.
        """
        if not is_file(file.name):
            raise InputError(f"{file} is no file of Python, whose name ends in .py")
        file = file.resolve()
        try:
            module = module_of(str(file))
        except InputError:
            raise
        except (Exception, SystemExit) as error:
            raise InputError(f"{file} cannot be loaded: {reason(error)}") from error
        found = [
            cls
            for name, cls in vars(module).items()
            if inspect.isclass(cls)
            and cls.__module__ == module.__name__
            and name == cls.__name__
            and issubclass(cls, self.base)
            and not name.startswith("_")
        ]
        made = [_spec_of(cls, file) for cls in found if not inspect.isabstract(cls)]
        if not made:
            wanted = f"{self.base.__module__.partition('.')[0]}.{self.base.__name__}"
            raise InputError(f"{file} defines no subclass of {wanted}{_unfinished(found)}")
        return made

    def check(self, spec: Spec) -> None:
        """Raises InputError if a spec's class cannot be imported or is of another kind."""
        if not issubclass(spec.load(), self.base):
            raise InputError(f"{spec.id!r} of {spec.origin} is not a {self.base.__name__}")

    def typed(self, spec: Spec, chosen: Mapping[str, str]) -> dict[str, Any]:
        """Arguments that somebody chose for a spec's class; see `typed_arguments`.

        Raises:
            InputError: a name or a value does not fit.
        """
        return typed_arguments(spec.id, spec.load(), spec.arguments, chosen)


def _version_of(spec: Spec) -> int:
    """The version that a package's spec states, or one made of the package's files."""
    source = spec.entry_point.rpartition(":")[0]
    if spec.version != Spec.version or is_file(source):
        return spec.version
    return _as_version(package_digest(source)) or spec.version


def _as_version(digest: str) -> int:
    return int(digest[:_VERSION_DIGITS] or "0", 16)


def _unfinished(classes: list[type]) -> str:
    if not classes:
        return ""
    missing: frozenset[str] = getattr(classes[0], "__abstractmethods__", frozenset())
    return f"; {classes[0].__name__} lacks a method `{min(missing)}`"


def _spec_of(cls: type, file: Path) -> Spec:
    said: dict[str, Any] = {
        "id": re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", cls.__name__).lower(),
        "description": ((cls.__doc__ or "").strip() or cls.__name__).splitlines()[0],
        "version": _as_version(digest(file)),
    }
    for name, kind in _SAID.items():
        value = getattr(cls, name, None)
        if value is None:
            continue
        if not isinstance(value, kind):
            raise InputError(f"{file}: {cls.__name__}.{name} must be a {kind.__name__}")
        said[name] = value
    return Spec(entry_point=f"{file}:{cls.__name__}", origin=str(file), **said)
