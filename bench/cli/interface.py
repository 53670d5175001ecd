"""The commands, with their arguments, options and help.

Nothing of the rest of the program is imported here, so that help and version come at once; each
command imports what it needs when it is carried out.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click

from bench import __version__
from bench.cli import options
from bench.cli.command_group import Command, Commands


@click.group(
    cls=Commands,
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, message="%(version)s")
def bench() -> None:
    """Benchmark of robot motion planners."""


def _command(name: str, does: str, short_help: str) -> Callable[[Callable[..., None]], Any]:
    """Declares a command, whose help is the function's docstring. What it gives when it is called
    are the arguments, by name, and as `does` where in `bench.cli` it is carried out."""

    def declared(function: Callable[..., None]) -> click.Command:
        made = click.command(name, cls=Command, short_help=short_help)(function)
        made.callback = lambda **given: SimpleNamespace(does=does, **given)
        bench.add_command(made)
        return made

    return declared


@_command("run", "commands:run", "measure planners and print a table")
@click.option(
    "--env",
    required=True,
    metavar="ENVS",
    shell_complete=options.ENVS,
    help="environments, as in c3d,c3d:scene=3,boxes=20",
)
@click.option(
    "--planners",
    default="all",
    metavar="PLANNERS",
    shell_complete=options.PLANNERS,
    help="planners, as in fmm,rrtstar:range=2; or all, or paper (default: all)",
)
@options.problems
@options.problem_file
@click.option(
    "--repeats", type=int, default=1, metavar="N", help="attempts at each problem (default: 1)"
)
@click.option(
    "--seed", type=int, default=0, metavar="S", help="of problems and planners (default: 0)"
)
@click.option("--time-limit", type=float, default=5.0, metavar="SECONDS", help="(default: 5)")
@click.option(
    "--stop",
    default="paper",
    metavar="RULE",
    help="when planners that improve their path stop: first, at the first solution; limit, at the "
    "time limit; match:PLANNER[:TOL], when no longer than (1+TOL) times PLANNER's path, TOL 0.05; "
    "paper, match:mpnet, or match:fmm where mpnet has no weights (default: paper)",
)
@click.option("--jobs", type=int, default=1, metavar="N", help="planners at a time (default: 1)")
@click.option(
    "--memory-limit",
    type=int,
    default=4096,
    metavar="MB",
    help="of each planner's process (default: 4096)",
)
@click.option(
    "--keep-invalid",
    is_flag=True,
    help="attempt problems, and count them, whose start or goal the judge refuses",
)
@click.option(
    "--simplify",
    type=float,
    default=0.0,
    metavar="SECONDS",
    help="simplify each valid path besides, by the same shortcuts and at most so long, for lengths "
    "that compare (default: 0)",
)
@options.planner_file
@options.metric_file
@options.device
@click.option("--no-train", is_flag=True, help="skip learned planners that have no weights")
@options.file("--out", metavar="DIR", help="(default: results/runs/ENV)")
@click.option("--force", is_flag=True, help="measure again what DIR holds")
@options.wide
def run() -> None:
    """Runs every planner on the same problems, each in its own process, judges every path, and
    prints a table. What DIR holds already is not measured again."""


@_command("train", "commands:train", "train a learned planner for an environment")
@options.env
@click.option("--planner", required=True, metavar="P", help="a learned planner, as in ntfields")
@click.option(
    "--minutes", type=float, metavar="M", help="how long (default: the planner's own steps)"
)
@click.option("--seed", type=int, default=0, metavar="S", help="(default: 0)")
@click.option(
    "--device", default="cpu", metavar="DEVICE", help="of PyTorch, cpu or cuda (default: cpu)"
)
@options.file("--out", metavar="FILE", help="of the weights (default: the user's cache)")
@options.planner_file
def train() -> None:
    """Trains a learned planner, or goes on where an interrupted training stopped. Runs find its
    weights afterwards, unless others are shipped."""


@_command("report", "commands:report", "tables of a run")
@click.argument("dirs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="DIR...")
@click.option(
    "--format",
    default="md,csv",
    metavar="FORMATS",
    help="of md,csv,latex,html,planner-arena (default: md,csv)",
)
@click.option(
    "--spread",
    type=click.Choice(["deviation", "variance"]),
    default="deviation",
    help="what stands after each mean (default: deviation)",
)
@options.metric_file
@options.file("--out", metavar="DIR", help="(default: the run's own)")
@options.wide
def report() -> None:
    """Writes reports of what was last run into each DIR, or one report of all into --out, and
    prints the tables."""


@_command("audit", "commands:audit", "how many of the paths that planners take for valid are not")
@click.argument("dirs", nargs=-1, type=click.Path(path_type=Path), metavar="[DIR...]")
@click.option(
    "--env",
    metavar="ENV,...",
    shell_complete=options.ENVS,
    help="environments to run --planners in first, in place of DIR...",
)
@click.option(
    "--planners",
    metavar="P,...",
    shell_complete=options.PLANNERS,
    help="with --env, as in 'rrtconnect,rrtconnect:validator=sampled,resolution=0.05|0.01'",
)
@options.problems
@click.option("--seed", type=int, default=0, metavar="S", help="with --env (default: 0)")
@click.option(
    "--time-limit", type=float, default=5.0, metavar="SECONDS", help="with --env (default: 5)"
)
@click.option("--jobs", type=int, default=1, metavar="N", help="with --env (default: 1)")
@options.file("--out", metavar="DIR", help="(default: the run's own)")
@options.wide
def audit() -> None:
    """Looks again at the paths of a run that planners claimed and the judge refused: how many, how
    deep in what, and over how much of the path. Prints a table by environment and planner, and
    writes audit.md, audit.csv, audit_paths.csv, audit.png and worst.png. With --env a run comes
    first, of first solutions."""


@_command("compare", "commands:compare", "compare two runs, or two planners of one")
@options.folder("a")
@click.argument("b", required=False, type=click.Path(path_type=Path), metavar="[B]")
@click.option(
    "--planners",
    default="all",
    metavar="P,Q",
    help="P of A against Q of B; or one name, in both (default: all that are in both)",
)
@options.metrics
@options.metric_file
@options.file("--out", metavar="FILE.csv", help="the table, unrounded")
@options.planner_file
@options.wide
def compare() -> None:
    """Compares planners on the problems that two runs, or two planners of one run, share: success
    and metrics, with tests and verdicts."""


@_command("check", "commands:check", "fail if a run is worse than a baseline")
@options.folder("dir")
@options.file("--baseline", metavar="FILE.csv", help="kept with the code", required=True)
@click.option("--update", is_flag=True, help="write the baseline from DIR, and check nothing")
@click.option(
    "--alpha",
    type=float,
    default=0.01,
    metavar="P",
    help="the probability of any false alarm in a check (default: 0.01)",
)
@click.option(
    "--ratios",
    metavar="NAMES",
    help="of metrics, as time,length,margin, by the reference's if one is named",
)
@click.option("--reference", metavar="PLANNER", help="of the same run, as in fmm")
@click.option(
    "--tolerance",
    type=float,
    default=0.1,
    metavar="SHARE",
    help="by how much ratios may get worse (default: 0.1)",
)
@options.metric_file
@options.file("--out", metavar="FILE.md", help="what is printed, as a file too")
@options.planner_file
@options.wide
def check() -> None:
    """Tests whether planners solve fewer problems than in a baseline, or do worse by what --ratios
    names, and says how small a fall it would notice. Exit code 1 for a regression, 3 if nothing
    compares."""


@_command("show", "commands:show", "draw an environment and paths")
@click.option("--env", required=True, metavar="ENV", shell_complete=options.ENVS)
@options.file("--paths", metavar="DIR", help="a folder that run wrote")
@click.option(
    "--planners",
    default="all",
    metavar="PLANNERS",
    shell_complete=options.PLANNERS,
    help="whose paths (default: all there are)",
)
@click.option("--problem", type=int, metavar="I", help="(default: the longest path's)")
@options.file("--out", metavar="FILE.png", help="the picture", required=True)
@options.planner_file
def show() -> None:
    """Draws an environment, and one problem with every planner's path from a run."""


