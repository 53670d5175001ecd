"""What every fuzzing test is held to besides its own checks."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def nothing_is_written(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """To the current folder or the user's cache."""
    folder = tmp_path_factory.mktemp("current")
    monkeypatch.chdir(folder)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    yield
    assert not list(folder.iterdir())
