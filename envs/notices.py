"""What is said of a file or world that can be used, but not all of which is as it may seem."""

from __future__ import annotations

import logging
from functools import cache

logger = logging.getLogger(__name__)


@cache
def tell_once(message: str) -> None:
    """Logs a line, once in a process, however often the same world is made."""
    logger.info(message)
