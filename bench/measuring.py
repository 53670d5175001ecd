"""A run as users ask for one: measured, stored, and reported in its folder."""

from __future__ import annotations

from pathlib import Path

from bench import runner
from bench.folder_lock import locked
from bench.launch import COMMAND
from bench.report import files
from bench.report.recorded import RecordedRun
from bench.store import Store
from bench.suite import Suite


def measured(
    suite: Suite, folder: Path, *, force: bool = False, started_s: float = 0.0
) -> RecordedRun:
    """Measures what the folder's store does not hold yet, and writes its tables and manifest,
    also of what there is when interrupted. For the arguments see `runner.run`.

    Raises:
        InputError: the folder cannot be used, or another run uses it, or a planner's file has
            changed this program.
        KeyboardInterrupt: interrupted; whatever was finished is in the store.
    """
    COMMAND.check_program()  # planners and environments have been made meanwhile
    with locked(folder), Store(folder) as store:
        store.put_selection(suite.selection())
        try:
            runner.run(suite, store, force=force, started_s=started_s)
        except KeyboardInterrupt:
            _reported(store, folder)
            raise
        return _reported(store, folder)


def _reported(store: Store, folder: Path) -> RecordedRun:
    recorded = RecordedRun.of(store, folder)
    files.write(recorded, folder, files.OF_RUNS)
    files.write_manifest(recorded, folder)
    return recorded
