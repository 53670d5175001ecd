"""Planners that fail: each in one way of a run, of `bench test-planner`, or in many ways at once.

Given to commands by file too, so everything they need is in here.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import threading
import time
from dataclasses import replace
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np
import psutil

from envs import Environment, Problem, Spec
from envs.scenes.cluttered import Cluttered3D
from planners import Budget, Planner, PlannerResult, Status
from planners.ompl.planner import OmplPlanner

_CHILD = ["sleep", "98765"]


def children_left() -> list[psutil.Process]:
    """Those of planners that leave one."""
    return [p for p in psutil.process_iter(["cmdline"]) if p.info["cmdline"] == _CHILD]


def _claim(*waypoints: np.ndarray) -> PlannerResult:
    return PlannerResult(Status.EXACT_SOLUTION, np.array(waypoints))


class UnsteadyWorld(Cluttered3D):
    """Another scene in every process."""

    def __init__(self) -> None:
        super().__init__(scene=os.getpid())


class Straight(Planner):
    """Claims the straight line, whatever is in the way."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start, problem.goal)


class Segfault(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        ctypes.string_at(0)
        raise AssertionError("not reached")


class Exits(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        os._exit(7)


class LeavesChild(Planner):
    """Starts a process that holds on to everything, and dies."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        subprocess.Popen(_CHILD, close_fds=False)
        os._exit(3)


class LeavesStubbornChild(LeavesChild):
    """The process does not end when asked."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # and so does what it starts
        return super().solve(problem, budget)


class SpeaksOutOfTurn(Planner):
    """Writes to every socket it can find."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        for descriptor in range(3, 64):
            with contextlib.suppress(OSError):
                os.write(descriptor, b"\0\0\0\5hello")
        raise ValueError("not what the harness reads")


class Hangs(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        while True:
            time.sleep(0.1)


class PrintsForever(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        while True:
            os.write(1, b"x" * 100_000)


class HangsInC(Planner):
    """Hangs with the interpreter's lock held, so that no Python code runs any more."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        ctypes.PyDLL(None).sleep(10_000)
        raise AssertionError("not reached")


class EatsMemory(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        eaten = []
        while True:
            eaten.append(np.zeros(25_000_000))


class EatsAllMemory(Planner):
    """Leaves nothing, not even for what says so."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        eaten, size = [], 2**26
        while True:
            try:
                eaten.append(bytearray(size))
            except MemoryError:  # noqa: PERF203  as it is meant to be
                if size < 2**6:
                    raise
                size //= 2


class Raises(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        raise ValueError("I do not feel like planning")


class RaisesInSetup(Planner):
    def setup(self, env: Environment, *, seed: int) -> None:
        raise ValueError("no weights here")

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        raise AssertionError("not reached")


class ReturnsNone(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return None  # type: ignore[return-value]


class NaN(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start, problem.start * np.nan, problem.goal)


class Ragged(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return PlannerResult(Status.EXACT_SOLUTION, [[1.0], [2.0, 3.0]])


class WrongStart(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start + 1e-3, problem.goal)


class WrongGoal(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start, problem.goal - 1e-3)


class OutOfBounds(Planner):
    """Goes round the whole scene."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start, np.array([0.0, 0.0, 25.0]), problem.goal)


class Wanders(Planner):
    """Goes from corner to corner a thousand times before it comes to the goal."""

    def setup(self, env: Environment, *, seed: int) -> None:
        self._env = env

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        corners = [self._env.lower, self._env.upper] * 1000
        return _claim(problem.start, *corners, problem.goal)


class ThroughBox(Planner):
    """Visits the centre of the first box."""

    def setup(self, env: Environment, *, seed: int) -> None:
        self._inside = env.obstacles[0].center

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start, self._inside, problem.goal)


class FreeWaypointsOnly(Planner):
    """Waypoints on both sides of the first box, all free; the segment between crosses it."""

    def setup(self, env: Environment, *, seed: int) -> None:
        box = env.obstacles[0]
        self._sides = []
        for sign in (-1, 1):
            offset = np.zeros(3)
            for axis in range(3):
                offset[:] = 0
                offset[axis] = sign * (box.sides[axis] / 2 + 0.05)
                if env.clearance(np.array([box.center + offset]))[0] > 0:
                    break
            self._sides.append(box.center + offset)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return _claim(problem.start, *self._sides, problem.goal)


class Prints(Straight):
    """Solves nothing hard, but talks."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        print("planner,says,hello")
        os.write(1, b"and so does its library\n")
        return super().solve(problem, budget)


class Moody(Straight):
    """Fails if MOODY_FAILS is set."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        if "MOODY_FAILS" in os.environ:
            return PlannerResult(Status.TIMEOUT)
        return super().solve(problem, budget)


class TellsThreads(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        import torch

        threads = {k: v for k, v in os.environ.items() if k.endswith("_THREADS")}
        stats = {"threads": threads, "torch": torch.get_num_threads()}
        return PlannerResult(Status.TIMEOUT, None, stats)


class Late(Straight):
    """Overruns its limit by less than what gets it killed."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        time.sleep(budget.remaining() + 0.2)
        return super().solve(problem, budget)


class Approximates(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        middle = (problem.start + problem.goal) / 2
        return PlannerResult(Status.APPROXIMATE_SOLUTION, np.array([problem.start, middle]))


class Unsupporting(Planner):
    def unsupported(self, env: Environment) -> str | None:
        return "it only plans on Sundays"

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        raise AssertionError("not reached")


class Counts(Straight):
    """Writes a line to the file named in COUNT_FILE for every problem it is asked."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        with open(os.environ["COUNT_FILE"], "a") as file:  # noqa: PTH123
            file.write(f"{problem.index} {budget.stop_cost}\n")
        return super().solve(problem, budget)


class Faultless(OmplPlanner):
    """Keeps to everything; those made of it but for one thing, which `bench test-planner` finds."""

    def __init__(self) -> None:
        super().__init__("RRTConnect")

    def setup(self, env: Environment, *, seed: int) -> None:
        self._world = env
        super().setup(env, seed=seed)


class BadSupport(Faultless):
    def unsupported(self, env: Environment) -> str | None:
        raise KeyError("which world?")


class EmptyReason(Faultless):
    def unsupported(self, env: Environment) -> str | None:
        return False  # type: ignore[return-value]


class Tuple(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> Any:
        result = super().solve(problem, budget)
        return result.status, result.path


class OddStats(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return replace(super().solve(problem, budget), stats={"object": object()})


class NearlyThere(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.path is None:
            return result
        return replace(result, path=np.vstack([result.path[:-1], problem.goal + 1e-4]))


class Tunnels(Faultless):
    """Leaves all waypoints out."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.status is not Status.EXACT_SOLUTION:
            return result
        return replace(result, path=np.array([problem.start, problem.goal]))


class Dawdles(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        time.sleep(budget.remaining() + 0.3)
        return super().solve(problem, Budget(time.perf_counter() + 0.2))


class AlwaysClaims(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.status is Status.EXACT_SOLUTION:
            return result
        return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal])


class NeverGivesUp(Faultless):
    """Does not return without a solution."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        while (result := super().solve(problem, budget)).status is not Status.EXACT_SOLUTION:
            time.sleep(0.05)
        return result


class WritesToProblem(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        problem.start[0] += 0.0
        return super().solve(problem, budget)


class MovesObstacles(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        obstacles: Any = self._world.obstacles
        obstacles.pop()
        return result


class Chance(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        seed = int.from_bytes(os.urandom(3), "little") + 1
        return super().solve(replace(problem, seed=seed), budget)


class Remembers(Faultless):
    """What it finds depends on how much it has solved before."""

    _solved = 0

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        self._solved += 1
        return super().solve(replace(problem, seed=self._solved), budget)


class DeclaredChance(Chance):
    not_repeatable = "it asks the system for random numbers"


class LeavesThreads(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        for _ in range(3):
            threading.Thread(target=time.sleep, args=(2,), daemon=True).start()
        return super().solve(problem, budget)


class KeepsThreads(Faultless):
    """Has them from the beginning, and they wait."""

    def setup(self, env: Environment, *, seed: int) -> None:
        super().setup(env, seed=seed)
        for _ in range(3):
            threading.Thread(target=threading.Event().wait, args=(20,), daemon=True).start()


class WorksOn(Faultless):
    """Its thread is there from the beginning, and works when it has returned."""

    def setup(self, env: Environment, *, seed: int) -> None:
        super().setup(env, seed=seed)
        self._until = 0.0
        threading.Thread(target=self._improve, daemon=True).start()

    def _improve(self) -> None:
        while True:
            if time.perf_counter() > self._until:
                time.sleep(0.001)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        self._until = time.perf_counter() + 1
        return result


class LazyPath(Faultless):
    """Does half of its work when its path is looked at."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.path is None:
            return result
        return replace(result, path=_Late(result.path, budget))


class _Late:
    def __init__(self, path: Any, budget: Budget) -> None:
        self._path, self._budget = path, budget

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        time.sleep(self._budget.remaining() + 0.3)
        return np.array(self._path, dtype=dtype)


class UnpinsTorch(Faultless):
    def setup(self, env: Environment, *, seed: int) -> None:
        import torch

        torch.set_num_threads(4)
        super().setup(env, seed=seed)


class _Hidden(Planner):
    """Not listed: its name begins with an underscore."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return PlannerResult(Status.TIMEOUT)


class Nasty(Planner):
    """Crashes on every `crash`-th problem and hangs on every `hang`-th other one; on the rest it
    leaks `leak_mb` and claims the straight line. Each time it starts a helper and makes shared
    memory, named by the pids of harness and worker, and sees to neither's end."""

    improves = False

    def __init__(self, crash: int = 3, hang: int = 5, leak_mb: int = 100) -> None:
        self._crash, self._hang, self._leak_mb = crash, hang, leak_mb
        self._kept: list[object] = []

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        name = f"nasty-{os.getppid()}-{os.getpid()}-{len(self._kept)}"
        self._kept += [subprocess.Popen(["sleep", "98764"]), SharedMemory(name, True, 4096)]
        if problem.index % self._crash == 0:
            os.kill(os.getpid(), signal.SIGSEGV)
        if problem.index % self._hang == 0:
            time.sleep(10_000)
        self._kept.append(np.ones(self._leak_mb * 2**17))
        return PlannerResult(Status.EXACT_SOLUTION, np.array([problem.start, problem.goal]))


def spec(planner: type[Planner], id: str) -> Spec:
    return Spec(id, f"planners_that_fail:{planner.__name__}", planner.__doc__ or planner.__name__)


EXPECTED = {
    "segfault": (Segfault, "CRASH"),
    "exits": (Exits, "CRASH"),
    "leaves-child": (LeavesChild, "CRASH"),
    "speaks-out-of-turn": (SpeaksOutOfTurn, "CRASH"),
    "hangs": (Hangs, "KILLED"),
    "prints-forever": (PrintsForever, "KILLED"),
    "hangs-in-c": (HangsInC, "KILLED"),
    "eats-memory": (EatsMemory, "OUT_OF_MEMORY"),
    "raises": (Raises, "ERROR"),
    "raises-in-setup": (RaisesInSetup, "ERROR"),
    "returns-none": (ReturnsNone, "ERROR"),
    "not-a-number": (NaN, "MALFORMED"),
    "ragged": (Ragged, "MALFORMED"),
    "wrong-start": (WrongStart, "WRONG_ENDPOINT"),
    "wrong-goal": (WrongGoal, "WRONG_ENDPOINT"),
    "out-of-bounds": (OutOfBounds, "OUT_OF_BOUNDS"),
    "wanders": (Wanders, "NOT_JUDGED"),
    "through-box": (ThroughBox, "COLLISION"),
    "free-waypoints-only": (FreeWaypointsOnly, "COLLISION"),
    "approximates": (Approximates, "APPROXIMATE_SOLUTION"),
    "unsupporting": (Unsupporting, "UNSUPPORTED"),
}
"""What the table must say of each."""

SPECS = [
    *(spec(planner, id) for id, (planner, _) in EXPECTED.items()),
    spec(EatsAllMemory, "eats-all-memory"),
    spec(Straight, "straight"),
    spec(Prints, "prints"),
    spec(Late, "late"),
    spec(Moody, "moody"),
    spec(TellsThreads, "tells-threads"),
    spec(Counts, "counts"),
    spec(LeavesStubbornChild, "leaves-stubborn-child"),
]
