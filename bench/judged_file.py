"""The judge's word on the paths of a file, and the numbers of those that are valid."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import envs
from bench.execution.measurement import judged_path
from bench.execution.problem_choice import ProblemChoice
from bench.judging.judge import ENDPOINT_TOLERANCE, Judge, Judgement
from bench.judging.metric import Metric
from bench.judging.metrics import REGISTERED
from bench.report import formatting, markdown
from bench.storage.record import OF_ANY_PATH, Verdict
from envs import Environment, InputError, Problem
from envs.problem import Array
from planners import Status
from planners.recorded.path_file import PathFile, RecordedPath, check_fits, read

_NO_PROBLEM = (
    "Where no problem is named, a path is judged from its own first waypoint to its own last, so "
    "that its verdict cannot be WRONG_ENDPOINT."
)


_WRONG_ENDS = (
    f"WRONG_ENDPOINT: the ends of a path must be within {ENDPOINT_TOLERANCE:g} of the problem's "
    "start and goal. Numbers that were printed with few digits, as C++ does, are further off; "
    "another seed or index is another problem."
)


@dataclass(frozen=True)
class JudgedPath:
    """A path of a file.

    Attributes:
        recorded: what the file says.
        judgement: the judge's, with the first contact of one that collides; None where the file
            has no path and claims none.
    """

    recorded: RecordedPath
    judgement: Judgement | None


@dataclass(frozen=True)
class JudgedFile:
    """All paths of a file, judged in an environment.

    Attributes:
        file: where they are from.
        env: the environment's id.
        fingerprint: the environment's.
        seed: of the problems.
        paths: in the order of the file.
        units: the environment's.
    """

    file: Path
    env: str
    fingerprint: str
    seed: int
    paths: tuple[JudgedPath, ...]
    units: Mapping[str, str]

    @property
    def judgements(self) -> list[Judgement]:
        """Of all that was judged."""
        return [path.judgement for path in self.paths if path.judgement is not None]

    @property
    def all_valid(self) -> bool:
        """Whether the judge refuses none."""
        return all(found.verdict is Verdict.VALID for found in self.judgements)

    @property
    def metrics(self) -> list[Metric]:
        """Those that need no clock and have a value here."""
        values = [item for found in self.judgements for item in _values(found).items()]
        known = {name for name, value in values if value is not None}
        return [metric for metric in REGISTERED if not metric.timed and metric.name in known]

    @property
    def text(self) -> str:
        """A table of all paths, and below it a line for each that is refused."""
        return "\n\n".join(filter(None, self._parts())) + "\n"

    def _parts(self) -> Iterator[str]:
        counts = Counter(found.verdict.value for found in self.judgements)
        told = ", ".join(f"{name} {count}" for name, count in counts.items()) or "none judged"
        named = any(path.recorded.problem is not None for path in self.paths)
        problems = f", problems of seed {self.seed}" if named else ""
        yield f"{self.file} in {self.env}{problems}: {told}."
        yield markdown.table([self._row(path) for path in self.paths])
        refused = [path for path in self.paths if _is_refused(path.judgement)]
        yield "\n".join(f"- {_refusal(path)}" for path in refused)
        if any(path.recorded.problem is None for path in self.paths):
            yield _NO_PROBLEM
        if Verdict.WRONG_ENDPOINT.value in counts:
            yield _WRONG_ENDS

    def _row(self, path: JudgedPath) -> dict[str, str]:
        found, problem = path.judgement, path.recorded.problem
        values = {} if found is None else _values(found)
        numbers = {
            metric.heading([self.units]): _number(values.get(metric.name), metric.digits)
            for metric in self.metrics
        }
        return {
            "path": path.recorded.place,
            "problem": formatting.NONE if problem is None else str(problem),
            "verdict": path.recorded.status.value if found is None else found.verdict.value,
            **numbers,
        }

    @property
    def data(self) -> dict[str, Any]:
        """The same as JSON data, unrounded; None for what is endless, as JSON has no word for
        it."""
        return {
            "file": str(self.file),
            "env": self.env,
            "environment": self.fingerprint,
            "seed": self.seed,
            "units": dict(self.units),
            "paths": [_data(path) for path in self.paths],
        }


def _values(judgement: Judgement) -> dict[str, float | None]:
    """By the metrics' names: of a valid path all, of others what means something of it, too."""
    known = {name: getattr(judgement, name) for name in OF_ANY_PATH}
    return {**known, **judgement.metrics}


def _number(value: float | None, digits: int) -> str:
    return formatting.NONE if value is None else formatting.number(value, digits)


def _is_refused(judgement: Judgement | None) -> bool:
    return judgement is not None and judgement.verdict is not Verdict.VALID


def _refusal(path: JudgedPath) -> str:
    found, recorded = path.judgement, path.recorded
    assert found is not None
    contact = found.contact
    problem = "" if recorded.problem is None else f", problem {recorded.problem}"
    where = "" if contact is None else f"; the configuration is {_told(contact.configuration)}"
    return f"{recorded.place}{problem}: {found.verdict.value}: {found.reason}{where}."


