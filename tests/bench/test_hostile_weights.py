"""Weights that nobody should load, through the command line: one line, and nothing is run, changed
or made."""

from __future__ import annotations

import hashlib
import json
import pickle
import resource
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy
from conftest import Refused

import envs
from planners.learning import weight_files

ENV = "c3d:scene=1"


class Payload:
    """Makes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return Path.touch, (str(self.mark),)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    """A copy of weights that ship, and fit."""
    shipped = weight_files.find("ntfields", envs.make(ENV).fingerprint)
    assert shipped is not None
    folder = tmp_path / "given"
    folder.mkdir()
    file = folder / "w.safetensors"
    file.write_bytes(shipped.read_bytes())
    beside(file).write_bytes(beside(shipped).read_bytes())
    return file


def beside(file: Path) -> Path:
    return weight_files.manifest_file(file)


def say(file: Path, **other: object) -> None:
    """Changes what the manifest says."""
    described = json.loads(beside(file).read_text())
    beside(file).write_text(json.dumps(described | other))


def vouch(file: Path, data: bytes) -> None:
    """Other content, which the manifest vouches for."""
    file.write_bytes(data)
    say(file, sha256=hashlib.sha256(data).hexdigest())


def with_tensors(file: Path, change: Callable[[dict[str, np.ndarray]], object]) -> None:
    tensors = safetensors.numpy.load(file.read_bytes())
    change(tensors)
    vouch(file, safetensors.numpy.save(tensors))


def largest(tensors: dict[str, np.ndarray]) -> str:
    return max(tensors, key=lambda name: tensors[name].size)


def cut_row(tensors: dict[str, np.ndarray]) -> None:
    name = largest(tensors)
    tensors[name] = np.ascontiguousarray(tensors[name][:-1])


def widen(tensors: dict[str, np.ndarray]) -> None:
    tensors[largest(tensors)] = tensors[largest(tensors)].astype(np.float64)


def put_nan(tensors: dict[str, np.ndarray]) -> None:
    tensors[largest(tensors)].flat[0] = np.nan


def sparse(file: Path) -> None:
    with file.open("r+b") as opened:
        opened.truncate(10 * 2**30)  # takes no room on disk


HEADER_10_GB = struct.pack("<Q", 10 * 2**30) + b"{}"
LYING = b'{"a":{"dtype":"F32","shape":[2684354560],"data_offsets":[0,10737418240]}}'

HOSTILE: dict[str, tuple[Callable[[Path], object], str]] = {
    "no file": (lambda f: f.unlink(), "no such file"),
    "a folder": (lambda f: (f.unlink(), f.mkdir()), "no such file"),
    "no manifest": (lambda f: beside(f).unlink(), "w.json"),
    "truncated": (lambda f: f.write_bytes(f.read_bytes()[:-9]), "not the file that its manifest"),
    "empty": (lambda f: f.write_bytes(b""), "not the file that its manifest"),
    "one bit": (
        lambda f: f.write_bytes(f.read_bytes()[:-1] + bytes([f.read_bytes()[-1] ^ 1])),
        "not the file that its manifest",
    ),
    "10 GB": (sparse, "too many"),
    "a header of 10 GB": (lambda f: vouch(f, HEADER_10_GB), "not a file of weights"),
    "tensors of 10 GB": (
        lambda f: vouch(f, struct.pack("<Q", len(LYING)) + LYING + b"abcd"),
        "not a file of weights",
    ),
    "of another scene": (lambda f: say(f, env_fingerprint="0" * 16), "are for environment"),
    "of another planner": (lambda f: say(f, planner="ief3d"), "are for planner ief3d"),
    "wrong shape": (lambda f: with_tensors(f, cut_row), "does not hold weights of ntfields"),
    "a tensor too few": (
        lambda f: with_tensors(f, lambda t: t.pop(largest(t))),
        "does not hold weights of ntfields",
    ),
    "a tensor too many": (
        lambda f: with_tensors(f, lambda t: t.update(more=np.ones(3, np.float32))),
        "does not hold weights of ntfields",
    ),
    "other numbers": (lambda f: with_tensors(f, widen), "float64"),
    "NaN": (lambda f: with_tensors(f, put_nan), "NaN or infinite"),
    "manifest: no JSON": (lambda f: beside(f).write_text("{"), "w.json"),
    "manifest: deep": (lambda f: beside(f).write_text("[" * 100_000), "w.json"),
    "manifest: a list": (lambda f: beside(f).write_text("[]"), "not a manifest of weights"),
    "manifest: newer": (lambda f: say(f, format=99), "format 99"),
    "manifest: odd": (lambda f: say(f, command=3), "command has the wrong type"),
    "manifest: NaN": (lambda f: say(f, train_s=float("nan")), "train_s is no number of seconds"),
    "manifest: more": (lambda f: say(f, run="rm -r /"), "not a manifest of weights"),
    "manifest: large": (lambda f: beside(f).write_text(" " * 2**21), "w.json"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_weights_are_refused(kind: str, weights: Path, refused: Refused) -> None:
    make, said = HOSTILE[kind]
    make(weights)
    before = state(weights.parent)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert said in refused(
        *("run", "--env", ENV, "--planners", f"ntfields:weights={weights},rrtconnect"),
        *("--problems", 1, "--out", "run"),
    )
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - grown
    assert grown < 2**20, "kB; nothing like 10 GB was held"
    assert state(weights.parent) == before


def test_weights_that_are_found_must_fit_too(
    weights: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    env = "c3d:scene=55,boxes=3"
    domain = envs.make(env).fingerprint
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with_tensors(weights, cut_row)
    say(weights, env_fingerprint=domain)
    weight_files.link(weights, "ntfields", domain)
    said = refused("run", "--env", env, "--planners", "ntfields", "--problems", 1)
    assert "does not hold weights of ntfields" in said
    assert "size mismatch" in said, "why"


def test_a_pickle_is_not_run(weights: Path, tmp_path: Path, refused: Refused) -> None:
    mark = tmp_path / "ran"
    vouch(weights, pickle.dumps(Payload(mark)))
    for command in (
        ("run", "--env", ENV, "--planners", f"ntfields:weights={weights}", "--problems", 1),
        ("field", "--env", ENV, "--planners", f"ntfields:weights={weights}", "--out", "f.png"),
    ):
        assert "not a file of weights" in refused(*command)
        assert not mark.exists()


def state(folder: Path) -> dict[str, tuple[int, float]]:
    """Sizes and times: one file is too large to be compared."""
    return {p.name: (p.stat().st_size, p.stat().st_mtime) for p in folder.iterdir()}
