"""The notebooks in docs/ run from top to bottom, and show what they say."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import nbformat
import pytest
from documents import NOTEBOOKS
from nbclient import NotebookClient


def outputs(notebook: Any) -> list[Any]:
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_it_is_stored_without_outputs(file: Path) -> None:
    stored = nbformat.read(file, as_version=4)
    nbformat.validate(stored)
    code = [cell for cell in stored.cells if cell.cell_type == "code"]
    assert code
    assert all(not cell.outputs and cell.execution_count is None for cell in code)


@pytest.mark.slow
def test_the_first_run_shows_progress_a_table_a_plot_and_verdicts(tmp_path: Path) -> None:
    [file] = [file for file in NOTEBOOKS if file.stem == "first_run"]
    notebook = nbformat.read(file, as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=120, resources=resources).execute()
    shown = outputs(notebook)
    told = "".join(output.text for output in shown if output.get("name") == "stderr")
    said = "".join(output.text for output in shown if output.get("name") == "stdout")
    data = [output.data for output in shown if "data" in output]
    bars = told + "".join(one.get("text/plain", "") for one in data)  # widgets, if installed
    assert "/40 [" in bars
    assert any("success_rate" in one.get("text/html", "") for one in data)
    assert any("image/png" in one for one in data)
    refused, accepted = said.splitlines()[:2]
    assert re.fullmatch(
        r"COLLISION - not proved free of collision: the robot comes within \S+ units of obstacle "
        r"\d+ \(a box\), \S+ along the path, at or after waypoint 0",
        refused,
    )
    assert accepted.startswith("VALID - length")


def test_every_notebook_is_run_here() -> None:
    assert [file.stem for file in NOTEBOOKS] == ["first_run"]