def _told(q: Array) -> str:
    return f"({', '.join(f'{value:.6g}' for value in q)})"


def _data(path: JudgedPath) -> dict[str, Any]:
    recorded, found = path.recorded, path.judgement
    said = {
        "place": recorded.place,
        "problem": recorded.problem,
        "status": recorded.status.value,
        "claimed_solve_s": recorded.solve_s,
    }
    if found is None:
        return {**said, "verdict": None, "reason": recorded.failure, "metrics": {}, "contact": None}
    timed = {metric.name for metric in REGISTERED if metric.timed}
    values = {name: value for name, value in _values(found).items() if name not in timed}
    contact = found.contact
    return {
        **said,
        "verdict": found.verdict.value,
        "reason": found.reason,
        "metrics": {
            name: value if math.isfinite(value) else None
            for name, value in values.items()
            if value is not None
        },
        "contact": None
        if contact is None
        else {
            "configuration": contact.configuration.tolist(),
            "share": contact.share,
            "waypoint": contact.waypoint,
            "between": contact.between,
            "distance": contact.distance,
            "text": contact.text,
        },
    }


def judge_file(
    env: str,
    file: str | Path,
    *,
    problems: int | None = None,
    seed: int | None = None,
    problem_file: str | Path | None = None,
) -> JudgedFile:
    """The judge's verdict on each path of a file, where the first contact of those that collide is,
    and the metrics of those that are valid. It is the judge of runs, with a model of its own.

    Args:
        env: the environment's name, as in "c3d:scene=3".
        file: of paths: .csv, .json, .npz, or .txt as OMPL's printAsMatrix prints them; the page on
            other programs' paths says what is in them.
        problems: int, how many problems there are, whose indices the file may name: those of a run
            with as many. By default any that there are.
        seed: int, of the problems, as of a run; by default the file's own, or 0.
        problem_file: of problems, as of a run, in place of drawn ones.

    Returns:
        `JudgedFile`, with `paths`, `text` and `data`.

    Raises:
        InputError: a file cannot be read, is malformed, is for another environment or other
            problems, or names a problem that there is not; or problems have scenes of their own and
            it names none.

    Example:
        >>> import bench
        >>> bench.judge_file("c3d", "paths.json").all_valid  # doctest: +SKIP
        True
    """
    entry, source = envs.REGISTRY.entry(env), Path(file)
    said = read(source)
    world = entry.make()
    check_fits(said, world, source)
    posed = None if problem_file is None else Path(problem_file)
    choice = _choice(said, source, problems, seed, posed)
    _check_problems_named(said, world, entry.id, source)
    known = _problems(said, world, choice, source)
    judge = Judge(world)
    found = tuple(_judged(judge, path, known) for path in said.paths)
    return JudgedFile(source, entry.id, world.fingerprint, choice.seed, found, world.units)


def _choice(
    said: PathFile, file: Path, count: int | None, seed: int | None, problem_file: Path | None
) -> ProblemChoice:
    if seed is None:
        seed = 0 if problem_file is not None or said.seed is None else said.seed
    choice = ProblemChoice.checked(count, seed, problem_file)
    if said.seed not in (None, choice.seed):
        asked = f"--seed {seed}" if problem_file is None else f"--problem-file {problem_file}"
        raise InputError(
            f"{asked}: {file} is for other problems, those of seed {said.seed}; give what the run "
            "was given"
        )
    return choice


def _check_problems_named(said: PathFile, env: Environment, id: str, file: Path) -> None:
    for path in said.paths:
        if path.waypoints is None and path.problem is None:
            raise InputError(f"{file}: {path.place} has neither a path nor a problem")
        if env.scenes_differ and path.problem is None:
            raise InputError(
                f"{file}: {path.place} does not say for which problem it is, and in {id} each "
                "problem has a scene of its own; give each path the index of its problem"
            )


_MOST_PROBLEMS = 1_000_000


def _problems(
    said: PathFile, env: Environment, choice: ProblemChoice, file: Path
) -> Mapping[int, Problem]:
    """The problems that a file names, by their indices, as a run has them."""
    given = None if choice.given is None else len(choice.given.posed)
    most = min(n for n in (choice.count, given, env.problem_count, _MOST_PROBLEMS) if n is not None)
    named = {path.problem: path for path in said.paths if path.problem is not None}
    for index, path in named.items():
        if index >= most:
            raise InputError(
                f"{file}: {path.place}: there is no problem {index} among {most}, whose indices "
                "begin at 0"
            )
    return dict(zip(named, choice.at(env, list(named)), strict=True)) if named else {}


def _judged(judge: Judge, path: RecordedPath, problems: Mapping[int, Problem]) -> JudgedPath:
    waypoints = path.waypoints
    if waypoints is None and path.status is not Status.EXACT_SOLUTION:
        return JudgedPath(path, None)
    if path.problem is not None:
        problem = problems[path.problem]
    else:
        assert waypoints is not None, "which was looked at"
        problem = Problem(waypoints[0], waypoints[-1])
    found = judged_path(judge, problem, waypoints)
    return JudgedPath(path, judge.with_contact(found, problem, waypoints))
