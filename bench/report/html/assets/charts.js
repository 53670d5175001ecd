"use strict";
// The curves and distributions of an environment, drawn when the page itself is there.

const WIDTH_ON_PAPER = 660; // of the narrower of A4 and Letter, in CSS pixels
const planner = (curve) => report.planners[curve.planner];

/** Steps, unless another shape is asked for. */
function lines(curves, more, shape = "hv") {
  return curves.map((curve) => ({
    x: curve.x, y: curve.y, name: plain(planner(curve).name), mode: "lines",
    line: { color: colourOf(planner(curve)), dash: planner(curve).dash, width: 2, shape },
    ...more,
  }));
}

/** The area between both ends of an interval; where the upper one is infinite there is none. */
function band({ planner: number, x, low, high }) {
  const known = [...x.keys()].filter((i) => low[i] !== null && high[i] !== null);
  const back = [...known].reverse();
  return {
    x: [...known, ...back].map((i) => x[i]),
    y: [...known.map((i) => low[i]), ...back.map((i) => high[i])],
    fill: "toself", mode: "none", fillcolor: colourOf(report.planners[number]), opacity: 0.16,
    hoverinfo: "skip", showlegend: false,
  };
}

/** Where half of a planner's attempts had a first solution. */
function firsts(curves) {
  return curves.filter((curve) => curve.first.length).map((curve) => ({
    x: [curve.first[0]], y: [curve.first[1]], name: plain(planner(curve).name), mode: "markers",
    marker: { symbol: "circle", size: 9, color: colourOf(planner(curve)) }, showlegend: false,
    hovertemplate: "first solution by %{x:.3~g} s",
  }));
}

function spreads(curves) {
  return curves.map((curve) => ({
    type: "box", x: curve.values, name: plain(planner(curve).name), orientation: "h",
    boxpoints: curve.values.length > 500 ? "outliers" : "all", jitter: 0.6, pointpos: 0,
    marker: { size: 3, opacity: 0.45, color: colourOf(planner(curve)) },
    line: { width: 1.4, color: colourOf(planner(curve)) }, hoverinfo: "x",
  }));
}

/** A logarithmic axis for some times: a label a decade, or more where there are few decades. */
function seconds(curves, of) {
  const times = curves.flatMap((curve) => curve[of]);
  const decades = Math.log10(times.reduce((a, b) => Math.max(a, b), 0) / times.reduce((a, b) => Math.min(a, b), Infinity));
  return { title: { text: "seconds" }, type: "log", tickformat: "~g", dtick: decades > 1.5 ? 1 : "D2" };
}

const SIDEWAYS = { autorange: "reversed", automargin: true, fixedrange: true };
const CHARTS = {
  solved: (problemSet) => [
    lines(problemSet.solved, { hovertemplate: "%{y:.1%} by %{x:.3~g} s" }),
    { xaxis: seconds(problemSet.solved, "x"), yaxis: { title: { text: "share solved" }, range: [-0.02, 1.02], tickformat: ".0%" } },
  ],
  costs: (problemSet) => [
    [...problemSet.costs.map(band), ...lines(problemSet.costs, { hovertemplate: "%{y:.4~g} by %{x:.3~g} s" }), ...firsts(problemSet.costs)],
    { xaxis: seconds(problemSet.costs, "x"), yaxis: { title: { text: "path length" } } },
  ],
  metric: (problemSet, place) => {
    const { title, log, curves } = problemSet.metrics[place.dataset.metric];
    const axis = log ? seconds(curves, "values") : { title: { text: title } };
    return [spreads(curves), { xaxis: axis, yaxis: SIDEWAYS, showlegend: false }];
  },
  sweep: (problemSet, place) => {
    const chart = problemSet.sweeps[place.dataset.sweep];
    const line = { x: chart.x, y: chart.y, mode: "lines+markers", line: { color: colourOf(planner(chart)), width: 2 }, showlegend: false };
    return [[band(chart), line], {
      xaxis: { title: { text: plain(chart.parameter) } },
      yaxis: { title: { text: plain(chart.axis) }, type: chart.log ? "log" : "linear" },
    }];
  },
  difficulty: (_, place) => {
    const { x, curves, parameter, axis, log } = report.difficulty[place.dataset.difficulty];
    const placed = curves.map((curve) => ({ ...curve, x }));
    const marked = { mode: "lines+markers", hovertemplate: "%{y:.4~g} at %{x:.4~g}" };
    return [[...placed.map(band), ...lines(placed, marked, "linear")], {
      xaxis: { title: { text: plain(parameter) } },
      yaxis: { title: { text: plain(axis) }, type: log ? "log" : "linear" },
    }];
  },
};

async function drawChart(place) {
  const Plotly = await plotly();
  const section = place.closest("[data-problem-set]"); // none of charts of the whole report
  const problemSet = section && report.problem_sets[section.dataset.problemSet];
  const [traces, layout] = CHARTS[place.dataset.chart](problemSet, place);
  const axis = { gridcolor: "#888", zeroline: false, showline: false };
  await Plotly.react(place, traces, {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", autosize: true,
    height: layout.showlegend === false ? 120 + 34 * Math.max(traces.length, 4) : 400,
    margin: { l: 56, r: 12, t: 8, b: 44 }, dragmode: false,
    font: { family: "system-ui, sans-serif", size: 12 },
    showlegend: true, legend: { orientation: "h", y: -0.2, yanchor: "top" },
    hoverlabel: { namelength: -1 },
    ...layout,
    xaxis: { ...axis, ...layout.xaxis }, yaxis: { ...axis, ...layout.yaxis },
  }, { ...MODE_BAR, displayModeBar: false });
  place.dataset.drawn = "yes";
}

const allCharts = () => [...document.querySelectorAll(".chart")];
const drawnCharts = () => allCharts().filter((place) => place.dataset.drawn);
const whenIdle = () => new Promise((resolve) => (window.requestIdleCallback ?? setTimeout)(resolve));

/** Draws the charts one by one, so that the page answers in between; what is hidden has no width
 *  to be drawn in and waits for the next call. */
async function drawCharts() {
  for (const place of allCharts()) {
    await whenIdle();
    if (!place.dataset.drawn && place.offsetWidth) await drawChart(place);
  }
  performance.mark("charts");
}

/** Colours follow the theme; on paper charts are as wide as the page. */
function followSurroundings() {
  isDark.addEventListener("change", () => drawnCharts().forEach(drawChart));
  addEventListener("beforeprint", () => {
    drawnCharts().forEach((place) => window.Plotly.relayout(place, { width: WIDTH_ON_PAPER }));
  });
  addEventListener("afterprint", () => {
    drawnCharts().forEach((place) => window.Plotly.relayout(place, { width: null, autosize: true }));
  });
}
