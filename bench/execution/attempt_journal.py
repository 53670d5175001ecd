"""Attempts at which the harness itself came to its end: tried again once, and then passed over.

From the moment that a planner's answer is judged until its row is stored, a small file in the
run's folder names the attempt. One that is found when a run goes on tells of an answer that took
the harness down. While a planner plans there is none: whoever ends a run then does not mean the
planner.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

from bench.storage.store_file import in_words
from envs import InputError

_PREFIX = ".underway-"
_OFTEN = 2


class Underway:
    """Those of a folder.

    Args:
        folder: of a run.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @contextmanager
    def judging(self, *attempt: object) -> Iterator[None]:
        """About judging and storing an attempt, which is named by anything that is JSON data.

        Raises:
            InputError: the folder cannot be written to.
        """
        file = self._file(attempt)
        times = self._times(file)
        self._write(file, times + 1)
        try:
            yield
        except (KeyboardInterrupt, InputError):  # the user's doing, or the disk's
            self._write(file, times)
            raise
        self.forget(*attempt)

    def has_ended_runs(self, *attempt: object) -> bool:
        """Whether an attempt has been the harness's end too often."""
        return self._times(self._file(attempt)) >= _OFTEN

    def forget(self, *attempt: object) -> None:
        """After its row is stored."""
        self._file(attempt).unlink(missing_ok=True)

    def _file(self, attempt: tuple[object, ...]) -> Path:
        name = sha256(json.dumps(attempt).encode()).hexdigest()[:16]
        return self._folder / f"{_PREFIX}{name}"

    def _times(self, file: Path) -> int:
        with suppress(OSError, ValueError):
            return int(file.read_bytes())
        return 0

    def _write(self, file: Path, times: int) -> None:
        with in_words(file):
            if times:
                file.write_bytes(b"%d" % times)
            else:
                file.unlink(missing_ok=True)
