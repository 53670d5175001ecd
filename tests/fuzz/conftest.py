"""What every fuzzing test is held to besides its own checks."""

from __future__ import annotations

from collections.abc import Iterator

import fuzzing
import pytest

import envs


@pytest.fixture(
    autouse=True,
    params=[pytest.param(0.05, id="few"), pytest.param(1.0, id="all", marks=pytest.mark.slow)],
)
def share_of_inputs(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Few inputs in each run of the tests, all of them where slow ones are run."""
    monkeypatch.setattr(fuzzing, "SHARE", request.param)


@pytest.fixture(scope="session", autouse=True)
def compiled() -> None:
    """What an arm has Numba compile the first time is not on the clock of a parser."""
    assert envs.make("arm5:self_collision=true").fingerprint


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
