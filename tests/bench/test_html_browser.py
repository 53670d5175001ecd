"""The HTML report as a reader meets it, in a real browser without a window."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from html_pages import (
    Watched,
    charts_are_drawn,
    column,
    go,
    scene_is_drawn,
    sort_by,
    traces,
)
from html_reports import (
    HOSTILE,
    PLANNERS,
    PROBLEMS,
    run_in_c3d,
    run_in_cubes,
    six_by_hundred,
)
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright
from records import recorded, row

import envs
from bench.report import html
from envs import Environment, Spec

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed"),
]

MOST_MEGABYTES = 10
OPENS_WITHIN_MS = 2000
WHITE = "rgb(255, 255, 255)"
PATIENCE_MS = 60_000  # a busy machine draws 3-D by its processor

Open = Callable[..., Page]


@pytest.fixture(scope="module")
def watched() -> Watched:
    return Watched()


@pytest.fixture(autouse=True)
def nothing_goes_wrong(watched: Watched) -> Iterator[None]:
    """No page has an error, or asks for anything besides its file."""
    yield
    assert watched.errors == []
    assert watched.requests == watched.opened


@pytest.fixture(scope="module")
def report(c3d: Environment, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("report") / "report.html"
    html.write(six_by_hundred(c3d), file)
    return file


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield started
        started.close()


@pytest.fixture(scope="module")
def opened(browser: Browser, report: Path, watched: Watched) -> Open:
    """Opens the report: at an address within it, and with a page's options."""

    def open_(address: str = "", file: Path = report, **options: Any) -> Page:
        page = browser.new_page(**options)
        page.set_default_timeout(PATIENCE_MS)
        watched.watch(page)
        watched.opened.append(file.as_uri())
        page.goto(file.as_uri() + address)
        return page

    return open_


@pytest.fixture(scope="module")
def drawn(opened: Open) -> Page:
    """The overview with its charts, opened once; see `overview`."""
    page = opened()
    charts_are_drawn(page)
    return page


@pytest.fixture
def overview(drawn: Page) -> Page:
    """The overview with its charts, wherever an earlier test had gone."""
    go(drawn, "")
    return drawn


def test_the_report_is_small_enough_to_send(report: Path) -> None:
    assert report.stat().st_size < MOST_MEGABYTES * 1e6


def test_the_report_opens_within_two_seconds(opened: Open) -> None:
    taken = []
    for _ in range(3):
        page = opened()
        taken.append(page.evaluate("performance.getEntriesByName('interactive')[0].startTime"))
        page.close()
    assert min(taken) < OPENS_WITHIN_MS, "the best of three, on a machine that may be busy"


def test_the_summary_is_sorted_by_any_column(overview: Page) -> None:
    assert column(overview, "planner") == list(PLANNERS)
    for title in ("time s", "success %", "length units"):
        assert sort_by(overview, title) == "ascending"
        means = [float(words.split()[0]) for words in column(overview, title)]
        assert means == sorted(means)
        assert sort_by(overview, title) == "descending"
        means = [float(words.split()[0]) for words in column(overview, title)]
        assert means == sorted(means, reverse=True)
    assert overview.locator("#summary th[aria-sort='descending']").count() == 1
    overview.locator("#summary th", has_text="planner").first.get_by_role("button").focus()
    overview.keyboard.press("Enter")
    assert column(overview, "planner") == sorted(PLANNERS)


def test_the_charts_show_every_planner(overview: Page) -> None:
    names = (
        "chart => chart._fullData.filter(one => one.showlegend || one.type === 'box')"
        ".map(one => one.name)"
    )
    for chart in ("[data-chart='solved']", *(f"[data-metric='{n}']" for n in range(3))):
        assert overview.eval_on_selector(chart, names) == list(PLANNERS)
    assert set(overview.eval_on_selector("[data-chart='costs']", names)) == {"rrtstar"}
    ends = overview.eval_on_selector(
        "[data-chart='solved']", "chart => chart._fullData.map(one => Array.from(one.y).at(-1))"
    )
    assert ends == [0.8] * len(PLANNERS), "failures are never solved"


