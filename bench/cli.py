"""The command line: arguments to calls."""

from __future__ import annotations

import argparse
import json
import logging
import re
import signal
import sys
import time
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NoReturn

import psutil

import envs
import planners
from bench.report import files, summary
from bench.runner import run
from bench.store import Store
from bench.suite import make_suite
from envs import InputError
from envs.errors import suggestion
from envs.registry import Registry

DONE, BAD_INPUT, NOTHING_MEASURED, INTERRUPTED = 0, 2, 3, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code."""
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr, force=True)
    try:
        chosen = _parse(arguments)
        chosen.started_s = _since_process_start() if arguments is None else 0.0
        code: int = chosen.command(chosen)
    except InputError as error:
        print(f"bench: error: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("bench: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED
    return code


def _since_process_start() -> float:
    return time.time() - psutil.Process().create_time()


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The arguments, with a suggestion for what is not among them."""
    chosen, unknown = _parser().parse_known_args(arguments)
    if unknown:
        options = re.findall(r"--[a-z-]+", chosen.parser.format_help())
        raise InputError(f"unknown argument {unknown[0]!r}; {suggestion(unknown[0], set(options))}")
    return chosen


class _Parser(argparse.ArgumentParser):
    """Reports a wrong argument in one line."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="bench", description="Benchmark of robot motion planners.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=metadata.version("plannerbench"))
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for add in (_add_run, _add_report, _add_show, _add_list):
        add(commands)
    return parser


def _add_run(commands: Any) -> None:
    parser = commands.add_parser(
        "run",
        allow_abbrev=False,
        help="measure planners and print a table",
        description="Runs every planner on the same problems, each in its own process, judges "
        "every path, and prints a table. What DIR holds already is not measured again.",
    )
    parser.set_defaults(command=_run, parser=parser)
    add = parser.add_argument
    add("--env", required=True, help="environments, as in c3d,c3d:scene=3,boxes=20")
    add(
        "--planners",
        default="all",
        help="planners, as in fmm,rrtstar:range=2; or all, or paper (default: all)",
    )
    add("--problems", type=int, default=50, metavar="N", help="an environment (default: 50)")
    add("--seed", type=int, default=0, metavar="S", help="of problems and planners (default: 0)")
    add("--time-limit", type=float, default=5.0, metavar="SECONDS", help="(default: 5)")
    add(
        "--stop",
        default="match:fmm",
        metavar="RULE",
        help="when planners that improve their path stop: first, at the first solution; limit, "
        "at the time limit; match:PLANNER[:TOL], when no longer than (1+TOL) times PLANNER's "
        "path, TOL 0.05 (default: match:fmm)",
    )
    add("--jobs", type=int, default=1, metavar="N", help="planners at a time (default: 1)")
    add(
        "--memory-limit",
        type=int,
        default=4096,
        metavar="MB",
        help="of each planner's process (default: 4096)",
    )
    add("--out", type=Path, metavar="DIR", help="(default: results/runs/ENV)")
    add("--force", action="store_true", help="measure again what DIR holds")


def _add_report(commands: Any) -> None:
    parser = commands.add_parser(
        "report",
        allow_abbrev=False,
        help="tables of a run",
        description="Writes the tables of what was last run into each DIR, and prints them.",
    )
    parser.set_defaults(command=_report, parser=parser)
    parser.add_argument("dirs", nargs="+", type=Path, metavar="DIR")
    parser.add_argument("--format", default="md,csv", help="of md,csv (default: both)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="(default: the run's own)")


def _add_show(commands: Any) -> None:
    parser = commands.add_parser(
        "show",
        allow_abbrev=False,
        help="draw an environment and paths",
        description="Draws an environment, and one problem with every planner's path from a run.",
    )
    parser.set_defaults(command=_show, parser=parser)
    parser.add_argument("--env", required=True)
    parser.add_argument("--paths", type=Path, metavar="DIR", help="a folder that run wrote")
    parser.add_argument("--planners", default="all", help="whose paths (default: all there are)")
    parser.add_argument("--problem", type=int, metavar="I", help="(default: the longest path's)")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.png")


def _add_list(commands: Any) -> None:
    parser = commands.add_parser(
        "list",
        allow_abbrev=False,
        help="list planners and environments",
        description="Lists what is registered.",
    )
    parser.set_defaults(command=_list, parser=parser)
    parser.add_argument("what", nargs="?", choices=("planners", "envs"))
    parser.add_argument("--json", action="store_true")


def _run(chosen: argparse.Namespace) -> int:
    suite = make_suite(
        env=chosen.env,
        planner=chosen.planners,
        problems=chosen.problems,
        seed=chosen.seed,
        time_limit_s=chosen.time_limit,
        stop=chosen.stop,
        jobs=chosen.jobs,
        memory_limit_mb=chosen.memory_limit,
    )
    folder: Path = chosen.out or Path("results/runs") / suite.arenas[0].entry.spec.id
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with Store(folder) as store:
        selection = suite.selection()
        store.put_selection(selection)
        try:
            run(suite, store, force=chosen.force, started_s=chosen.started_s)
        finally:
            records = files.selected_records(store, selection)
            text = files.write(folder, records, selection, files.FORMATS)
            files.write_manifest(folder, records, selection, store.sessions())
    print(text)
    print(f"{folder}: {', '.join(sorted(p.name for p in folder.iterdir()))}", file=sys.stderr)
    return DONE if summary.attempted(records) else NOTHING_MEASURED


def _report(chosen: argparse.Namespace) -> int:
    formats = [f for f in chosen.format.split(",") if f]
    for name in formats:
        if name not in files.FORMATS:
            raise InputError(f"--format: unknown {name!r}; choose from {', '.join(files.FORMATS)}")
    if chosen.out and len(chosen.dirs) > 1:
        raise InputError("--out takes one DIR at a time, or their tables would overwrite another")
    for folder in chosen.dirs:
        with Store(folder, create=False) as store:
            selection = store.selection()
            records = files.selected_records(store, selection)
        out: Path = chosen.out or folder
        out.mkdir(parents=True, exist_ok=True)
        print(files.write(out, records, selection, formats))
    return DONE


def _show(chosen: argparse.Namespace) -> int:
    from bench.report import scene  # matplotlib takes a second, which only this command needs

    world = envs.make(chosen.env)
    shown = None
    if chosen.paths is not None:
        with Store(chosen.paths, create=False) as store:
            records = files.selected_records(store, store.selection())
        if chosen.planners != "all":
            wanted = [entry.id for entry in planners.REGISTRY.entries(chosen.planners)]
            records = records[records["planner"].isin(wanted)]
        shown = scene.paths_of_problem(records, world.fingerprint, chosen.problem)
    scene.draw(world, shown, chosen.out)
    return DONE


def _list(chosen: argparse.Namespace) -> int:
    wanted: dict[str, Registry[Any]] = {"planners": planners.REGISTRY, "envs": envs.REGISTRY}
    if chosen.what:
        wanted = {chosen.what: wanted[chosen.what]}
    listed = {
        what: [
            {
                "id": spec.id,
                "description": spec.description,
                "version": spec.version,
                "aliases": list(spec.aliases),
                "groups": list(spec.groups),
            }
            for spec in registry.specs()
        ]
        for what, registry in wanted.items()
    }
    if chosen.json:
        print(json.dumps(listed, indent=2))
        return DONE
    for what, specs in listed.items():
        print(f"{what}:")
        for spec in specs:
            print(f"  {spec['id']:<18} {spec['description']}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