@_command("field", "commands:field", "draw the time fields of planners")
@click.option("--env", required=True, metavar="ENV", shell_complete=options.ENVS)
@click.option(
    "--planners",
    default="fmm,ntfields,ief3d",
    metavar="PLANNERS",
    shell_complete=options.PLANNERS,
    help="(default: fmm,ntfields,ief3d)",
)
@click.option(
    "--source",
    type=options.Numbers(),
    metavar="X,Y,Z",
    help="of the times, and place of the slice (default: near a corner, where most is filled)",
)
@options.device
@click.option("--no-train", is_flag=True, help="refuse learned planners that have no weights")
@options.file("--out", metavar="FILE.png", help="the picture", required=True)
@options.planner_file
def field() -> None:
    """Draws predicted speed (colour) and arrival time from a source (lines) on a slice, a column a
    planner, with the relative error of the time against fast marching."""


@_command("paper", "commands:paper", "the paper's tables and figures beside ours")
@click.option("--only", metavar="NAME", help="of the experiments, as in c3d,gibson (default: all)")
@click.option("--quick", is_flag=True, help="fewer problems, and say so in every caption")
@options.file(
    "--out", metavar="DIR", help="(default: results/runs/paper, or results/runs/paper-quick)"
)
@options.wide
def paper() -> None:
    """Carries out the paper's experiments, or goes on where it stopped, and prints each table
    beside the paper's figures. DIR holds paper.md, its pictures, and every table as CSV."""


