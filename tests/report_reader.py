"""Reads the tables of reports back, from each format."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import tex_reader
from lxml import html as lxml_html

Rows = list[dict[str, str]]
Tables = tuple[Rows, Rows]
"""All attempts, and commonly solved problems."""

Printed = dict[str, tuple[int, int, list[str]]]
"""Titles to a factor, digits, and columns of the CSV file."""


def printed(spread: str) -> Printed:
    """What the table of all attempts shows, with this after each ±."""
    moments = ("mean", spread, "median")
    return {
        "problems": (1, 0, ["problems"]),
        "success %": (100, 1, ["success_rate", "success_low", "success_high"]),
        "time s": (1, 3, [f"time_s_{what}" for what in moments]),
        "length units": (1, 2, [f"length_{what}" for what in moments]),
        "safety margin units": (
            1,
            2,
            [f"safety_margin_{what}" for what in moments],
        ),
        "offline s": (1, 2, ["offline_s"]),
    }


COMMON: Printed = {
    "n": (1, 0, ["problems"]),
    "length units": (1, 2, ["length_mean"]),
    "safety margin units": (1, 2, ["safety_margin_mean"]),
}


def exact_rows(csv: Path) -> Rows:
    """The CSV file's rows, as text."""
    rows: Rows = pd.read_csv(csv, dtype=str, keep_default_na=False).to_dict("records")
    return rows


def of_markdown(text: str) -> Tables:
    """Both tables of `summary.md`."""
    tables: list[Rows] = []
    for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        head, _, *lines = [
            [c.strip().replace(r"\|", "|") for c in re.split(r"(?<!\\)\|", line)[1:-1]]
            for line in block.splitlines()
        ]
        tables.append([dict(zip(head, line, strict=True)) for line in lines])
    return tables[0], tables[-1]


def of_latex(text: str) -> Tables:
    """Both tables of `summary.tex`; the outcomes are in the note."""
    tables = tex_reader.tables(text)
    [note] = re.findall(r"\\raggedright (.*)\}\n", text)
    told = tex_reader.plain(note)
    for cells in tables["success"]:
        found = told.partition(f"{cells['planner']} in {cells['env']}: ")[2]
        cells["outcomes"] = found.partition(".")[0]
    return tables["success"], tables["common"]


def of_html(text: str) -> Tables:
    """Both tables of `report.html`, known by their titles."""
    tables: list[Rows] = []
    for table in lxml_html.document_fromstring(text).iter("table"):
        lines = [[cell.text_content().strip() for cell in line] for line in table.iter("tr")]
        tables.append([dict(zip(lines[0], line, strict=True)) for line in lines[1:]])
    [success] = [rows for rows in tables if rows and set(printed("std")) <= set(rows[0])]
    [common] = [rows for rows in tables if rows and set(COMMON) <= set(rows[0])]
    return success, common
