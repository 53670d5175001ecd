"""Compiled code is kept for the sources that it was compiled from."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from envs import compiled
from envs.compiled import cache_folder

ROOT = Path(compiled.__file__).parents[1]

LOWER = (
    "from envs.compiled import njit_inline\n@njit_inline\ndef least(x):\n    return x + {more}\n"
)
UPPER = (
    "import lower\nfrom envs.compiled import njit_cached\n"
    "@njit_cached\ndef total(x):\n    return lower.least(x) * 2\n"
)


def test_every_compiled_function_is_kept_there() -> None:
    """What Numba keeps by itself stays beside its source, whose callees it does not look at."""
    for package in ("envs", "planners", "bench"):
        for file in (ROOT / package).rglob("*.py"):
            if file.name != "compiled.py":
                assert not re.search(r"numba\.n?jit|cache=True", file.read_text()), file


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of what the cache's folder depends on."""
    made = tmp_path / "program"
    for package in ("envs", "planners", "bench"):
        shutil.copytree(
            ROOT / package, made / package, ignore=shutil.ignore_patterns("__pycache__", "*.npz")
        )
    return made


def folder_of(program: Path, cache: Path) -> str:
    code = "from envs.compiled import cache_folder; print(cache_folder())"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(program), "NUMBA_CACHE_DIR": str(cache)},
        cwd="/",
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def test_other_sources_have_another_folder(copy: Path, tmp_path: Path) -> None:
    before = folder_of(copy, tmp_path / "cache")
    assert before == folder_of(copy, tmp_path / "cache")
    assert Path(before).parent == tmp_path / "cache"
    file = copy / "envs" / "grid.py"
    file.write_text(file.read_text() + "\n# another\n")
    assert folder_of(copy, tmp_path / "cache") != before
    readme = copy / "envs" / "errors.py"
    readme.write_text(readme.read_text() + "\n# says nothing of compiling\n")
    assert len(list((tmp_path / "cache").iterdir())) == 2


@pytest.mark.slow
def test_what_calls_a_changed_function_is_compiled_again(copy: Path, tmp_path: Path) -> None:
    """Numba by itself goes on with what it compiled of the caller, whose file is the same."""
    (copy / "envs" / "upper.py").write_text(UPPER.replace("import lower", "from envs import lower"))

    def total(more: int) -> str:
        (copy / "envs" / "lower.py").write_text(LOWER.format(more=more))
        done = subprocess.run(
            [sys.executable, "-c", "from envs.upper import total; print(total(1))"],
            env={**os.environ, "PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(tmp_path / "c")},
            cwd="/",
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.strip()

    assert total(1) == "4"
    # Of another length: Python tells edits within a second by that alone.
    assert total(50) == "102"


def test_folders_that_nobody_used_for_a_month_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, recent, other = tmp_path / ("a" * 16), tmp_path / ("b" * 16), tmp_path / "mine"
    for folder, days in ((old, 40), (recent, 20), (other, 40)):
        folder.mkdir()
        then = time.time() - days * 86_400
        os.utime(folder, (then, then))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    made = Path(cache_folder())
    assert {folder.name for folder in tmp_path.iterdir()} == {recent.name, other.name, made.name}


def test_where_none_can_be_made_numba_chooses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(file))
    assert cache_folder() == ""