@_command("list", "listing:list_", "list planners, environments, metrics and robots")
@click.argument(
    "what", required=False, type=click.Choice(["planners", "envs", "metrics", "robots"])
)
@click.option("--json", is_flag=True, help="as JSON, with all that is known of each")
@options.planner_file
def list_() -> None:
    """Lists what is registered; without an argument planners and environments."""


@_command("judge", "commands:judge", "judge paths of a file")
@options.env
@options.file(
    "--paths",
    metavar="FILE",
    help="of paths: .csv, .json, .npz, or .txt as OMPL's printAsMatrix prints them",
    required=True,
)
@click.option(
    "--problems",
    type=int,
    metavar="N",
    help="of the environment, as in a run; FILE may name these (default: any that there are)",
)
@options.problem_file
@click.option(
    "--seed", type=int, metavar="S", help="of the problems, as in a run (default: FILE's own, or 0)"
)
@click.option("--json", is_flag=True, help="as JSON, with all that is known of each path")
@options.metric_file
@options.wide
def judge() -> None:
    """Judges each path of FILE, whatever program made it, and prints its verdict, where it first
    touches what, and all metrics that need no clock. A path that names no problem is judged from
    its own first waypoint to its own last. Exit code 1 if the judge refuses one, 3 if FILE has none
    to judge."""


@_command("paths", "commands:paths", "write a run's paths to a file")
@options.folder("dir")
@click.option("--planner", metavar="P", help="a planner of that run (default: the only one)")
@click.option(
    "--env",
    metavar="ENV",
    shell_complete=options.ENVS,
    help="an environment of that run (default: the only one)",
)
@click.option(
    "--repeat", type=int, default=0, metavar="R", help="which attempts, from 0 (default: 0)"
)
@options.file("--out", metavar="FILE", help=".csv, .json, .npz or .txt", required=True)
@options.planner_file
def paths() -> None:
    """Writes what a planner did in a run, with problems and times, to a file that judge reads, and
    that a run replays as the planner recorded:file=FILE."""


@_command("test-planner", "commands:test_planner", "check that a planner keeps to the contract")
@click.argument("planner", metavar="NAME|FILE.py:CLASS[:KEY=VALUE,...]")
@click.option(
    "--env",
    default="c3d",
    metavar="ENV",
    shell_complete=options.ENVS,
    help="an environment (default: c3d)",
)
@click.option(
    "--time-limit", type=float, default=2.0, metavar="SECONDS", help="a problem (default: 2)"
)
@options.planner_file
def test_planner() -> None:
    """Has a planner solve a few problems in processes of its own, and prints a line for each thing
    it must keep to. Exit code 1 if it does not."""


@_command("test-env", "commands:test_env", "check that an environment keeps to the contract")
@click.argument("env", metavar="NAME[:KEY=VALUE,...]", shell_complete=options.ENVS)
@click.option(
    "--seed", type=int, default=0, metavar="S", help="of configurations and problems (default: 0)"
)
def test_env() -> None:
    """Asks an environment for clearances, problems and its definition, compares the clearances with
    its collision model at random configurations, and prints a line for each thing it must keep to.
    Exit code 1 if it does not."""


@_command("problems", "problems:problems", "which problems can be solved as they are posed")
@click.option(
    "--env",
    required=True,
    metavar="ENVS",
    shell_complete=options.ENVS,
    help="environments, as in mbm-panda or c3d,arm6",
)
@options.problems
@options.problem_file
@click.option("--seed", type=int, default=0, metavar="S", help="of problems (default: 0)")
@options.file("--out", metavar="FILE", help="to write the problems to, for --problem-file")
@click.option("--json", is_flag=True, help="as JSON, an entry an environment")
@options.wide
def problems() -> None:
    """Has the judge look at the start and goal of every problem, and prints for each environment
    how many problems are valid as posed, and of the others why not: which joint is beyond its
    limits, or which links or obstacles touch, and how deep."""


@_command("replay", "commands:replay", "make one attempt of a run again")
@options.folder("dir")
@click.option("--planner", required=True, metavar="P", help="a planner of that run")
@click.option("--problem", type=int, required=True, metavar="I", help="the index of a problem")
@click.option(
    "--repeat", type=int, default=0, metavar="R", help="which attempt at it, from 0 (default: 0)"
)
@click.option(
    "--env",
    metavar="ENV",
    shell_complete=options.ENVS,
    help="an environment of that run (default: the only one)",
)
@options.planner_file
def replay() -> None:
    """Makes one attempt again from what a run's store holds, and says whether path and verdict are
    the same. Exit code 1 if they are not."""
