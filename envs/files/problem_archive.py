"""MotionBenchMaker's archives: for each set of a robot's problems, scenes and requests in YAML."""

from __future__ import annotations

import hashlib
import re
import tarfile
import zipfile
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from envs.errors import InputError, UnknownNameError, input_error_of
from envs.files.git_lfs import check_file_is_no_pointer
from envs.files.paths import atomic_write, cache_folder

_MEMBER = re.compile(r"problems/(?P<set>\w+)/(?P<kind>scene|request)(?P<number>\d{4})\.yaml")

_MOST_BYTES = 2**20
"""Of a scene or a request, of which none has a tenth."""


class ProblemFiles:
    """The files of one set.

    Args:
        texts: by kind, "scene" or "request", and number.

    Attributes:
        numbers: of its requests, in ascending order.
        digest: of all of it.
    """

    def __init__(self, texts: dict[tuple[str, int], bytes]) -> None:
        self._texts = texts
        self.numbers = sorted(number for kind, number in texts if kind == "request")
        digest = hashlib.sha256()
        for (kind, number), text in sorted(texts.items()):
            digest.update(f"{kind} {number} {len(text)}\n".encode() + text)
        self.digest = digest.hexdigest()

    def text(self, kind: str, number: int) -> bytes:
        """Of a scene or a request.

        Raises:
            InputError: there is none of that number.
        """
        if (kind, number) not in self._texts:
            raise InputError(f"there is no {kind}{number:04d}.yaml")
        return self._texts[kind, number]


def read_problem_files(archive: Path, name: str) -> ProblemFiles:
    """The files of a set, the folder `name` of an archive (`problems.tar.bz2`). They are kept in
    the user's cache, as unpacking an archive takes seconds.

    Raises:
        InputError: the archive cannot be read, or has no such set.
    """
    check_file_is_no_pointer(archive)
    with input_error_of(f"{archive} cannot be read"):
        digest = hashlib.sha256(archive.read_bytes()).hexdigest()[:16]
    return _read(archive, digest, name)


@lru_cache(maxsize=4)
def _read(archive: Path, digest: str, name: str) -> ProblemFiles:
    kept = cache_folder() / "problems" / f"{digest}-{name}.zip"
    with suppress(OSError, zipfile.BadZipFile, KeyError, ValueError):
        return ProblemFiles(_unpacked(kept))
    texts = _of_archive(archive, name)
    with suppress(OSError):  # where nothing can be kept, it is unpacked each time
        kept.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(kept) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as zipped:
            for (kind, number), text in texts.items():
                zipped.writestr(f"{kind} {number}", text)
    return ProblemFiles(texts)


def _unpacked(kept: Path) -> dict[tuple[str, int], bytes]:
    found = {}
    with zipfile.ZipFile(kept) as zipped:
        for member in zipped.namelist():
            kind, number = member.split(" ")
            found[kind, int(number)] = zipped.read(member)
    return found


def _of_archive(archive: Path, name: str) -> dict[tuple[str, int], bytes]:
    texts, sets = {}, set()
    try:
        with tarfile.open(archive) as opened:
            for member in opened:
                match = _MEMBER.fullmatch(member.name)
                if match is None or not member.isfile():
                    continue
                sets.add(match["set"])
                if match["set"] == name:
                    _check_size(archive, member)
                    read = opened.extractfile(member)
                    assert read is not None, "it is a file"
                    texts[match["kind"], int(match["number"])] = read.read()
    except (tarfile.TarError, OSError, EOFError) as error:
        raise InputError(f"{archive} is no archive of problems, or is damaged: {error}") from error
    if name not in sets:
        raise UnknownNameError(f"set of {archive}", name, sorted(sets))
    return texts


def _check_size(archive: Path, member: tarfile.TarInfo) -> None:
    if member.size > _MOST_BYTES:
        raise InputError(
            f"{archive}: {member.name} has {member.size} bytes; at most {_MOST_BYTES} are read"
        )
