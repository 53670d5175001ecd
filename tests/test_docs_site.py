"""What builds the documentation, as far as it goes without Sphinx (`tox run -e docs` builds it)."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest
from documents import ROOT

import envs
import planners

DOCS = ROOT / "docs"


@pytest.fixture
def extension(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(DOCS / "extensions")
    return importlib.import_module


@pytest.mark.parametrize("registry", [planners.REGISTRY, envs.REGISTRY], ids=["planners", "envs"])
def test_everything_registered_has_a_section_and_arguments_with_a_meaning(
    extension: Any, registry: Any
) -> None:
    text = extension("registry_text")
    made = list(text.sections(registry))
    assert [one.partition("\n")[0] for one in made] == [f"## `{s.id}`" for s in registry.specs()]
    rows = [line for one in made for line in one.splitlines() if line.startswith("| `")]
    assert rows
    assert [line for line in rows if line.endswith("|  |")] == [], "without a meaning"


def test_defaults_and_types_are_those_of_the_constructor(extension: Any) -> None:
    text = extension("registry_text")
    ids = [spec.id for spec in envs.REGISTRY.specs()]
    about = dict(zip(ids, text.sections(envs.REGISTRY), strict=True))
    assert "| `boxes` | `int` | `10` | how many. |" in about["c3d"]
    assert "| `root` | `str` | must be given |" in about["gibson"]
    assert "`model`" not in about["arm4"], "the spec has chosen it"


def test_links_to_files_lead_to_pages_or_downloads(extension: Any) -> None:
    pages = extension("repository_pages")
    text = "[a](../ARCHITECTURE.md#reasons) [b](../README.md) [c](../results/paper) [d](judge.md)"
    assert pages.on_site(text, DOCS, DOCS) == (
        "[a](architecture.md#reasons) [b](index.md) c (in the repository) [d](judge.md)"
    )
    text = "[a](docs/methods/arms.md) [b](CONTRIBUTING.md) [c](tox.ini) [d](https://a.org/b.md)"
    assert pages.on_site(text, ROOT, DOCS) == (
        "[a](methods/arms.md) [b](contributing.md) {download}`c <../tox.ini>` [d](https://a.org/b.md)"
    )


def test_a_page_that_loads_something_from_the_network_is_found(
    extension: Any, tmp_path: Path
) -> None:
    check = extension("offline_check")
    (tmp_path / "good.html").write_text(
        '<link rel="stylesheet" href="_static/a.css"><link rel="canonical" href="https://a.org/">'
        '<script src="_static/a.js"></script><a href="https://a.org/">there</a>'
    )
    assert list(check.loaded_from_elsewhere(tmp_path)) == []
    (tmp_path / "bad.html").write_text(
        '<script src="https://a.org/a.js"></script><link rel="stylesheet" href="//a.org/a.css">'
        "<style>@import 'https://a.org/b.css';</style><img src='http://a.org/a.png'>"
    )
    (tmp_path / "bad.css").write_text("@font-face { src: url(https://a.org/a.woff) }")
    found = [address for _, address in check.loaded_from_elsewhere(tmp_path)]
    assert found == [
        "https://a.org/a.js",
        "//a.org/a.css",
        "https://a.org/b.css",
        "http://a.org/a.png",
        "https://a.org/a.woff",
    ]
