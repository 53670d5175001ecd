"""Other distributions that have packages called as ours are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import plugins
import pytest

import plannerbench


def run(first_on_path: Path) -> subprocess.CompletedProcess[str]:
    """`bench list envs` as the installed script runs it, with a folder before all others."""
    code = (
        f"import sys; sys.path.insert(0, {str(first_on_path)!r}); sys.argv[1:] = ['list', 'envs'];"
        "import plannerbench; sys.exit(plannerbench.main())"
    )
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd="/",
        env={**os.environ, "PYTHONPATH": str(Path(plannerbench.__file__).parent)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("package", "distribution", "text"),
    [
        ("bench", "frappe_bench", "VERSION = 5\n"),
        ("envs", "envs", "def env(key):\n    return key\n"),
    ],
)
def test_a_clash_is_said_in_a_line(
    tmp_path: Path, package: str, distribution: str, text: str
) -> None:
    plugins.install(tmp_path, package, text, {})
    made = next(tmp_path.glob("*.dist-info"))
    (made / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1\n")
    (made / "top_level.txt").write_text(f"{package}\n")
    done = run(tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == (
        f"bench: error: the package {package!r} is also that of {distribution}, which is "
        "installed here too; install plannerbench into an environment of its own\n"
    )


def test_a_folder_that_nobody_installed_is_named(tmp_path: Path) -> None:
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs" / "__init__.py").write_text("")
    done = run(tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"bench: error: {tmp_path / 'envs'} stands in the place of ")
    assert done.stderr.count("\n") == 1


def test_without_a_clash_the_command_runs(tmp_path: Path) -> None:
    done = run(tmp_path)
    assert done.returncode == 0, done.stderr
    assert "c3d" in done.stdout
