"""Ways to look at a page of the HTML report in a browser."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from playwright.sync_api import Page


@dataclass
class Watched:
    """What pages did, of which some must not happen."""

    opened: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def watch(self, page: Page) -> None:
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda said: said.type == "error" and self.errors.append(said.text))
        page.on("request", lambda asked: self.requests.append(asked.url))


def go(page: Page, address: str) -> None:
    """Follows an address within the report."""
    page.evaluate("address => { location.hash = address; }", address)
    page.wait_for_selector("#problem" if "problem=" in address else "#overview", state="visible")


def charts_are_drawn(page: Page) -> None:
    page.wait_for_function("performance.getEntriesByName('charts').length > 0")


def scene_is_drawn(page: Page, problem: int) -> None:
    page.wait_for_selector(f"#view[data-problem='{problem}']")


def traces(page: Page, meta: str) -> list[dict[str, Any]]:
    """The visible traces of a kind in the 3-D view."""
    found: list[dict[str, Any]] = page.evaluate(
        "meta => document.getElementById('view')._fullData"
        ".filter(one => one.visible === true && one.meta === meta)"
        ".map(one => ({name: one.name, x: one.x.length, dash: one.line?.dash}))",
        meta,
    )
    return found


def column(page: Page, title: str) -> list[str]:
    """The texts of a column of the main table."""
    number = page.locator("#summary table").first.locator("thead th").all_inner_texts()
    at = [words.strip() for words in number].index(title)
    cells = page.locator("#summary table").first.locator(f"tbody td:nth-child({at + 1}) .text")
    return cells.all_inner_texts()


def sort_by(page: Page, title: str) -> str | None:
    """Clicks on a column's title of the main table: how it is sorted then."""
    heading = page.locator("#summary table").first.locator("th", has_text=title)
    heading.get_by_role("button").click()
    return heading.get_attribute("aria-sort")
