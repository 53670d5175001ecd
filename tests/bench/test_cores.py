"""What tables say of machines and of the share of a core that planners had."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from records import recorded, row

from bench.analysis.run_results import RunResults
from bench.analysis.summary import summarise
from bench.judging.metrics import METRICS
from bench.report import html, latex, markdown


def attempts(planner: str, share: float, count: int = 10, **others: Any) -> list[dict[str, Any]]:
    """Ones that took a second each, with this share of a core."""
    told = {"solve_s": 1.0, "cpu_s": share, "length": 1.0, **others}
    return [row(planner, i, "VALID", **told) for i in range(count)]


def on_machines(rows: list[dict[str, Any]], **machines: Any) -> RunResults:
    """A run of sessions on machines by the sessions' ids; None was cut off."""
    run = recorded(rows)
    [session] = run.sessions
    sessions = tuple(
        {**session, "run_id": id, **({} if machine is None else {"machine": machine})}
        for id, machine in machines.items()
    )
    return replace(run, sessions=sessions)


def test_planners_with_less_than_a_core_are_told() -> None:
    rows = [*attempts("busy", 0.62), *attempts("well", 0.97), *attempts("threads", 3.0)]
    run = recorded(rows)
    assert run.remarks == [
        "`busy` in `c3d` had less than 90 % of a core in 10 of 10 attempts, 62 % in the median"
    ]
    for text in (markdown.text(run), latex.text(run)):
        assert "had less than 90" in text
    shares = run.summary.set_index("planner")["cpu_share_median"]
    assert shares.to_dict() == {"busy": 0.62, "well": 0.97, "threads": 3.0}


def test_some_attempts_are_enough_and_what_else_ran_is_a_fact_beside_it() -> None:
    rows = attempts("p", 0.99, 8, load=1.5) + [
        row("p", 8 + i, "TIMEOUT", solve_s=5.0, cpu_s=2.0, load=1.5) for i in range(2)
    ]
    [remark] = recorded(rows).remarks
    assert remark.endswith(
        "in 2 of 10 attempts, 99 % in the median; other programs kept 1.5 cores busy"
    )


def test_what_is_not_known_or_too_short_to_say_is_no_remark() -> None:
    short = attempts("short", 0.0, solve_s=0.002)
    unknown = attempts("unknown", 0.5, cpu_s=None)
    none = [row("none", i, "UNSUPPORTED", solve_s=1.0, cpu_s=0.0) for i in range(5)]
    assert recorded([*short, *unknown, *none]).remarks == []


def test_a_run_continued_on_another_machine_says_so() -> None:
    rows = [{**r, "run_id": "r" if i < 6 else "q"} for i, r in enumerate(attempts("p", 1.0))]
    run = on_machines(rows, r={"processor": "X", "cores": 2}, q={"processor": "Y", "cores": 2})
    [remark] = run.remarks
    assert remark.startswith("times in `c3d` are of 2 machines")
    assert "X, processor X (`p` 6); Y, processor Y (`p` 4)" not in remark
    assert "X (`p` 6); Y (`p` 4)" in remark
    assert remark in markdown.text(run)
    assert "of 2 machines" in html.page.text(run)
    same = on_machines(rows, r={"processor": "X"}, q={"processor": "X"})
    assert same.remarks == []


def test_machines_of_one_name_are_told_apart_by_what_differs() -> None:
    rows = [*attempts("p", 1.0), *attempts("o", 1.0, run_id="q")]
    run = on_machines(
        rows, r={"processor": "X", "usable_cpus": [0]}, q={"processor": "X", "usable_cpus": [0, 1]}
    )
    assert "X, usable cpus [0] (`p` 10); X, usable cpus [0, 1] (`o` 10)" in run.remarks[0]


def test_sessions_that_were_cut_off() -> None:
    """Only the processor's name is in their rows, or not even that."""
    two = [*attempts("p", 1.0, 5), *attempts("p", 1.0, 5, run_id="q", processor="other")]
    assert "P (`p` 5); other (`p` 5)" in on_machines(two, r=None, q=None).remarks[0]
    one = [*attempts("p", 1.0, 5), *attempts("p", 1.0, 5, run_id="q")]
    assert on_machines(one, r={"processor": "P", "cores": 2}, q=None).remarks == []
    old = [*attempts("p", 1.0, 5, processor=""), *attempts("p", 1.0, 5, processor="", run_id="q")]
    assert "one that is not known" in on_machines(old, r={"processor": "P"}, q=None).remarks[0]
    [told] = summarise(recorded(two).records, [("c3d", "p")], METRICS).to_dict("records")
    assert told["processors"] == 2
