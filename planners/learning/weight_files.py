"""Weights of learned planners on disk: numbers without code, and a manifest that says whose.

`NAME.safetensors` holds the numbers, `NAME.json` beside it the manifest. Nothing in either is
executed on reading, and both are checked before they are used.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray
from safetensors import SafetensorError

from envs import InputError
from envs.errors import brief, input_error_of
from envs.files.paths import atomic_write, cache_folder

FORMAT = 1
_MOST_BYTES = 64 * 2**20  # of weights; those of this project have under two MB
_MOST_MANIFEST_BYTES = 2**20
_MOST_S = 1e9  # of data and of training

_TIMES = ("data_s", "train_s")
_TYPES: Mapping[str, type | tuple[type, ...]] = {
    **dict.fromkeys(("planner", "env", "env_fingerprint", "command", "sha256"), str),
    **dict.fromkeys(("settings", "machine"), dict),
    **dict.fromkeys(("losses", "validation"), list),
    **dict.fromkeys(_TIMES, (int, float)),
    "seed": int,
}
"""What the values of a manifest are in JSON."""

Tensors = Mapping[str, NDArray[Any]]

SHIPPED = Path(__file__).parents[1] / "weights"
"""Weights that come with the package."""


@dataclass(frozen=True)
class Manifest:
    """Where weights come from.

    Attributes:
        planner: name of the planner they are for.
        env: canonical id of the environment, for people.
        env_fingerprint: the domain, which decides: an environment's fingerprint or a family's.
        settings: how they were trained, for people; the network is rebuilt from the planner.
        data_s, train_s: seconds of making data and of training on it, data not included.
        losses: [share of the training, loss].
        validation: [share of the training, problems solved, problems].
        command: that makes these weights again.
        machine: where, and with which versions.
        sha256: of the weights' file.
    """

    planner: str
    env: str
    env_fingerprint: str
    settings: Mapping[str, Any]
    seed: int
    data_s: float
    train_s: float
    losses: list[list[float]]
    validation: list[list[float]]
    command: str
    machine: Mapping[str, Any] = field(default_factory=dict)
    sha256: str = ""
    format: int = FORMAT


def file_name(planner: str, domain: str) -> str:
    """Under which weights of a planner for a domain are found: an environment's fingerprint, or a
    family's."""
    return f"{planner}-{domain}.safetensors"


def cached_file(planner: str, domain: str) -> Path:
    """Where weights trained by this user belong."""
    return cache_folder() / "weights" / file_name(planner, domain)


def find(planner: str, domain: str) -> Path | None:
    """The shipped weights for a domain, else those in the user's cache, else None."""
    candidates = SHIPPED / file_name(planner, domain), cached_file(planner, domain)
    return next((file for file in candidates if file.is_file()), None)


def manifest_file(file: Path) -> Path:
    """Where the manifest of a file of weights is."""
    return file.with_suffix(".json") if file.suffix == ".safetensors" else Path(f"{file}.json")


def write(file: Path, tensors: Tensors, manifest: Manifest) -> None:
    """Writes weights and manifest, each whole or not at all. Ended at any moment, what is there
    is the old pair or the new one: the new manifest waits beside the old one while the weights
    are replaced, and `read` takes the one that is of the weights.

    Raises:
        InputError: they cannot be written there.
    """
    data = safetensors.numpy.save({k: np.ascontiguousarray(v) for k, v in tensors.items()})
    described = {**asdict(manifest), "sha256": hashlib.sha256(data).hexdigest()}
    with input_error_of(f"cannot write weights to {file}"):
        file.parent.mkdir(parents=True, exist_ok=True)
        waiting = _waiting(manifest_file(file))
        _replace(waiting, (json.dumps(described, indent=1) + "\n").encode())
        _replace(file, data)
        waiting.replace(manifest_file(file))


