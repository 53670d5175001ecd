"""What tells edited sources of packages from those before."""

from __future__ import annotations

import sys
import types
from pathlib import Path

import pytest

from envs.registry.sources import package_digest


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_every_module_of_a_package_counts_and_nothing_else(site: Path) -> None:
    inner = site / "ours" / "inner"
    inner.mkdir(parents=True)
    (site / "ours" / "__init__.py").touch()
    (inner / "deep.py").write_text("A = 1\n")
    first = package_digest("ours.inner.deep")
    assert len(first) == 12
    assert package_digest("ours") == first
    (inner / "notes.txt").write_text("no module")
    assert package_digest("ours") == first
    (inner / "deep.py").write_text("A = 2\n")
    second = package_digest("ours")
    (inner / "deep.py").rename(inner / "deeper.py")
    third = package_digest("ours")
    (inner / "fast.abi3.so").write_bytes(b"compiled")
    assert len({first, second, third, package_digest("ours")}) == 4
    assert "ours" not in sys.modules, "nothing was imported"


def test_a_module_alone_is_its_file(site: Path) -> None:
    (site / "single.py").write_text("A = 1\n")
    first = package_digest("single")
    (site / "other.py").write_text("A = 1\n")
    assert package_digest("single") == first
    (site / "single.py").write_text("A = 2\n")
    assert package_digest("single") not in ("", first)


def test_what_has_no_file_has_no_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "made_here", types.ModuleType("made_here"))
    assert package_digest("made_here") == package_digest("no_such_package") == ""
    assert package_digest("sys") == ""
