"""The command line: arguments to calls, and what is printed."""

from bench.cli.app import main

__all__ = ["main"]
