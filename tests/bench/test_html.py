"""The HTML report without a browser: what it says, and that nothing breaks out of it."""

from __future__ import annotations

import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from html_reports import HOSTILE, run_in_c3d, through, unpacked
from records import recorded, row

from bench.analysis.run_results import RunResults
from bench.report import formatting, html
from bench.report.html.overview import best_by, solved_by
from bench.report.html.page import planner_styles, text
from bench.report.html.problems import columns, problem_sets_of, problems_data
from bench.report.postures import along
from envs import Environment


class Tags(HTMLParser):
    """The tags of a page with their attributes, and its texts outside scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] not in ("script", "style"):
            self.texts.append(data)


def test_curves_count_failures_as_never_solved() -> None:
    rows = [
        row("p", 0, "VALID", solve_s=0.1, stats='{"cost_history": [[0.1, 9.0], [1.0, 7.0]]}'),
        row("p", 1, "VALID", solve_s=0.2, stats='{"cost_history": [[0.2, 5.0]]}'),
        row("p", 2, "TIMEOUT", solve_s=5.0),
        row("p", 3, "COLLISION", solve_s=0.1, stats='{"cost_history": [[0.1, 1.0]]}'),
    ]
    records = recorded(rows).records
    solved = solved_by(records, 5.0)
    assert solved["y"].tolist() == [0, 0.25, 0.5, 0.5]
    assert solved["x"].tolist() == [0.1, 0.1, 0.2, 5.0]
    best = best_by(records, 5.0)
    assert best is not None
    assert np.isinf(best["y"]).all(), "half of four are not solved: the median is infinite"
    three = best_by(records.iloc[:3], 5.0)
    assert three is not None
    assert three["y"][0] == np.inf
    assert three["y"][-1] == 7.0


def test_planners_that_keep_no_history_have_no_curve_of_lengths() -> None:
    assert best_by(recorded([row("p", 0, "VALID", solve_s=0.1)]).records, 5.0) is None


def test_planners_have_the_papers_colours_and_differ_in_more_than_colour() -> None:
    made = planner_styles(["ntfields", "fmm", "another", "rrtconnect"])
    assert [one["light"] for one in made[:2]] == ["#ff7f0e", "#2ca02c"]
    assert len({(one["dash"], one["symbol"]) for one in made}) == 4


def test_no_colour_is_lost_on_a_light_or_a_dark_page() -> None:
    weights = [0.2126, 0.7152, 0.0722]
    for one in planner_styles([f"p{n}" for n in range(14)]):
        light, dark = (
            np.array([int(one[page][i : i + 2], 16) / 255 for i in (1, 3, 5)]) @ weights
            for page in ("light", "dark")
        )
        assert light < 0.77
        assert dark > 0.33


def test_numbers_in_the_page_are_the_tables_own(tmp_path: Path) -> None:
    rows = [
        row("a", n, "VALID", solve_s=0.1 + n / 7, length=3 + n / 3, safety_margin=n / 9)
        for n in range(5)
    ]
    run = recorded([*rows, row("b", 0, "TIMEOUT", solve_s=5.0)])
    html.write(run, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    printed = [unescape(t) for t in re.findall(r'<span class="text">(.*?)</span>', page)]
    wanted = [
        *formatting.success_rows(run),
        *formatting.common_rows(run),
    ]
    assert printed[: sum(map(len, wanted))] == [text for one in wanted for text in one.values()]


def test_names_and_errors_cannot_break_out_of_the_page(c3d: Environment) -> None:
    hostile = run_in_c3d(c3d, row(HOSTILE, 0, "ERROR", solve_s=None, error=HOSTILE))
    harmless = run_in_c3d(c3d, row("planner", 0, "ERROR", solve_s=None, error="error"))
    page = Tags(text(hostile))
    assert [tag for tag, _ in page.tags] == [tag for tag, _ in Tags(text(harmless)).tags]
    assert HOSTILE in page.texts


def test_the_page_refers_to_nothing_outside(c3d: Environment) -> None:
    page = Tags(text(run_in_c3d(c3d, row("p", 0, "TIMEOUT", solve_s=5.0))))
    for tag, attributes in page.tags:
        assert "src" not in attributes, tag
        assert (attributes.get("href") or "#").startswith("#"), tag
        assert tag not in ("link", "img", "iframe", "object"), tag


def test_a_problem_that_nobody_solved_has_its_start_and_goal(c3d: Environment) -> None:
    run = run_in_c3d(c3d, row("p", 1, "TIMEOUT", solve_s=5.0))
    [problem_set] = problem_sets_of(run)
    problem = problems_data(problem_set, columns(run))["problems"][1]
    made = c3d.sample_problems(2, 0)[1]
    assert np.allclose([problem["start"], problem["goal"]], [[made.start], [made.goal]])


def test_refused_paths_have_a_mark_and_verified_ones_have_none(c3d: Environment) -> None:
    path = through(c3d.obstacles[0], c3d)  # type: ignore[arg-type]
    rows = [row("good", 0, "VALID", path=path), row("bad", 0, "COLLISION", path=path)]
    run = run_in_c3d(c3d, *rows)
    [problem_set] = problem_sets_of(run)
    good, bad = problems_data(problem_set, columns(run))["problems"][0]["attempts"]
    assert "contact" not in good
    [curve] = bad["contact"]["drawn"]["curves"]
    mark = unpacked(curve, -1, 3)
    beyond = [np.abs(mark[0] - b.center) - b.sides / 2 for b in c3d.obstacles]  # type: ignore[union-attr]
    nearest = np.argmin([np.linalg.norm(np.maximum(gap, 0)) for gap in beyond])
    assert bad["contact"]["text"].endswith(f" units of obstacle {nearest + 1} (a box)")
    assert np.allclose(mark, along(c3d.space, path, np.array([bad["contact"]["share"]])), atol=0.02)


@pytest.mark.parametrize("env", ["c3d", "c3d:scene=-1"])
def test_a_scene_that_is_not_what_it_was_is_not_shown(env: str) -> None:
    run = recorded([row("p", 0, "VALID", solve_s=1.0, path=np.zeros((2, 3)), env=env)])
    [problem_set] = problem_sets_of(run)
    data = problems_data(problem_set, columns(run))
    assert data["scene"] is None
    assert data["why"].startswith("The scene cannot be shown: ")
    assert data["problems"][0]["attempts"][0]["texts"][0] == "1.0000"
    json.dumps(data, allow_nan=False)


def test_settings_machines_and_costs_are_said() -> None:
    run = recorded([row("p", 0, "VALID", solve_s=1.0, setup_s=12.5, train_s=100.25)])
    [session] = run.sessions
    place = {"machine": {"processor": "a <slow> one"}, "versions": {"numpy": "2.0"}, "git": None}
    there = RunResults(run.folders, run.selections, run.records, ({**session, **place},))
    words = " ".join(Tags(text(there)).texts)
    for said in ("a <slow> one", "versions numpy", "12.50", "100.25", "112.75", "time limit s"):
        assert said in words
