"""What speaks against an environment, a function for each check."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterator
from functools import wraps
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from bench.conformance.check import NotSeen
from bench.conformance.environment_evidence import EnvironmentEvidence, SceneEvidence
from bench.conformance.other_arguments import with_other_numbers
from envs import Environment, Problem
from envs.errors import brief, reason
from envs.problem import Array
from envs.registry import Entry

_ONE_AT_A_TIME = 200  # configurations
_ROUNDING = 1e-6
"""The share of a clearance, and the clearance, up to which two ways to compute it may differ: that
of the collision model's own distances, see `envs.collision.separation`."""

_PICKLED_PROBLEMS = 2
_OTHER_ARGUMENTS = 2
_MOST_SAID = 3  # of complaints of one kind

Rule = Callable[[EnvironmentEvidence], list[str] | NotSeen]


def _in_each_scene(rule: Callable[[SceneEvidence], list[str]]) -> Rule:
    """The rule of an environment that asks each of its scenes."""

    @wraps(rule)
    def of_all(evidence: EnvironmentEvidence) -> list[str]:
        return [scene.where + line for scene in evidence.scenes for line in rule(scene)]

    return of_all


def bounds(evidence: EnvironmentEvidence) -> list[str]:
    env, size = evidence.env, evidence.env.space.size
    ends = np.asarray(env.lower), np.asarray(env.upper)
    for name, bound in zip(("lower", "upper"), ends, strict=True):
        if bound.shape != (size,):
            return [f"`{name}` is {bound.shape}, where the space's configurations are {(size,)}"]
        if not np.isfinite(bound).all():
            return [f"`{name}` is {_at(bound)}, which is not finite"]
    if not (ends[0] < ends[1]).all():
        return [f"`lower` {_at(ends[0])} is not below `upper` {_at(ends[1])}"]
    spaces = env.space.lower, env.space.upper
    if not all(map(np.array_equal, ends, spaces)):
        told, own = (f"{_at(lower)} to {_at(upper)}" for lower, upper in (ends, spaces))
        return [f"the bounds are {told}, those of `space` {own}"]
    drawn = env.space.sample(np.random.default_rng(evidence.seed), _ONE_AT_A_TIME)
    out = drawn + 3 * (ends[1] - ends[0])
    left_out, let_in = ~np.asarray(env.contains(drawn)), np.asarray(env.contains(out))
    return [f"`contains` leaves out {_at(q)}, a sample of `space`" for q in drawn[left_out][:1]] + [
        f"`contains` lets in {_at(q)}, which is beyond the bounds" for q in out[let_in][:1]
    ]


@_in_each_scene
def batches(scene: SceneEvidence) -> list[str]:
    q = scene.q[:_ONE_AT_A_TIME]
    asked = q.copy()
    whole = scene.clearances_at(q)
    scene.env.clearance(asked)
    alone = np.array([scene.clearances_at(one[None])[0] for one in q])
    with np.errstate(invalid="ignore"):  # of infinite ones, where there are no obstacles
        off = np.abs(whole - alone) > _ROUNDING * (1 + np.abs(alone))
    found = [f"`clearance` is NaN at {_at(q[at])}" for at in _first(np.isnan(whole))]
    found += [
        f"`clearance` is {whole[at]:.6g} at {_at(q[at])} among {len(q)} configurations, and "
        f"{alone[at]:.6g} alone"
        for at in _first(off)
    ]
    if not np.array_equal(asked, q):
        found.append("`clearance` writes to the configurations that it is given")
    return found


def clearance(evidence: EnvironmentEvidence) -> list[str] | NotSeen:
    found = [s.where + line for s in evidence.scenes for line in _wrong_clearances(s)]
    if not found and not any(scene.valid.any() for scene in evidence.scenes):
        return NotSeen("no random configuration is free, so that there are no distances to compare")
    return found


def _wrong_clearances(scene: SceneEvidence) -> Iterator[str]:
    """The worst of each kind. A difference of less than what the judge decides to is none."""
    told, valid, exact = scene.clearances, scene.valid, scene.distances
    with np.errstate(invalid="ignore"):  # as in `batches`, which tells of NaN
        excess = np.where((told == exact) | np.isnan(told), 0.0, told - exact)
    least = scene.env.tolerance

    touching = np.where(valid, 0.0, excess)
    if (count := (touching > least).sum()) > 0:
        at = int(touching.argmax())
        yield (
            f"`clearance` says {told[at]:.4g} at {_at(scene.q[at])}, where the collision model "
            f"finds contact ({_share(count, scene)})"
        )
    for sign, word in ((1.0, "large"), (-1.0, "small")):
        off = np.where(valid, sign * excess, 0.0)
        if (count := (off > least).sum()) > 0:
            at = int(off.argmax())
            yield (
                f"`clearance` is up to {off[at]:.4g} too {word}: {told[at]:.4g} at "
                f"{_at(scene.q[at])}, which is free, and {exact[at]:.4g} from contact by the "
                f"collision model ({_share(count, scene)})"
            )


