"""Weights of learned planners on disk: numbers without code, and a manifest that says whose.

`NAME.safetensors` holds the numbers, `NAME.json` beside it the manifest. Nothing in either is
executed on reading, and both are checked before they are used.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
import safetensors.numpy
from numpy.typing import NDArray
from safetensors import SafetensorError

from envs import InputError
from envs.errors import brief
from envs.whole_file import whole_file

FORMAT = 1
_MOST_BYTES = 64 * 2**20  # of weights; those of this project have under two MB
_MOST_MANIFEST_BYTES = 2**20
_MOST_S = 1e9  # of data and of training

_READINGS = 2  # weights and manifest may be replaced between reading one and the other

_DIGIT = "[0-9a-f]"
_ANY_DIGEST = 16 * _DIGIT  # the part of it that is in names

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

SHIPPED = Path(__file__).parent / "weights"
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


def cache_folder() -> Path:
    """Where what is made for this user is kept; `XDG_CACHE_HOME` is honoured."""
    return Path(platformdirs.user_cache_dir("plannerbench"))


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
    """Writes weights and manifest, both or neither: the manifest is made ready under a name that
    has the weights' digest before they are put in place, and is found there until it follows.

    Raises:
        InputError: they cannot be written there.
    """
    data = safetensors.numpy.save({k: np.ascontiguousarray(v) for k, v in tensors.items()})
    digest = hashlib.sha256(data).hexdigest()
    described = {**asdict(manifest), "sha256": digest}
    ready = _ready(file, digest)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        _replace(ready, (json.dumps(described, indent=1) + "\n").encode())
        _replace(file, data)
        ready.replace(manifest_file(file))
        for left in file.parent.glob(f".{escape(manifest_file(file).name)}.{_ANY_DIGEST}"):
            left.unlink()  # of a writer that was stopped
    except OSError as error:
        raise InputError(f"cannot write weights to {file}: {error}") from error


def link(target: Path, planner: str, domain: str) -> None:
    """Lets `find` find weights that were written elsewhere, as long as they stay there."""
    name = cached_file(planner, domain)
    name.parent.mkdir(parents=True, exist_ok=True)
    for there, here in (
        (target, name),
        (manifest_file(target), manifest_file(name)),
    ):
        with whole_file(here) as part:
            part.symlink_to(there.absolute())


def is_described(file: Path) -> bool:
    """Whether a file has a manifest, as weights have."""
    return manifest_file(file).exists() or any(
        file.parent.glob(f".{escape(manifest_file(file).name)}.{_ANY_DIGEST}")
    )


def read(file: Path, planner: str, domain: str) -> tuple[dict[str, NDArray[Any]], Manifest]:
    """Weights for `planner` in a domain, see `planners.learned.LearnedPlanner.domain`.

    Raises:
        InputError: the file cannot be read, is damaged, or is for something else.
    """
    for _ in range(_READINGS):
        data = _bytes(file, _MOST_BYTES)
        digest = hashlib.sha256(data).hexdigest()
        manifest = _manifest_of(file, digest)
        if manifest.sha256 == digest:
            break
    for what, ours, theirs in (
        ("planner", planner, manifest.planner),
        ("environment", domain, manifest.env_fingerprint),
    ):
        if ours != theirs:
            raise InputError(
                f"{file}: these weights are for {what} {theirs} ({manifest.env}), not for {ours}; "
                "train some with bench train"
            )
    if digest != manifest.sha256:
        raise InputError(f"{file} is not the file that its manifest describes: copy both again")
    try:
        tensors = safetensors.numpy.load(data)
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{file} is not a file of weights: {error}") from error
    if not all(np.isfinite(a).all() for a in tensors.values() if a.dtype.kind == "f"):
        raise InputError(f"{file} holds NaN or infinite weights")
    return tensors, manifest


def _ready(file: Path, digest: str) -> Path:
    """Where a manifest is before weights of that digest are."""
    beside = manifest_file(file)
    return beside.with_name(f".{beside.name}.{digest[: len(_ANY_DIGEST) // len(_DIGIT)]}")


def _manifest_of(file: Path, digest: str) -> Manifest:
    """The manifest of a file with content of that digest; if none has it, the one beside it."""
    target = file.resolve()  # of a link that was set before the manifest's
    for other in (_ready(file, digest), _ready(target, digest), manifest_file(target)):
        if other.is_file() and (manifest := _read_manifest(other)).sha256 == digest:
            return manifest
    return _read_manifest(manifest_file(file))


def _bytes(file: Path, most: int) -> bytes:
    try:
        if not file.is_file():
            raise InputError(f"no such file: {file}")
        size = file.stat().st_size
        if size > most:
            raise InputError(f"{file} has {size} bytes, which is too many for what it should be")
        return file.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {file}: {error}") from error


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
    with whole_file(file) as part:
        part.write_bytes(data)