def test_problems_that_some_planner_failed_can_be_picked_out(overview: Page) -> None:
    rows = overview.locator(".grid tbody tr:visible")
    assert rows.count() == PROBLEMS
    overview.locator(".failed-only").check()
    assert 0 < rows.count() < PROBLEMS
    assert all(any(w in t for w in ("timeout", "collision")) for t in rows.all_inner_texts())
    overview.locator(".failed-only").uncheck()
    assert rows.count() == PROBLEMS


def test_a_problem_shows_its_paths_and_where_they_collide(overview: Page) -> None:
    row_ = overview.locator(
        ".grid tbody tr", has=overview.get_by_role("link", name="7", exact=True)
    )
    row_.locator("td").first.click()
    scene_is_drawn(overview, 7)
    assert "problem=7" in overview.url
    assert overview.locator("#problem-title").inner_text() == "c3d, problem 7"
    # Of problem 7 the fourth planner timed out and the fifth collided.
    paths = traces(overview, "path")
    assert [path["name"] for path in paths] == [p for p in PLANNERS if p != "mpnet"]
    assert [path["dash"] for path in paths].index("dash") == 3
    assert all(path["x"] > 2 for path in paths)
    assert [mark["name"] for mark in traces(overview, "collision")] == ["rrtstar collides"]
    assert len(traces(overview, "start")) == len(traces(overview, "goal")) == 1
    attempts = overview.locator("#attempts").inner_text()
    assert all(words in attempts for words in ("no path in 5 s", "timeout", "first collides after"))
    assert "% of its length: the robot comes within" in attempts


def test_a_path_can_be_hidden(overview: Page) -> None:
    go(overview, "#env=c3d&problem=5")
    scene_is_drawn(overview, 5)
    before = len(traces(overview, "path"))
    overview.locator("#attempts input[type=checkbox]").first.uncheck()
    overview.wait_for_function(
        "n => byId('view')._fullData.filter(one => one.meta === 'path').length === n",
        arg=before - 1,
    )
    assert PLANNERS[0] not in [path["name"] for path in traces(overview, "path")]


def test_back_and_forward_lead_where_they_should(overview: Page) -> None:
    overview.get_by_role("link", name="3", exact=True).click()
    scene_is_drawn(overview, 3)
    overview.locator("#next").click()
    scene_is_drawn(overview, 4)
    overview.go_back()
    scene_is_drawn(overview, 3)
    assert overview.locator("#problem-title").inner_text() == "c3d, problem 3"
    overview.go_back()
    overview.wait_for_selector("#summary", state="visible")
    assert not overview.locator("#problem").is_visible()


@pytest.mark.parametrize("address", ["#env=c3d&problem=1000", "#env=no&problem=1", "#env=c3d"])
def test_an_address_that_names_no_problem_leads_to_the_overview(
    overview: Page, address: str
) -> None:
    overview.evaluate("address => { location.hash = address; }", address)
    assert overview.locator("#summary").is_visible()
    assert not overview.locator("#problem").is_visible()


def test_the_page_follows_the_theme(overview: Page) -> None:
    paper = "getComputedStyle(document.body).backgroundColor"
    for scheme, colour in (("dark", "rgb(20, 23, 29)"), ("light", "rgb(255, 255, 255)")):
        overview.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        assert overview.evaluate(paper) == colour


def test_on_paper_there_is_all_but_the_controls(overview: Page) -> None:
    overview.emulate_media(media="print", color_scheme="dark")
    assert overview.locator(".control:visible").count() == 0
    assert overview.locator(".browser:visible").count() == 0
    assert overview.locator("#summary table:visible").count() == 3
    assert overview.locator(".chart .main-svg:visible").count() >= 5
    assert overview.evaluate("getComputedStyle(document.body).backgroundColor") == WHITE
    assert overview.pdf(format="A4").startswith(b"%PDF")
    overview.emulate_media(media="screen", color_scheme="light")


