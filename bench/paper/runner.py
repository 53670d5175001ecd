"""Which experiments there are, and carrying them out."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from bench.paper.comparison import Comparison
from bench.paper.experiment import Experiment, Place, Section
from bench.paper.figures import Fields, Paths
from bench.paper.fmm_scaling import Dimensions
from bench.paper.training_cost import Offline
from envs import InputError
from envs.errors import UnknownNameError, brief, suggestion

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

logger = logging.getLogger(__name__)

KINDS: dict[str, type[Experiment]] = {
    "comparison": Comparison,
    "offline": Offline,
    "dimensions": Dimensions,
    "fields": Fields,
    "paths": Paths,
}


def data_folder() -> Path:
    """Where the experiments are described: in the package, or beside it in a checkout."""
    installed = Path(__file__).parent / "experiments"
    return installed if installed.is_dir() else Path(__file__).parents[2] / "results" / "paper"


def experiments(folder: Path) -> list[Experiment]:
    """All of a folder, in their order.

    Raises:
        InputError: a file describes none.
    """
    return sorted(map(_read, folder.glob("*.toml")), key=lambda one: one.order)


def chosen(all_of_them: Sequence[Experiment], names: Iterable[str]) -> list[Experiment]:
    """Those named, in their order; all if none is.

    Raises:
        UnknownNameError: a name is not among them.
    """
    wanted = set(names)
    known = [one.name for one in all_of_them]
    for name in wanted - set(known):
        raise UnknownNameError("experiment", name, known)
    return [one for one in all_of_them if not wanted or one.name in wanted]


@dataclass(frozen=True)
class Outcome:
    """What came of experiments: all of it as Markdown, and the names of those that could not be
    carried out."""

    text: str
    failed: tuple[str, ...]


def carry_out(
    wanted: Sequence[Experiment], all_of_them: Sequence[Experiment], place: Place
) -> Outcome:
    """Carries experiments out. What comes of each is in NAME.md and its table in NAME.csv;
    `paper.md` is what came of all of them so far, in their order.

    One that cannot be carried out here is no reason to leave out the others.

    Raises:
        InputError: the folder cannot be written to.
    """
    parts: list[str] = []
    failed: list[str] = []
    try:
        place.out.mkdir(parents=True, exist_ok=True)
        for number, one in enumerate(wanted, start=1):
            logger.info("%d of %d: %s", number, len(wanted), one.heading)
            try:
                section = one.carried_out(place)
            except InputError as error:
                section = Section(one.name, one.heading, f"Could not be carried out: {error}")
                failed.append(one.name)
            parts.append(section.markdown())
            _write(section, place.out)
            _gather(all_of_them, place.out)
    except OSError as error:
        raise InputError(f"cannot write to {place.out}: {error}") from error
    return Outcome("\n".join(parts), tuple(failed))


def _write(section: Section, folder: Path) -> None:
    (folder / f"{section.name}.md").write_text(section.markdown(), encoding="utf-8")
    if section.table is not None:
        section.table.numbers.to_csv(folder / f"{section.name}.csv", index=False)


def _gather(experiments: Sequence[Experiment], folder: Path) -> None:
    files = [folder / f"{one.name}.md" for one in experiments]
    texts = [file.read_text(encoding="utf-8") for file in files if file.is_file()]
    (folder / "paper.md").write_text("\n".join(texts), encoding="utf-8")


def _read(file: Path) -> Experiment:
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:  # TOML's own, of the encoding, of long integers
        raise InputError(f"{file} is not TOML: {error}") from error
    kind = data.pop("kind", None)
    made = KINDS.get(kind) if isinstance(kind, str) else None
    if made is None:
        raise InputError(f"{file}: kind {brief(kind)}; {suggestion(kind, KINDS)}")
    try:
        return _checked(made, file.stem, data)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


def _checked(kind: type[Experiment], name: str, data: dict[str, Any]) -> Experiment:
    """An experiment of a kind from what its file says, checked against its annotations."""
    import pydantic  # a quarter of a second, which other commands save

    if "name" in data:
        raise InputError(f"unknown key 'name'; an experiment is called as its file, {name!r}")

    # As JSON, in which lists stand for tuples and nothing else is taken for what it is not.
    try:
        text = json.dumps({**data, "name": name}, default=lambda odd: {"": str(odd)})
    except ValueError as error:  # hexadecimal integers may be longer than Python writes any
        raise InputError(f"a number of it is too long: {error}") from error
    try:
        return pydantic.TypeAdapter(kind).validate_json(text)
    except pydantic.ValidationError as error:
        found = min(error.errors(include_url=False), key=lambda one: _GRAVEST.get(one["type"], 2))
        key = str(found["loc"][0])
        if found["type"] == "unexpected_keyword_argument":
            known = [one.name for one in fields(kind) if one.name != "name"]
            said = f"unknown key {key!r}; {suggestion(key, known)}"
        elif found["type"] == "missing":
            said = f"{key} is missing"
        else:
            said = f"{key}: {brief(found['input'])} is not of the kind that belongs there"
        raise InputError(said) from error


_GRAVEST = {"unexpected_keyword_argument": 0, "missing": 1}
"""What is said first of a file with several mistakes."""
