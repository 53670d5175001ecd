"""Where compiled code is kept between processes.

Numba notices that a function's own file has changed, but not that one it calls elsewhere has, or a
type that it is given: it would go on with what was compiled from both before. So code that was
compiled from other sources of this program is kept in another folder.
"""

from __future__ import annotations

import os
import shutil
import time
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import platformdirs

_PACKAGES = ("envs", "planners", "bench")
_KEPT_S = 30 * 86_400.0


def cache_folder() -> str:
    """The folder for code that is compiled from the sources as they are, in the user's cache, or in
    `NUMBA_CACHE_DIR`. It is made if missing, and others are removed that were not used for a month.
    "" where none can be made: Numba keeps it beside the sources then, as far as it may.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    parent = Path(chosen) if chosen else platformdirs.user_cache_path("plannerbench") / "compiled"
    folder = parent / _digest(Path(__file__).parents[1])
    with suppress(OSError):
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(parent)
        os.utime(folder)
        return str(folder)
    return ""


def _digest(root: Path) -> str:
    """Of all sources that have to do with compiling, of the packages below a folder."""
    digest = sha256()
    for file in sorted(file for name in _PACKAGES for file in (root / name).rglob("*.py")):
        text = file.read_bytes()
        if b"numba" in text or b"njit" in text or b"NamedTuple" in text:
            digest.update(str(file.relative_to(root)).encode() + b"\0" + text)
    return digest.hexdigest()[:16]


def _remove_unused(parent: Path) -> None:
    for folder in parent.iterdir():
        is_ours = len(folder.name) == 16 and folder.is_dir()
        if is_ours and time.time() - folder.stat().st_mtime > _KEPT_S:
            shutil.rmtree(folder, ignore_errors=True)
