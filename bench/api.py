"""A run as users ask for one: measured, stored, and reported in its folder."""

from __future__ import annotations

from pathlib import Path

from bench.analysis.run_results import RunResults
from bench.execution import runner
from bench.execution.config import RunConfig
from bench.execution.launch import COMMAND
from bench.report import writers
from bench.storage.store import Store, locked


def measured(
    config: RunConfig, folder: Path, *, force: bool = False, started_s: float = 0.0
) -> RunResults:
    """Measures what the folder's store does not hold yet, and writes its tables and manifest,
    also of what there is when interrupted. For the arguments see `runner.run`.

    Raises:
        InputError: the folder cannot be used, or another run uses it, or a planner's file has
            changed this program.
        KeyboardInterrupt: interrupted; whatever was finished is in the store.
    """
    COMMAND.check_program()  # planners and environments have been made meanwhile
    with locked(folder), Store(folder) as store:
        store.put_selection(config.selection())
        try:
            runner.run(config, store, force=force, started_s=started_s)
        except KeyboardInterrupt:
            _reported(store, folder)
            raise
        return _reported(store, folder)


def _reported(store: Store, folder: Path) -> RunResults:
    recorded = RunResults.of(store, folder)
    writers.write(recorded, folder, writers.OF_RUNS)
    writers.write_manifest(recorded, folder)
    return recorded