def _share(count: int, scene: SceneEvidence) -> str:
    return f"so at {count} of {len(scene.q)} random configurations"


@_in_each_scene
def motion(scene: SceneEvidence) -> list[str]:
    (begins, ends), allowed = scene.motions, scene.motion_bounds
    # Where it is negative, it need not be the depth.
    before, after = (np.maximum(c, 0.0) for c in scene.motion_clearances)
    with np.errstate(invalid="ignore"):
        change = np.abs(after - before)
    beyond = np.nan_to_num(change - allowed - _ROUNDING * (1 + np.minimum(before, after)))
    found = []
    if (beyond > 0).any():
        at = int(beyond.argmax())
        found.append(
            f"`clearance` changes by {change[at]:.4g} from {_at(begins[at])} to {_at(ends[at])}, "
            f"where `robot.motion_bound` is {allowed[at]:.4g}"
        )
    rates = scene.env.robot.rate_bound * scene.env.space.distance(begins, ends)
    if (allowed > rates + 1e-9).any():
        at = int((allowed - rates).argmax())
        found.append(
            f"`robot.motion_bound` is {allowed[at]:.4g} from {_at(begins[at])} to {_at(ends[at])}, "
            f"and `robot.rate_bound` allows {rates[at]:.4g}"
        )
    return found


@_in_each_scene
def proofs(scene: SceneEvidence) -> list[str]:
    env, (begins, ends) = scene.env, scene.long_motions
    planners_model = env.collision_model(env.planning_tolerance)
    found = []
    for a, b in zip(begins, ends, strict=True):
        proved = [
            name
            for name, is_proved in (
                ("planners'", planners_model.segment_is_free(a, b)),
                ("the judge's", scene.model.min_clearance(np.array([a, b])) > env.tolerance),
            )
            if is_proved
        ]
        touched = scene.touched_between(a, b) if proved else None
        if touched is not None:
            found.append(
                f"{' and '.join(proved)} proof takes the motion from {_at(a)} to {_at(b)}, and the "
                f"collision model finds contact at {_at(touched)}"
            )
    return _few(found)


def problems(evidence: EnvironmentEvidence) -> list[str]:
    env, made, seed = evidence.env, evidence.problems, evidence.seed
    count, is_list = evidence.problem_count, env.problem_count is not None
    if [problem.index for problem in made] != list(range(len(made))) and not is_list:
        return [f"their indices are {brief([p.index for p in made])}, not 0, 1, ..."]
    if len(made) != count:
        return [f"`sample_problems({count}, {seed})` gives {len(made)}"]
    fewer = env.sample_problems(max(1, count - 5), seed)
    found = [
        f"problem {a.index} of seed {seed} is {_ends(a)} among {len(fewer)}, and {_ends(b)} among "
        f"{count}"
        for a, b in zip(fewer, made, strict=False)
        if _ends(a) != _ends(b) or a.seed != b.seed
    ][:1]
    if is_list:  # whose ends are as they are there, and the same whatever the seed
        return found
    other, of_other = evidence.other_problems, evidence.other_seed
    same = sum(_ends(a) == _ends(b) for a, b in zip(made, other, strict=False))
    if same > count / 2:
        found.append(f"{same} of {count} problems are the same of the seeds {seed} and {of_other}")
    return found + _few([line for problem in made for line in _wrong_ends(evidence, problem)])


def _ends(problem: Problem) -> str:
    return f"{_at(problem.start, 17)} to {_at(problem.goal, 17)}"


def _wrong_ends(evidence: EnvironmentEvidence, problem: Problem) -> Iterator[str]:
    env = evidence.env
    model = evidence.model_of(problem)
    for name, q in (("start", problem.start), ("goal", problem.goal)):
        what = f"the {name} of problem {problem.index}, {_at(q)},"
        if not env.contains(q[None])[0]:
            yield f"{what} is out of bounds"
        elif not model.is_valid(q):
            yield f"{what} is in collision"
        elif (kept := model.clearance(q)) < env.min_clearance - env.tolerance:
            yield f"{what} keeps {kept:.4g}, and `min_clearance` is {env.min_clearance:g}"
    if np.array_equal(problem.start, problem.goal):
        yield f"problem {problem.index} ends where it starts, at {_at(problem.start)}"


