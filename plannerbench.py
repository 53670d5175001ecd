"""The command's way in, outside of the packages: their names, `bench` and `envs`, are also those of
other distributions (frappe-bench, envs), which may have taken their place.
"""

from __future__ import annotations

import sys

_OURS = "plannerbench"
_PACKAGES = ("bench", "envs", "planners")


def main() -> int:
    """Runs the command line and gives the exit code."""
    try:
        from bench.cli import main as run

        return run()
    except (ImportError, AttributeError):
        said = _clash()
        if not said:
            raise
        print(f"bench: error: {said}", file=sys.stderr)  # noqa: T201  there is nothing else to use
        return 2


def _clash() -> str:
    """Whose package stands in the place of one of ours; empty if none does."""
    from importlib.metadata import packages_distributions
    from importlib.util import find_spec
    from pathlib import Path

    owners = packages_distributions()
    for name in _PACKAGES:
        others = sorted({*owners.get(name, ())} - {_OURS})
        if others:
            return (
                f"the package {name!r} is also that of {', '.join(others)}, which is installed "
                f"here too; install {_OURS} into an environment of its own"
            )
        found = find_spec(name)
        where = Path(found.origin).parents[1] if found and found.origin else None
        if where is not None and where != Path(__file__).parent:
            return f"{where / name} stands in the place of {_OURS}'s package {name!r}; rename it"
    return ""