def test_a_link_to_a_problem_opens_it_and_its_scene_is_painted(opened: Open) -> None:
    page = opened("#env=c3d&problem=7")
    scene_is_drawn(page, 7)
    page.wait_for_timeout(500)  # a frame or two
    picture = Image.open(BytesIO(page.locator("#view").screenshot())).convert("RGB")
    colours = picture.getcolors(picture.width * picture.height)
    assert colours is not None
    assert len(colours) > 200
    assert max(count for count, _ in colours) < 0.95 * picture.width * picture.height
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_needs_no_sideways_scrolling(opened: Open, scheme: str) -> None:
    page = opened(viewport={"width": 375, "height": 812}, color_scheme=scheme)
    charts_are_drawn(page)
    for address in ("", "#env=c3d&problem=7"):
        go(page, address)
        if address:
            scene_is_drawn(page, 7)
        for of in ("documentElement", "body"):
            assert page.evaluate(f"document.{of}.scrollWidth") <= 375
    page.close()


def test_names_and_errors_are_only_words(opened: Open, c3d: Environment, tmp_path: Path) -> None:
    path = np.array([c3d.lower + 1, c3d.upper - 1])
    rows = [
        row(HOSTILE, 0, "ERROR", error=HOSTILE),
        row(HOSTILE, 1, "VALID", path=path, solve_s=0.1, length=1.0, safety_margin=1.0),
    ]
    file = tmp_path / "report.html"
    html.write(run_in_c3d(c3d, *rows), file)
    page = opened(file=file)
    charts_are_drawn(page)
    assert HOSTILE in column(page, "planner")
    page.get_by_role("link", name="0", exact=True).click()
    scene_is_drawn(page, 0)
    assert page.locator("#attempts .why").inner_text() == HOSTILE
    page.locator("#next").click()
    scene_is_drawn(page, 1)
    assert len(traces(page, "path")) == 1
    assert page.evaluate("document.hacked ?? null") is None
    page.close()


def test_a_robot_is_followed_at_each_of_its_points(opened: Open, tmp_path: Path) -> None:
    envs.REGISTRY.register(Spec("cubes", "turning_cubes:Plane", "two cubes that turn in a plane"))
    try:
        html.write(run_in_cubes(envs.make("cubes")), tmp_path / "report.html")
    finally:
        envs.REGISTRY.unregister("cubes")
    page = opened(file=tmp_path / "report.html", address="#env=cubes&problem=1")
    scene_is_drawn(page, 1)
    [path], [mark] = traces(page, "path"), traces(page, "collision")
    assert path["x"] == 2 + 1 + 2, "two straight curves, and a gap"
    assert mark["x"] == 2 * 12, "two crosses"
    assert [one["x"] for one in traces(page, "start") + traces(page, "goal")] == [2, 2]
    assert traces(page, "posture")[0]["x"] == 2 * 8, "two cubes"
    assert "Lines follow the middles of the cubes." in page.locator("#problem-note").inner_text()
    page.get_by_role("button", name="Show where it collides").click()
    page.wait_for_function("byId('view')._fullData.some(one => one.color === COLLISION)")
    page.close()


def test_worlds_of_rising_difficulty_have_a_curve_for_each_planner(
    opened: Open, tmp_path: Path
) -> None:
    """With lines and bands, on an axis of the parameter's values."""
    worlds = {f"c3d:boxes={boxes}": envs.make(f"c3d:boxes={boxes}") for boxes in (1, 30, 60)}
    rows = [
        row(name, problem, outcome, env=id, env_fingerprint=world.fingerprint, solve_s=1.0)
        for place, (id, world) in enumerate(worlds.items())
        for problem in range(3)
        for name, outcome in (
            ("sure", "VALID"),
            ("less so", "VALID" if problem >= place else "TIMEOUT"),
        )
    ]
    known = [{"id": id, "fingerprint": world.fingerprint} for id, world in worlds.items()]
    html.write(recorded(rows, envs=known), tmp_path / "report.html")
    page = opened(file=tmp_path / "report.html")
    charts_are_drawn(page)
    shown = page.evaluate(
        "[...document.querySelectorAll('#difficulty .chart')].map(place => "
        "place._fullData.filter(one => one.mode === 'lines+markers')"
        ".map(one => [one.name, [...one.x], [...one.y]]))"
    )
    assert shown[0] == [
        ["sure", [1, 30, 60], [1, 1, 1]],
        ["less so", [1, 30, 60], pytest.approx([1, 2 / 3, 1 / 3], abs=1e-4)],
    ]
    assert len(shown) == page.locator("#difficulty figure").count() > 1
    page.locator("#difficulty").screenshot(path=tmp_path / "difficulty.png")
    page.close()