def pickled(evidence: EnvironmentEvidence) -> list[str] | NotSeen:
    env = evidence.env
    if _no_json(env):
        return NotSeen("without a fingerprint, which `definition` does not give, none is compared")
    made = evidence.problems  # so that one is sent that was used
    copy: Environment = pickle.loads(pickle.dumps(env))
    if copy.fingerprint != env.fingerprint:
        return [f"a pickled copy differs: {_difference(env, copy)}"]
    count = min(_PICKLED_PROBLEMS, evidence.problem_count)
    again = copy.sample_problems(count, evidence.seed)
    return [
        f"problem {a.index} of a pickled copy is {_ends(a)}, not {_ends(b)}"
        for a, b in zip(again, made, strict=False)
        if _ends(a) != _ends(b)
    ][:1]


def definition(evidence: EnvironmentEvidence) -> list[str]:
    env = evidence.env
    if no_json := _no_json(env):
        return [no_json]
    again = evidence.entry.make()
    if again.fingerprint != env.fingerprint:
        return [f"made again, it differs: {_difference(env, again)}"]
    return [
        f"{entry.id} has the same definition, and other {what}"
        for entry in islice(with_other_numbers(evidence.entry), _OTHER_ARGUMENTS)
        if (what := _hidden_change(evidence, entry))
    ]


def _no_json(env: Environment) -> str:
    """Why the definition is no JSON data, if it is none."""
    told = env.definition()
    try:
        json.dumps(told, sort_keys=True, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        return f"`definition` is not JSON data: {reason(error)}"
    return "" if isinstance(told, dict) else f"`definition` gave a {type(told).__name__}, no dict"


def _difference(env: Environment, other: Environment) -> str:
    """What differs in the definitions of two."""
    a, b = env.definition(), other.definition()
    for key in sorted({*a, *b}):
        if (one := brief(a.get(key))) != (another := brief(b.get(key))):
            return f"its {key!r} is {another}, not {one}"
        if a.get(key) != b.get(key):
            return f"its {key!r} is another"
    return f"its fingerprint is {other.fingerprint}, not {env.fingerprint}"


def _hidden_change(evidence: EnvironmentEvidence, entry: Entry[Environment]) -> str:
    """What is not the same of an environment that should be equal by its definition."""
    try:
        other = entry.make()
    except Exception:  # noqa: BLE001  the number makes no sense there
        return ""
    if other.fingerprint != evidence.env.fingerprint:
        return ""
    first = evidence.scenes[0]
    if other.space.size != evidence.env.space.size:
        return "configurations"
    if not np.array_equal(other.clearance(first.q.copy()), first.clearances):
        return "clearances"
    made = other.sample_problems(len(evidence.problems), evidence.seed)
    return "problems" if list(map(_ends, made)) != list(map(_ends, evidence.problems)) else ""


@_in_each_scene
def speed(scene: SceneEvidence) -> list[str]:
    told = np.asarray(scene.env.speed(scene.q.copy()))
    meant = scene.env.speed_model(scene.clearances)
    if told.shape != meant.shape:
        return [f"`speed` of {scene.q.shape} gave {told.shape}, not {meant.shape}"]
    return [
        f"`speed` is {told[at]:.4g} at {_at(scene.q[at])}, and must be positive"
        for at in _first(~(told > 0))
    ] + [
        f"`speed` is {told[at]:.6g} at {_at(scene.q[at])}, where `speed_model` of `clearance` is "
        f"{meant[at]:.6g}"
        for at in _first(~np.isclose(told, meant, rtol=_ROUNDING))
    ]


def _first(wrong: NDArray[np.bool_]) -> list[int]:
    """The place of the first that is, if any is."""
    found: list[int] = np.flatnonzero(wrong)[:1].tolist()
    return found


def _at(q: Array, digits: int = 6) -> str:
    """A configuration (d,), as Python has lists."""
    return f"[{', '.join(f'{x:.{digits}g}' for x in q)}]"


def _few(lines: list[str]) -> list[str]:
    """The first of many."""
    more = len(lines) - _MOST_SAID
    return lines[:_MOST_SAID] + ([f"and {more} more"] if more > 0 else [])
