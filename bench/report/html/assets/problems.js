"use strict";
// The grid of problems and the page of one: its scene, the scene's controls, the attempts.

const KINDS = {
  VALID: ["good", "✓"], TIMEOUT: ["late", "◷"], LATE: ["late", "◷"], KILLED: ["late", "◷"],
  APPROXIMATE_SOLUTION: ["late", "≈"], UNSUPPORTED: ["none", "–"], SKIPPED: ["none", "–"],
};
const SIGNS = {
  circle: "●", square: "■", diamond: "◆", "circle-open": "○", "square-open": "□", "diamond-open": "◇",
};
const CUT_ABOVE_PATHS = 1; // where a building is cut open, in its unit

function chip(outcome) {
  const [kind, sign] = KINDS[outcome] ?? ["bad", "✕"];
  const words = outcome.toLowerCase().replaceAll("_", " ");
  return element("span", { class: `chip ${kind}` }, `${sign} ${words}`);
}

function named(who) {
  const swatch = element("span", { class: "swatch", "aria-hidden": true }, SIGNS[who.symbol]);
  swatch.style.color = colourOf(who);
  return [swatch, who.name];
}

const addressOf = (problemSet, problem) => `#${new URLSearchParams({ env: problemSet.title, problem })}`;

function fillGrid(place) {
  const problemSet = report.problem_sets[place.dataset.problemSet];
  const head = problemSet.planners.map((n) => element("th", { scope: "col" }, ...named(report.planners[n])));
  const rows = problemSet.problems.map((problem, row) => {
    const link = element("a", { href: addressOf(problemSet, problem) }, `${problem}`);
    const outcomes = problemSet.outcomes[row];
    const made = element("tr", { "data-solved": outcomes.every((word) => word === "VALID") },
      element("th", { scope: "row" }, link),
      ...outcomes.map((word) => element("td", {}, word === null ? "" : chip(word))));
    made.addEventListener("click", (event) => event.target === link || link.click());
    return made;
  });
  const title = element("tr", {}, element("th", { scope: "col" }, "problem"), ...head);
  const body = element("tbody", {}, ...rows);
  place.querySelector(".grid").append(element("thead", {}, title), body);
  place.querySelector(".failed-only").addEventListener("change", ({ target }) => {
    for (const row of rows) row.hidden = target.checked && "solved" in row.dataset;
  });
}

const packages = new Map();

/** What a problem set's problems show; unpacked when the first of them is chosen. */
function packageOf(number) {
  if (!packages.has(number)) {
    packages.set(number, unpacked(`package-${number}`).then((text) => {
      const data = JSON.parse(text);
      return { ...data, scene: data.scene && sceneOf(data.scene) };
    }));
  }
  return packages.get(number);
}

/** A page of a problem, until another one is shown. */
class ProblemPage {
  constructor(problemSet, number, { scene, problems, why }) {
    this.problemSet = problemSet;
    this.number = number;
    this.problem = problems[number];
    this.scene = sceneOfProblem(scene, this.problem);
    this.why = why;
    this.attempts = this.problem.attempts.map((attempt) => ({
      ...attempt, who: report.planners[problemSet.planners[attempt.planner]], shown: true,
    }));
    this.drawn = this.attempts.filter((attempt) => attempt.drawn);
    this.followed = this.drawn[0] ?? null;
    this.posture = 8;
    this.touching = false;
    this.cut = scene && scene.enclosed ? this.heightOfPaths() + CUT_ABOVE_PATHS : null;
  }

  heightOfPaths() {
    const { start, goal } = this.problem;
    const ends = [...start, ...goal].map(([, , z]) => z);
    const paths = this.drawn.flatMap(({ drawn }) => curvesOf(drawn).map(([, , z]) => z));
    return [...ends, ...paths.flat()].reduce((a, b) => Math.max(a, b));
  }

  /** What plotly draws. */
  traces() {
    const { scene } = this;
    const meshes = this.cut === null ? scene.meshes : scene.meshes.map((m) => cutAt(m, this.cut));
    const look = { color: themed("--obstacle"), opacity: scene.enclosed ? 1 : 0.45, meta: "scene" };
    const shown = this.drawn.filter((attempt) => attempt.shown);
    const followed = scene.links.length && shown.includes(this.followed) ? this.followed : null;
    return [
      surface(meshes, look),
      ...(followed ? robotTraces(scene, followed, followed.who, this.posture, this.touching) : []),
      ...shown.map((attempt) => pathTrace(attempt, attempt.who)),
      ...shown.filter(({ contact }) => contact).map((attempt) => markTrace(attempt, attempt.who, scene)),
      ...endTraces(this.problem),
    ];
  }

  async draw() {
    if (!this.scene) return;
    const Plotly = await plotly();
    if (shownPage !== this) return;
    const layout = sceneLayout(this.scene, `${this.problemSet.title} ${this.number}`);
    await Plotly.react(byId("view"), this.traces(), layout, {
      ...MODE_BAR, modeBarButtonsToRemove: ["tableRotation", "resetCameraLastSave3d"],
    });
    byId("view").dataset.problem = this.number;
  }

