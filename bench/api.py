"""The front door in Python: what the command line does, as calls that give data frames."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from bench.analysis.audit import Audit, audit
from bench.analysis.run_results import RunResults
from bench.execution import runner
from bench.execution.config import CPU, RunConfig, make_run_config
from bench.execution.launch import COMMAND
from bench.execution.measurement import judged_path
from bench.execution.planner_host import hosting
from bench.execution.stop_rule import PAPER
from bench.judging import user_metrics
from bench.judging.judge import Judge, Judgement
from bench.judging.metric import Metric
from bench.report import markdown, path_file, writers
from bench.storage.record import decode_path
from bench.storage.store import Store, locked
from envs import REGISTRY, Environment, Problem
from planners import user_plugins

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Names = str | Iterable[str]
"""Names with commas between, as on the command line, or several of them."""


class Run:
    """What was measured, as data frames, reports and plots. `bench.run` and `bench.load` make it.

    In a notebook it shows itself as the tables that `bench run` prints.

    Attributes:
        results: `RunResults`, what all reports are made of.
    """

    def __init__(self, results: RunResults) -> None:
        self.results = results

    @property
    def folder(self) -> Path:
        """The folder that it is stored in, which `bench report`, `compare` and `check` take."""
        return self.results.folders[0]

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """What verified solutions are measured by, in the order of the tables."""
        return self.results.metrics

    @cached_property
    def attempts(self) -> pd.DataFrame:
        """A row for each attempt, whatever became of it, with the columns of
        `bench.storage.record.Record` but for the path, one for each metric, and two for what was
        planned elsewhere (`planned_elsewhere`, `claimed_solve_s`): among others `env`,
        `planner`, `problem` (its index), `outcome` ("VALID" is a verified success within the time
        limit), `solve_s` (planning time in seconds), `length` (in the environment's unit),
        `safety_margin` (in workspace units) and `error`."""
        attempts: pd.DataFrame = self.results.records.drop(columns=["path", "metrics"])
        return attempts

    @cached_property
    def summary(self) -> pd.DataFrame:
        """A row for each environment and planner, with the columns of `summary.csv`; see
        `bench.analysis.summary.summarise`."""
        return self.results.summary

    @cached_property
    def paths(self) -> pd.DataFrame:
        """A row for each attempt that gave a path, with `env`, `planner`, `problem`, `outcome` and
        `path`, waypoints as a float64 array (k, d) in the environment's unit."""
        given = self.results.records.dropna(subset="path")
        chosen = given[["env", "planner", "problem", "outcome"]].reset_index(drop=True)
        paths: pd.DataFrame = chosen.assign(path=[decode_path(path) for path in given["path"]])
        return paths

    def audit(self) -> Audit:
        """How many of the paths that planners claimed the judge refused for contact, how deep and
        over how much of the path: `bench audit`.

        Returns:
            `Audit`, with the frames `summary` and `refused`.

        Raises:
            InputError: an environment is not what it was, or no planner claimed anything.
        """
        return audit(self.results)

    def write_paths(
        self,
        file: str | Path,
        planner: str | None = None,
        env: str | None = None,
        repeat: int = 0,
    ) -> int:
        """Writes one planner's paths in one environment to a file that `bench.judge_file` and the
        planner `recorded` read.

        Args:
            file: its name ends in .csv, .json, .npz or .txt, which is the format.
            planner, env: whose; either may be left out where the run has only one.
            repeat: int, which of the attempts at each problem, from 0.

        Returns:
            How many attempts (int) there are in it, those without a path included.

        Raises:
            InputError: the run has no such attempts, or the file cannot be written.
        """
        return path_file.write(self.results, Path(file), planner, env, repeat)

    def report(self, format: str = "md", out: str | Path | None = None) -> Path:
        """Writes a report.

        Args:
            format: "md", "csv", "latex", "html" or "planner-arena".
            out: the folder (by default the run's own).

        Returns:
            The file.

        Raises:
            InputError: there is no such format, or the folder cannot be written to.
        """
        [name] = writers.chosen_formats(format)
        folder = self.folder if out is None else Path(out)
        writers.write(self.results, folder, [name])
        return folder / writers.FORMATS[name].file

    def plot_success(self, env: str | None = None, ax: Axes | None = None) -> Axes:
        """Draws the share of problems solved over planning time, a step a solution.

        Args:
            env: whose problems; may be left out where there is only one environment.
            ax: Matplotlib's axes to draw into, by default new ones.

        Returns:
            The axes.

        Raises:
            InputError: the run has no such environment, or several to choose from.
        """
        from bench.report import plots  # Matplotlib takes a second

        return plots.success(self.results, env, ax)

    def plot_anytime(
        self, env: str | None = None, problem: int | None = None, ax: Axes | None = None
    ) -> Axes:
        """Draws the best length over planning time of planners that go on improving: the median
        over problems, of several attempts at a problem (`repeats`) that of their medians, with its
        95 % interval, which assumes no distribution. What is not solved counts as infinitely long.
        A dot stands where half of the attempts had their first solution.

        Args:
            env, ax: as in `plot_success`.
            problem: the index of one problem, whose attempts alone are drawn then.

        Returns:
            The axes.

        Raises:
            InputError: there is no such problem, or see `plot_success`.
        """
        from bench.report import plots

        return plots.costs(self.results, env, problem, ax)

    def plot_metric(self, metric: str, env: str | None = None, ax: Axes | None = None) -> Axes:
        """Draws how a number is distributed over each planner's verified successes: a box from the
        first to the third quartile with the median, and whiskers out to 1.5 times that.

        Args:
            metric: its name, as "time_s", "length" or "safety_margin"; `Run.metrics` has all.
            env, ax: as in `plot_success`.

        Returns:
            The axes.

        Raises:
            InputError: there is no such metric, or see `plot_success`.
        """
        from bench.report import plots

        return plots.metric(self.results, metric, env, ax)

    def _repr_markdown_(self) -> str:
        return markdown.text(self.results)

    def __repr__(self) -> str:
        planners = ", ".join(dict.fromkeys(name for _, name in self.results.order))
        envs = ", ".join(dict.fromkeys(name for name, _ in self.results.order))
        return f"<Run of {planners} in {envs}: {len(self.results.records)} attempts, {self.folder}>"


def run(
    env: Names,
    planners: Names = "all",
    *,
    problems: int | None = None,
    repeats: int = 1,
    seed: int = 0,
    time_limit: float = 5.0,
    stop: str = PAPER,
    jobs: int = 1,
    memory_limit: int = 4096,
    problem_file: str | Path | None = None,
    planner_file: Iterable[str | Path] = (),
    metric_file: Iterable[str | Path] = (),
    device: str = CPU,
    no_train: bool = False,
    keep_invalid: bool = False,
    simplify: float = 0.0,
    out: str | Path | None = None,
    force: bool = False,
) -> Run:
    """Runs every planner on the same problems, each in its own process, has every path judged, and
    stores each attempt. What the folder holds already is not measured again: `bench run`.

    Args:
        env: environments, as in "c3d,c3d:scene=3,boxes=20" or ["c3d", "arm4"].
        planners: planners or groups of them, as in "fmm,rrtstar:range=2".
        problems: int, how many an environment; by default 50, of sets of problems all.
        repeats: int, how often each planner attempts each of them, with another seed each time.
        seed: int from 0, of problems, planners and their order.
        time_limit: float, seconds a problem.
        stop: when planners that improve their path stop: "first", "limit",
            "match:PLANNER[:TOLERANCE]" or "paper".
        jobs: int, planners at a time, at most as many as there are physical cores.
        memory_limit: int, MB, of each planner's process.
        problem_file: file of problems (.csv, .json, .yaml), in place of drawn ones.
        planner_file: files of Python with planners of your own.
        metric_file: files of Python with metrics of your own.
        device: of PyTorch, "cpu" or "cuda", for learned planners.
        no_train: bool, whether learned planners without weights are left out instead of trained.
        keep_invalid: bool, whether problems whose start or goal the judge refuses are attempted and
            counted all the same.
        simplify: float, seconds for which each valid path is simplified, at most, for the metrics
            `simplified_length` and `simplify_s`; 0 for not at all.
        out: folder to store in (by default results/runs/ENV).
        force: bool, whether to measure again what it holds.

    Returns:
        `Run`.

    Raises:
        InputError: something is unknown or out of range; nothing has been measured then.
        KeyboardInterrupt: interrupted; whatever was finished is in the folder.

    Example:
        >>> import bench
        >>> run = bench.run("c3d", "rrtconnect", problems=20, stop="first")  # doctest: +SKIP
        >>> run.summary[["planner", "success_rate"]]  # doctest: +SKIP
    """
    with (
        COMMAND.begun(),
        hosting(),
        user_plugins.registered([Path(file) for file in planner_file]),
        user_metrics.registered([Path(file) for file in metric_file]),
    ):
        COMMAND.check_program()
        config = make_run_config(
            env=_joined(env),
            planner=_joined(planners),
            problems=problems,
            repeats=repeats,
            seed=seed,
            time_limit_s=time_limit,
            stop=stop,
            jobs=jobs,
            memory_limit_mb=memory_limit,
            train=not no_train,
            device=device,
            keep_invalid=keep_invalid,
            simplify_s=simplify,
            problem_file=None if problem_file is None else Path(problem_file),
        )
        folder = Path("results/runs") / config.problem_sets[0].entry.spec.id
        return Run(carry_out(config, folder if out is None else Path(out), force=force))


def _joined(names: Names) -> str:
    return names if isinstance(names, str) else ",".join(names)


def load(folder: str | Path) -> Run:
    """What was last asked for in a folder that `bench run` wrote. Metrics that the run had from a
    file are there by their names.

    Raises:
        InputError: it holds no run.
    """
    return Run(RunResults.read(Path(folder)))


def judge(env: str | Environment, problem: Problem, path: Any) -> Judgement:
    """The judge's verdict on a path, by certified continuous collision checking.

    Args:
        env: the environment or its name, as in "c3d:scene=3".
        problem: `envs.Problem`, whose start and goal the path must join.
        path: waypoints (k, d) in the environment's unit, as any array-like, or None.

    Returns:
        `Judgement`: `verdict`, `reason`, `length`; of a valid path `safety_margin` and `metrics`,
        the value of each by name, None of those that need a planner's attempt; of one that
        collides its first `contact`, see `bench.judging.contact.Contact`.

    Raises:
        InputError: there is no such environment.

    Example:
        >>> import bench, envs
        >>> [problem] = envs.make("c3d").sample_problems(1, seed=0)
        >>> judgement = bench.judge("c3d", problem, [problem.start, problem.goal])
        >>> judgement.verdict.value
        'COLLISION'
        >>> judgement.contact.between
        ('the robot', 'obstacle 10 (a box)')
    """
    of_env = Judge(REGISTRY.make(env) if isinstance(env, str) else env)
    return of_env.with_contact(judged_path(of_env, problem, path), problem, path)


def carry_out(
    config: RunConfig, folder: Path, *, force: bool = False, started_s: float = 0.0
) -> RunResults:
    """Measures what the folder's store does not hold yet, and writes its tables and manifest,
    also of what there is when interrupted. For the arguments see `runner.run`.

    Raises:
        InputError: the folder cannot be used, or another run uses it, or a package with
            environments has changed this program.
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
    results = RunResults.of(store, folder)
    writers.write(results, folder, writers.OF_RUNS)
    writers.write_manifest(results, folder)
    return results
