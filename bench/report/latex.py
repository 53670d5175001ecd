"""The tables as LaTeX, to paste into a paper; plain ASCII, for any engine and input encoding."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path

import pandas as pd

from bench.analysis.run_results import RunResults
from bench.report import formatting
from bench.storage.record import Verdict

PACKAGES = ("booktabs", "graphicx")
"""What the tables need in a document's preamble."""

_USED = "".join(f"\\usepackage{{{name}}}" for name in PACKAGES)

_PREFACE = f"""\
% Needs {_USED}. Wide tables are shrunk to the text's width.
% A table* is as wide as the page in two columns, and a table like any other in one.
"""

_SUCCESS = "Success, time, length and safety margin."
_FURTHER = "Further metrics of verified successes."
_COMMON = "Mean length and safety margin on the problems that every planner solved."

_SPECIAL = {
    **{character: f"\\{character}" for character in "#$%&_{}"},
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "`": r"\textasciigrave{}",
    "'": r"\textquotesingle{}",
    '"': r"\char34{}",
    "-": "{-}",  # two would become a dash
    "±": r"$\pm$",
}

_ACCENTS = {
    "\N{COMBINING GRAVE ACCENT}": "`",
    "\N{COMBINING ACUTE ACCENT}": "'",
    "\N{COMBINING CIRCUMFLEX ACCENT}": "^",
    "\N{COMBINING TILDE}": "~",
    "\N{COMBINING MACRON}": "=",
    "\N{COMBINING BREVE}": "u",
    "\N{COMBINING DOT ABOVE}": ".",
    "\N{COMBINING DIAERESIS}": '"',
    "\N{COMBINING RING ABOVE}": "r",
    "\N{COMBINING DOUBLE ACUTE ACCENT}": "H",
    "\N{COMBINING CARON}": "v",
    "\N{COMBINING CEDILLA}": "c",
}

_BREAKS = re.compile(r"(?<=[/:=,._])(?=[^\s\d])")
"""Where a long word may go on in the next line."""

_BREAK = r"\allowbreak{}"


def write(run: RunResults, file: Path) -> None:
    """Writes the tables, each a float with caption and label."""
    file.write_text(text(run), encoding="ascii")


def text(run: RunResults) -> str:
    """The tables: all attempts (`tab:success`), the commonly solved problems (`tab:common`), and
    further metrics of all verified successes (`tab:further`). Outcomes other than success
    are told below the first. A table without rows is left out."""
    remarks = [f"{_prose(remark)}." for remark in run.remarks]
    told = [escaped(formatting.success_note(run)), _prose(formatting.spaces_note(run))]
    notes = " ".join(filter(None, [*told, *_other_outcomes(run.summary), *remarks]))
    success = [_without_outcomes(row) for row in formatting.success_rows(run)]
    notes_of_common = _COMMON, formatting.REACHED_NOTE, formatting.left_out_note(run.left_out)
    tables = [
        _float("success", f"{_SUCCESS} {_prose(run.caption)}", success, notes),
        _float(
            "common",
            " ".join(_prose(said) for said in notes_of_common if said),
            formatting.common_rows(run),
            "",
        ),
        _float("further", _FURTHER, formatting.further_rows(run), ""),
    ]
    return _PREFACE + "".join(tables)


def document(tables: str) -> str:
    """A document with nothing but what `text` gives."""
    body = f"\\begin{{document}}\n{tables}\\end{{document}}\n"
    return f"\\documentclass{{article}}\n{_USED}\n{body}"


def escaped(text: str) -> str:
    """Text that LaTeX sets as it stands. Letters with accents become commands; characters beyond
    the fonts of plain LaTeX are named, as in [U+4E2D]."""
    return "".join(map(_escaped, unicodedata.normalize("NFC", text)))


def _escaped(character: str) -> str:
    if character in _SPECIAL:
        return _SPECIAL[character]
    if " " <= character <= "~":
        return character
    parts = unicodedata.normalize("NFD", character)
    base, mark = parts[0], parts[1:]
    if base.isascii() and base.isalpha() and mark in _ACCENTS:
        return f"\\{_ACCENTS[mark]}{{{base}}}"
    return f"[U+{ord(character):04X}]"


def name(text: str) -> str:
    """A planner or environment in typewriter letters; every space of it is kept."""
    spaced = _breakable(text).replace(" ", r"\ ")
    return rf"\texttt{{{spaced}}}"


def _breakable(text: str) -> str:
    return _BREAK.join(map(escaped, _BREAKS.split(text)))


def _prose(markdown: str) -> str:
    """Text with names between backticks."""
    pieces = re.split(r"`([^`]*)`", " ".join(markdown.split()))
    return "".join(name(p) if n % 2 else _breakable(p) for n, p in enumerate(pieces))


def _without_outcomes(row: dict[str, str]) -> dict[str, str]:
    return {title: cell for title, cell in row.items() if title != "outcomes"}


def _other_outcomes(summary: pd.DataFrame) -> list[str]:
    """A sentence on each row with outcomes other than success."""
    told = []
    for row in summary.to_dict("records"):
        outcomes = formatting.outcomes(row)
        outcomes.pop(Verdict.VALID.value, None)
        if outcomes:
            who = f"{name(row['planner'])} in {name(row['env'])}"
            said = formatting.counted(outcomes) + formatting.because(row)
            told.append(f"{who}: {escaped(said.rstrip('.'))}.")
    return told


def _float(label: str, caption: str, rows: Sequence[dict[str, str]], notes: str) -> str:
    if not rows:
        return ""
    note = rf"\par\smallskip\parbox{{\textwidth}}{{\footnotesize\raggedright {notes}}}"
    lines = [
        r"\begin{table*}",
        r"\centering\sloppy",
        rf"\caption{{{caption}}}",
        rf"\label{{tab:{label}}}",
        r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{%",
        *_tabular(rows),
        "}",
        *([note] if notes else []),
        r"\end{table*}",
    ]
    return "\n".join(lines) + "\n"


def _tabular(rows: Sequence[dict[str, str]]) -> list[str]:
    """Lines of a table in which environments are headings."""
    titles = [title for title in rows[0] if title != "env"]
    columns = "".join("r" if title in formatting.NUMERIC else "l" for title in titles)
    lines = [rf"\begin{{tabular}}{{{columns}}}", r"\toprule", _line(map(escaped, titles))]
    for env, group in groupby(rows, key=lambda row: row["env"]):
        lines += [r"\midrule", rf"\multicolumn{{{len(titles)}}}{{l}}{{{name(env)}}} \\"]
        for row in group:
            others = (title for title in titles if title != "planner")
            lines.append(_line([name(row["planner"]), *(_cell(t, row[t]) for t in others)]))
    return [*lines, r"\bottomrule", r"\end{tabular}%"]


def _line(texts: Iterable[str]) -> str:
    return rf"{' & '.join(texts)} \\"


def _cell(title: str, text: str) -> str:
    return (
        _breakable(text)
        if title in formatting.WORDS and text != formatting.NONE
        else _numbers(text)
    )


def _numbers(cell: str) -> str:
    """A cell of numbers: a hyphen is a minus before a number, else a dash for none."""
    signed = re.sub(r"-(\w?)", lambda found: f"$-${found[1]}" if found[1] else "--", cell)
    return signed.replace("±", r"$\pm$").replace("%", r"\%")
