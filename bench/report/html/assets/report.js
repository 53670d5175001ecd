"use strict";
// What the address says is shown: the overview, or a problem's page.

/** The problem set's number and the problem that an address like #env=c3d&problem=3 names, or null. */
function chosenProblem() {
  const words = new URLSearchParams(location.hash.slice(1));
  const number = report.problem_sets.findIndex(({ title }) => title === words.get("env"));
  const problem = Number(words.get("problem"));
  const known = number >= 0 && words.has("problem") && report.problem_sets[number].problems.includes(problem);
  return known ? { number, problem } : null;
}

let left = 0; // how far down the overview was when it was left

async function follow() {
  const chosen = chosenProblem();
  const overview = byId("overview");
  const header = document.querySelector("header.page");
  if (chosen && !overview.hidden) left = scrollY;
  const returns = !chosen && overview.hidden;
  overview.hidden = header.hidden = chosen !== null;
  byId("problem").hidden = chosen === null;
  if (chosen) {
    scrollTo({ top: 0, behavior: "instant" });
    await showProblem(chosen.number, chosen.problem);
    byId("problem-title").focus({ preventScroll: true });
    return;
  }
  shownPage = null;
  if (returns) scrollTo({ top: left, behavior: "instant" });
  await drawCharts();
}

document.querySelectorAll("table.sortable").forEach(makeSortable);
document.querySelectorAll("[data-problem-set]").forEach(fillGrid);
followSurroundings();
isDark.addEventListener("change", () => shownPage && shownPage.draw());
addEventListener("hashchange", follow);
performance.mark("interactive");
follow();
