"""What can be made by name: specs, entries with arguments, and what others add."""

from envs.registry.registry import Entry, Registry
from envs.registry.spec import Spec

__all__ = ["Entry", "Registry", "Spec"]
