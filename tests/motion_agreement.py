"""How our checks of configurations and motions agree with Pinocchio's and coal's."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from time import perf_counter

import numpy as np
from exact_bodies import ExactBody
from exact_robots import ExactArm
from exact_scene import Near

from envs.environment import Environment
from envs.problem import Array

ROUNDING = 1e-5
"""In workspace units: nearer to contact, or to a tolerance, which of two checks is right cannot be
told."""

_FINER = 1000
"""What coal does not prove of a motion is sampled so that no point moves farther from one sample to
the next than a share of the tolerance, this much finer."""

_STARTS = 16
"""Random configurations that are tried as the start of a motion, until one is valid."""

_SHORTEST = 0.02
"""The least share of the way to another random configuration that a motion is."""

_OFF = 0.1
"""Of the way to where a motion comes too near, by how much others end before and beyond, at most;
the least is the fourth power."""


@dataclass
class Agreement:
    """Counts.

    Attributes:
        configurations, valid: asked about, and how many touch nothing.
        wrongly_valid, wrongly_invalid: against the exact check.
        motions: asked about.
        accepted, accepted_in_batch: of them, by `CollisionModel.segment_is_free` and by
            `paths_are_free`.
        false_accepts: accepted by either, or by the judge's search, with a configuration in
            contact.
        too_near: the same, with a clearance of less than half the tolerance.
        false_rejects: refused by `segment_is_free`, but nowhere within the tolerance of anything.
        seconds: of both checks.
        cases: what was wrong, to be asked again.
    """

    configurations: int = 0
    valid: int = 0
    wrongly_valid: int = 0
    wrongly_invalid: int = 0
    motions: int = 0
    accepted: int = 0
    accepted_in_batch: int = 0
    false_accepts: int = 0
    too_near: int = 0
    false_rejects: int = 0
    seconds: float = 0.0
    cases: list[str] = field(default_factory=list)

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(
            *(getattr(self, f.name) + getattr(other, f.name) for f in fields(Agreement))
        )

    @property
    def wrong(self) -> int:
        return len(self.cases)


class Comparison:
    """Of an environment's checks and exact ones, which must be of the same robot and obstacles.

    Args:
        env: whose `CollisionModel` and `paths_are_free` are asked, at its tolerance.
        exact: must have `frames` of configurations and `motion` between two.
    """

    def __init__(self, env: Environment, exact: ExactArm | ExactBody) -> None:
        self.env, self.exact = env, exact
        self._model = env.collision_model()

    def __call__(self, draws: int, rng: np.random.Generator) -> Agreement:
        """Of random motions in the environment's space, from short ones to such as lead from one
        random configuration to another; most begin where nothing is touched. Of one that leads too
        near to something, what ends just before that is asked as well, and what ends just beyond:
        checks that go too fast would miss it."""
        begin = perf_counter()
        found = Agreement()
        space = self.env.space
        for _ in range(draws):
            a, inside = self._start(found, rng)
            [b] = space.interpolate(
                a[None], space.sample(rng, 1), _SHORTEST ** (rng.random(1) ** 2)
            )
            if near := self._compare_motion(found, a, b, inside):
                off = _OFF ** rng.uniform(1, 4, 2) * [-1, 1]
                for share in near.t * (1 + off[near.t * (1 + off) < 1]):
                    [end] = space.interpolate(a[None], b[None], np.array([share]))
                    self._compare_motion(found, a, end, inside)
        found.seconds = perf_counter() - begin
        return found

    def _start(self, found: Agreement, rng: np.random.Generator) -> tuple[Array, bool]:
        """And whether something touches there, as the exact check says."""
        q: Array
        for q in self.env.space.sample(rng, _STARTS):
            valid, inside = self._compare_configuration(found, q)
            if valid:
                break
        return q, inside

    def _compare_configuration(self, found: Agreement, q: Array) -> tuple[bool, bool]:
        """Returns whether it is valid by our check, and whether something touches by the other."""
        frames = self.exact.frames(q)
        valid, inside = self._model.is_valid(q), self.exact.touches(frames)
        found.configurations += 1
        found.valid += valid
        if valid == inside and abs(self.exact.distance(frames)) > ROUNDING:
            found.wrongly_valid += valid
            found.wrongly_invalid += not inside
            found.cases.append(f"{'valid' if valid else 'invalid'}: {q.tolist()}")
        return valid, inside

    def _compare_motion(self, found: Agreement, a: Array, b: Array, inside: bool) -> Near | None:
        """Returns where it comes too near to something, if it is refused for that.

        Args:
            inside: whether something touches where it begins.
        """
        tolerance = self.env.tolerance
        motion, least = self.exact.motion(a, b), tolerance / _FINER
        says = self._answers(a, b)
        found.motions += 1
        found.accepted += says["model"]
        found.accepted_in_batch += says["batch"]
        if any(says.values()):
            near = self.exact.first_below(motion, tolerance / 2 - ROUNDING, least)
            if inside or near:
                touches = inside or self.exact.first_below(motion, ROUNDING, least) is not None
                found.false_accepts += touches
                found.too_near += not touches
                who = " and ".join(name for name, accepts in says.items() if accepts)
                found.cases.append(_told(f"accepted by {who}", a, b, near))
        if says["model"] or inside:
            return None
        # What is found in a hurry shows that the motion is rightly refused; only the other search
        # can show that it is not.
        search = motion, tolerance + ROUNDING, least
        near = self.exact.soon_below(*search) or self.exact.first_below(*search)
        if near is None:
            found.false_rejects += 1
            found.cases.append(_told("refused", a, b, near))
        return near

    def _answers(self, a: Array, b: Array) -> dict[str, bool]:
        """Which of the checks accept a motion. The judge's search is asked only where the others
        do not: what these accept is looked at in any case."""
        path, tolerance = np.array([a, b]), self.env.tolerance
        by_model = self._model.segment_is_free(a, b)
        in_batch = bool(self.env.paths_are_free([path], tolerance)[0])
        by_judge = not (by_model or in_batch) and self._model.min_clearance(path) > tolerance
        return {"model": by_model, "batch": in_batch, "judge": by_judge}


def _told(what: str, a: Array, b: Array, near: Near | None) -> str:
    where = f", at {near.t} {near.distance} of {near.pair}" if near else ""
    return f"{what}: {a.tolist()} to {b.tolist()}{where}"
