"""Command lines, the suites that they ask for, and what `bench check` is to look at."""

from __future__ import annotations

import io
import logging
import math
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fuzzing import CASES, DISTINCT, fuzzed
from hypothesis import strategies as st
from mutations import mutated, texts

import envs
import planners
from bench.analysis import regression
from bench.cli import app, commands, listing
from bench.execution.config import RunConfig, make_run_config
from bench.execution.stop_rule import StopRule
from bench.report import writers
from envs import InputError

LINES = (
    "run --env c3d:scene=3 --planners fmm,rrtstar:range=2 --problems 100 --seed 7 --out DIR",
    "run --env box --planners all --time-limit 0.5 --stop match:fmm:0.1 --jobs 1 --force",
    "run --env arm4,arm6 --memory-limit 2048 --device cpu --no-train --planner-file none.py",
    "train --env c3d:scene=1000 --planner ntfields --minutes 10 --seed 3 --out FILE",
    "report DIR OTHER --format md,csv,latex --spread variance --out REPORT",
    "compare DIR OTHER --planners ntfields,fmm --out FILE.csv",
    "check DIR --baseline FILE.csv --alpha 0.05 --ratios length,time --reference fmm",
    "check DIR --baseline FILE.csv --update --tolerance 0.2 --out FILE.md",
    "show --env c3d --paths DIR --planners fmm --problem 3 --out FILE.png",
    "field --env c3d --planners fmm --source 1,2.5,-3 --device cpu --no-train --out FILE.png",
    "paper --quick --only c3d,gibson --out DIR",
    "test-planner my.py:Mine --env box --time-limit 2",
    "test-env c3d:scene=3 --seed 4",
    "replay DIR --planner fmm --problem 3 --env c3d",
    "judge --env c3d --paths FILE.json --problems 10 --seed 3 --problem-file FILE.csv --json",
    "paths DIR --planner fmm --env c3d --repeat 1 --out FILE.csv",
    "list planners --json",
)

NUMBERS = ("1", "2", "0.5", "-1", "0", "nan", "inf", "1e999", "9" * 30, "1e6", "4096", "1e-3")


@pytest.fixture
def logs() -> Iterator[None]:
    """The command line's log goes where it went before."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:], root.level = handlers, level


def read_only(chosen: SimpleNamespace) -> int:
    """In place of every command: reads its options that have a form of their own."""
    given = vars(chosen)
    if "env" in given and given["env"] is not None:
        envs.REGISTRY.entries(given["env"])
    if given.get("stop") not in (None, "paper"):
        StopRule.parse(given["stop"])
    if "format" in given:
        writers.chosen_formats(given["format"])
    if "alpha" in given:
        wanted = {name: given[name] for name in ("alpha", "ratios", "reference", "tolerance")}
        regression.CheckOptions.parse(**wanted, update=given["update"])
    return commands.DONE


@pytest.mark.usefixtures("logs")
def test_command_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    of_their_name = "run train report compare check show field paper judge paths replay"
    for name in of_their_name.split():
        monkeypatch.setattr(commands, name, read_only)
    monkeypatch.setattr(commands, "test_planner", read_only)
    monkeypatch.setattr(commands, "test_env", read_only)
    monkeypatch.setattr(listing, "list_", read_only)

    def parse(line: str) -> str:
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = app.main(line.split(" "))
        if code == app.BAD_INPUT:
            assert out.getvalue() == ""
            [said] = err.getvalue().splitlines()
            assert said.startswith("bench: error: ")
            raise InputError(said)
        assert (code, err.getvalue()) == (0, "")
        return out.getvalue()

    fuzzed("command lines", texts(LINES), parse, lambda _: None)


def number(kind: type) -> st.SearchStrategy[Any]:
    """Values that a command line may give an option of a type, mostly small."""
    said = st.sampled_from(NUMBERS) | mutated(NUMBERS, most=1)
    return said.flatmap(lambda text: st.just(_read(kind, text)))


def _read(kind: type, text: str) -> Any:
    try:
        return kind(text)
    except ValueError:
        return kind(1)


def test_suites() -> None:
    asked = st.tuples(
        st.sampled_from(("box", "box:side=6", "box,box:side=4")) | mutated(("box:side=6",), most=1),
        st.sampled_from(("fmm", "rrtconnect", "rrtstar:range=2,fmm")) | mutated(("fmm,rrtstar",)),
        number(int).map(lambda n: min(n, 3) if n < 2_000_000 else n),  # more take long
        number(int),
        number(float),
        st.sampled_from(("first", "limit", "match:fmm:0.1")) | mutated(("match:rrtstar:0.5",)),
        st.sampled_from((1, 1, 1, 0, -1, 10**9)),
        number(int).map(lambda n: n + 255),
        st.sampled_from(("cpu", "cpu", "cpu", "gpu", "cuda:-1", "meta", "")),
    )

    def parse(values: tuple[Any, ...]) -> RunConfig:
        names = ("env", "planner", "problems", "seed", "time_limit_s", "stop")
        more = ("jobs", "memory_limit_mb", "device")
        return make_run_config(**dict(zip((*names, *more), values, strict=True)))

    def check(config: RunConfig) -> None:
        assert 0 < config.time_limit_s < math.inf
        assert len(config.settings_digest) == 12
        assert StopRule.parse(config.stop.text) == config.stop
        assert config.planners
        assert all(
            len(problem_set.problems) == config.selection()["problems"] > 0
            for problem_set in config.problem_sets
        )
        ids = [entry["id"] for entry in config.selection()["envs"]]
        assert [entry.id for entry in envs.REGISTRY.entries(",".join(ids))] == ids
        assert [planners.REGISTRY.entry(entry.id).id for entry in config.planners]

    fuzzed("suites", [asked], parse, check)


def test_checks() -> None:
    asked = st.tuples(
        st.just(0.05) | number(float),
        st.none() | st.just("time") | mutated(("length", "time", "length,margin,time")),
        st.none() | st.sampled_from(("fmm", "rrtstar:range=2", "")),
        st.just(0.1) | number(float),
        st.booleans(),
    )

    def parse(values: tuple[Any, ...]) -> regression.CheckOptions:
        names = ("alpha", "ratios", "reference", "tolerance", "update")
        return regression.CheckOptions.parse(**dict(zip(names, values, strict=True)))

    def check(wanted: regression.CheckOptions) -> None:
        assert 0 < wanted.alpha < 1
        assert 0 <= wanted.tolerance < math.inf
        assert set(wanted.measures) <= set(regression.gated_metrics())

    fuzzed("checks", [asked], parse, check)


def test_there_are_ten_thousand_cases_and_each_parser_is_given_its_own() -> None:
    assert DISTINCT * sum(CASES.values()) >= 10_000
    written = "".join(file.read_text() for file in Path(__file__).parent.glob("test_*.py"))
    assert all(f'fuzzed("{name}", ' in written for name in CASES)
