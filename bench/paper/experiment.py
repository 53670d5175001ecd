"""What every experiment of the paper has, and what comes of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from bench.analysis.run_results import RunResults
from bench.report import markdown
from envs import InputError


@dataclass(frozen=True)
class Table:
    """A table as text, and as numbers for other programs.

    Attributes:
        cells: rows of column names to texts.
        numbers: the same unrounded.
    """

    cells: Sequence[dict[str, str]]
    numbers: pd.DataFrame


@dataclass(frozen=True)
class Section:
    """What came of an experiment.

    Attributes:
        name: of the experiment; of its files, too.
        heading: a title, and where in the paper it is.
        caption: how it came about.
        table: if it has one.
        picture: the file, if it has one.
        remarks: on single rows.
    """

    name: str
    heading: str
    caption: str
    table: Table | None = None
    picture: Path | None = None
    remarks: Sequence[str] = ()

    def markdown(self) -> str:
        """All of it; pictures are named relative to the folder that they are in."""
        parts = [f"## {self.heading}", self.caption]
        if self.table is not None:
            parts.append(markdown.table(self.table.cells))
        parts += [f"- {remark}" for remark in self.remarks]
        if self.picture is not None:
            parts.append(f"![{self.heading}]({self.picture.name})")
        return "\n\n".join(parts) + "\n"


@dataclass(frozen=True)
class Place:
    """Where experiments are carried out.

    Attributes:
        data: the folder with the experiments and the paper's figures.
        out: the folder for what comes of them.
        quick: whether numbers of problems are scaled down.
    """

    data: Path
    out: Path
    quick: bool

    def figures(self, name: str) -> pd.DataFrame:
        """The paper's figures for an experiment."""
        return pd.read_csv(self.data / f"{name}.csv")

    def measured(self, name: str) -> RunResults:
        """What the comparison of that name measured.

        Raises:
            InputError: nothing yet.
        """
        try:
            return RunResults.read(self.out / name)
        except InputError as error:
            raise InputError(
                f"{self.out} holds no run of {name} yet; `bench paper --only {name}` makes it"
            ) from error


@dataclass(frozen=True, kw_only=True)
class Experiment(ABC):
    """A table or figure of the paper, as its TOML file describes it.

    Attributes:
        name: the file's.
        order: among all.
        title: what it is.
        where: in the paper.
        generated: what stands for the paper's own scenes; empty where they are its own.
        note: what else is to be known.
    """

    # Read by pydantic, which checks files against the annotations: what is not named is a mistake,
    # and nothing is taken for what it is not.
    __pydantic_config__ = {"extra": "forbid", "strict": True, "allow_inf_nan": False}  # noqa: RUF012

    name: str
    order: int
    title: str
    where: str
    generated: str = ""
    note: str = ""

    @abstractmethod
    def carried_out(self, place: Place) -> Section:
        """Measures or draws what is not there yet.

        Raises:
            InputError: it cannot be done here.
        """

    @property
    def heading(self) -> str:
        """Its title, and where in the paper it is."""
        return f"{self.title} ({self.where})"

    def caption(self, *sentences: str) -> str:
        """Sentences, with what every caption says."""
        stands_in = f"Generated stand-in, not the paper's own: {self.generated}."
        parts = [*sentences, stands_in if self.generated else "", self.note]
        return " ".join(part for part in parts if part)