def link(target: Path, planner: str, domain: str) -> None:
    """Lets `find` find weights that were written elsewhere, as long as they stay there."""
    name = cached_file(planner, domain)
    name.parent.mkdir(parents=True, exist_ok=True)
    beside = manifest_file(target)
    # In the order of `write`, for the same reason.
    for there, here in (
        (beside, _waiting(manifest_file(name))),
        (target, name),
        (beside, manifest_file(name)),
    ):
        with atomic_write(here) as part:
            part.symlink_to(there.absolute())
    _waiting(manifest_file(name)).unlink()


def read(file: Path, planner: str, domain: str) -> tuple[dict[str, NDArray[Any]], Manifest]:
    """Weights for `planner` in a domain, see `LearnedPlanner.domain`.

    Raises:
        InputError: the file cannot be read, is damaged, or is for something else.
    """
    data, manifest = _pair(file)
    for what, ours, theirs in (
        ("planner", planner, manifest.planner),
        ("environment", domain, manifest.env_fingerprint),
    ):
        if ours != theirs:
            raise InputError(
                f"{file}: these weights are for {what} {theirs} ({manifest.env}), not for {ours}; "
                "train some with bench train"
            )
    if hashlib.sha256(data).hexdigest() != manifest.sha256:
        raise InputError(
            f"{file} is not the file that its manifest describes: copy both again, or train anew"
        )
    try:
        tensors = safetensors.numpy.load(data)
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{file} is not a file of weights: {error}") from error
    if not all(np.isfinite(a).all() for a in tensors.values() if a.dtype.kind == "f"):
        raise InputError(f"{file} holds NaN or infinite weights")
    return tensors, manifest


def digest(file: Path) -> str:
    """A short name for the content of a file of weights, whatever the file is called.

    Raises:
        InputError: it cannot be read.
    """
    return hashlib.sha256(_bytes(file, _MOST_BYTES)).hexdigest()[:16]


def _waiting(manifest: Path) -> Path:
    """Where a manifest is until the weights that it describes are in place."""
    return manifest.with_name(f"{manifest.name}.next")


def _pair(file: Path) -> tuple[bytes, Manifest]:
    """The content of a file of weights, and the manifest beside it: one that waits there if it is
    of this content and the other is not."""
    data = _bytes(file, _MOST_BYTES)
    of_data = hashlib.sha256(data).hexdigest()
    for candidate in _candidates(file):
        if candidate.is_file():
            manifest = _read_manifest(candidate)
            if manifest.sha256 == of_data:
                return data, manifest
    return data, _read_manifest(manifest_file(file))


def _candidates(file: Path) -> list[Path]:
    """Where a manifest of a file of weights may be; its own place once more at the end, as a writer
    may have put it there meanwhile."""
    beside = manifest_file(file)
    return [beside, _waiting(beside), _waiting(beside.resolve()), beside]


def is_described(file: Path) -> bool:
    """Whether a file has a manifest, as weights have."""
    return any(candidate.exists() for candidate in _candidates(file))


def _bytes(file: Path, most: int) -> bytes:
    with input_error_of(f"cannot read {file}"):
        if not file.is_file():
            raise InputError(f"no such file: {file}")
        size = file.stat().st_size
        if size > most:
            raise InputError(f"{file} has {size} bytes, which is too many for what it should be")
        return file.read_bytes()


def _read_manifest(file: Path) -> Manifest:
    try:
        described = json.loads(_bytes(file, _MOST_MANIFEST_BYTES))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file} is not a manifest: {error}") from error
    wanted = {f.name for f in fields(Manifest)}
    if not isinstance(described, dict) or set(described) != wanted:
        raise InputError(f"{file} is not a manifest of weights")
    form = described["format"]
    if form != FORMAT:
        raise InputError(f"{file} has format {brief(form)}, this program reads {FORMAT}")
    for key, types in _TYPES.items():
        if not isinstance(described[key], types):
            raise InputError(f"{file} is not a manifest of weights: {key} has the wrong type")
    for key in _TIMES:
        if not 0 <= described[key] <= _MOST_S:
            raise InputError(f"{file} is not a manifest of weights: {key} is no number of seconds")
    return Manifest(**described)


def _replace(file: Path, data: bytes) -> None:
    with atomic_write(file) as part:
        part.write_bytes(data)
