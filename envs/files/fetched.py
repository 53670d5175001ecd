"""Files that are fetched once, checked by their SHA-256, and kept in the user's cache."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path

import pooch
from tqdm.auto import tqdm

from envs.errors import InputError

_LEAST_SHOWN = 2
"""Files of which a bar shows how many have come."""


def fetch(folder: Path, url: str, digests: Mapping[str, str], instead: str) -> None:
    """Fetches the files that a folder does not have, or has others of.

    Args:
        folder: which may not be there yet.
        url: of the folder that has them.
        digests: SHA-256 by the files' names, from the folder.
        instead: what a user without a network can do, for the message.

    Raises:
        InputError: one cannot be fetched, or is not what it should be.
    """
    pooch.get_logger().setLevel(logging.WARNING)  # else it reports every download
    store = pooch.create(folder, f"{url}/", registry=dict(digests), retry_if_failed=1)
    missing = [name for name in digests if not (folder / name).is_file()]
    bar = tqdm(missing, unit="file", disable=None if len(missing) >= _LEAST_SHOWN else True)
    with bar:
        for name in digests:
            try:
                store.fetch(name)
            except (OSError, ValueError) as error:  # no network; a file of other content
                reason = "checksum differs" if isinstance(error, ValueError) else _word(error)
                raise InputError(
                    f"{url}/{name} cannot be fetched ({reason}): put it at {folder / name}{instead}"
                ) from error
            bar.update(name in missing)


def _word(error: OSError) -> str:
    return error.strerror or type(error).__name__