  show() {
    const { problemSet, number } = this;
    byId("problem-title").textContent = `${problemSet.title}, problem ${number}`;
    const at = problemSet.problems.indexOf(number);
    for (const [id, other] of [["previous", at - 1], ["next", at + 1]]) {
      byId(id).hidden = !(other in problemSet.problems);
      byId(id).href = addressOf(problemSet, problemSet.problems[other]);
    }
    byId("up").href = `#environment-${report.problem_sets.indexOf(problemSet)}`;
    byId("stage").hidden = !this.scene;
    byId("problem-note").textContent = this.note();
    byId("scene-controls").replaceChildren(...this.controls());
    byId("attempts").replaceChildren(...this.rows());
    byId("view").removeAttribute("data-problem");
    return this.draw();
  }

  note() {
    if (!this.scene) return this.why;
    const way = this.scene.links.length ? `Lines follow the ${this.scene.followed}. ` : "";
    const cross = this.drawn.some(({ contact }) => contact)
      ? "A cross marks where a path first collides; refused paths are dashed. " : "";
    const few = isSimplified(this.scene) ? "The scene is simplified for display; the judge's is not. " : "";
    return `${way}${cross}${few}Drag to turn, scroll or pinch to zoom. Paths are drawn to within `
      + `${report.tolerance} of the world's side.`;
  }

  controls() {
    if (!this.scene) return [];
    return [...this.cutControls(), ...(this.scene.links.length && this.followed ? this.robotControls() : [])];
  }

  cutControls() {
    if (this.cut === null) return [];
    const [low, high] = [this.scene.lower[2], this.scene.upper[2] + 0.5];
    const range = slider("cut", low, high, 0.05, this.cut, (value) => this.change({ cut: value }));
    return [element("label", { for: "cut" }, "Cut open at height", range)];
  }

  robotControls() {
    const options = this.drawn.map(({ who }, n) => element("option", { value: n }, who.name));
    const chosen = element("select", { id: "followed" }, ...options);
    const touch = element("button", { type: "button" }, "Show where it collides");
    const toTouch = () => { touch.hidden = !this.followed.contact; };
    chosen.addEventListener("change", () => {
      this.change({ followed: this.drawn[chosen.value], touching: false });
      toTouch();
    });
    touch.addEventListener("click", () => this.change({ touching: true }));
    toTouch();
    const last = numbersOf(this.followed.drawn.postures).length / (12 * this.scene.links.length) - 1;
    const follow = (posture) => this.change({ posture, touching: false });
    const range = slider("posture", 0, last, 1, this.posture, follow);
    return [
      element("label", { for: "followed" }, "Robot along the path of", chosen),
      element("label", { for: "posture" }, "from start to goal", range), touch,
    ];
  }

  change(state) {
    Object.assign(this, state);
    return this.draw();
  }

  rows() {
    const titles = ["planner", "outcome", ...report.columns];
    const head = element("tr", {}, ...titles.map((title) => {
      const number = report.columns.includes(title) && "number";
      return element("th", { scope: "col", class: number }, title);
    }));
    return [element("thead", {}, head), element("tbody", {}, ...this.attempts.flatMap((a) => this.rowsOf(a)))];
  }

  /** An attempt's numbers, and below them what went wrong. */
  rowsOf(attempt) {
    const { contact, error } = attempt;
    const where = contact
      && `first collides after ${(100 * contact.share).toFixed(1)} % of its length: ${contact.text}`;
    const why = [error, where].filter(Boolean).join("\n");
    const numbers = element("tr", { class: why && "explained" },
      element("th", { scope: "row" }, this.shownBox(attempt)),
      element("td", {}, chip(attempt.outcome)),
      ...attempt.texts.map((text) => element("td", { class: "number" }, text)));
    if (!why) return [numbers];
    const words = element("pre", { class: "why", tabindex: 0 }, why);
    const span = numbers.cells.length;
    return [numbers, element("tr", {}, element("td", { colspan: span }, words))];
  }

  /** A planner's name, with a box that hides its path if there is one. */
  shownBox(attempt) {
    if (!attempt.drawn) return element("span", {}, ...named(attempt.who));
    const box = element("input", { type: "checkbox", checked: true, class: "control" });
    box.addEventListener("change", () => {
      attempt.shown = box.checked;
      this.draw();
    });
    return element("label", {}, box, " ", ...named(attempt.who));
  }
}

function slider(id, min, max, step, value, follow) {
  const range = element("input", { type: "range", id, min, max, step, value });
  range.addEventListener("input", () => follow(Number(range.value)));
  return range;
}

let shownPage = null;

async function showProblem(number, problem) {
  const data = await packageOf(number);
  shownPage = new ProblemPage(report.problem_sets[number], problem, data);
  await shownPage.show();
}
