"""Paths that were planned elsewhere, from files: reading, writing and replaying them."""
