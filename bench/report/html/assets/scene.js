"use strict";
// A problem's scene in 3-D: obstacles, each planner's path, start and goal, collisions, robots.

const START = "#2f6fd0";
const GOAL = "#1f9a62";
const COLLISION = "#e0352b";
const SYMBOLS_ON_PATH = 5;
const MARK = 0.02; // half a cross, by the scene's longest side
const DIAGONALS = [[1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]];

/** A surface as plotly takes it, with its corners moved by `move` if there is one. */
function surface(meshes, look) {
  const [x, y, z, i, j, k] = [[], [], [], [], [], []];
  for (const { vertices, faces } of meshes) {
    const offset = x.length;
    for (let n = 0; n < vertices.length; n += 3) {
      x.push(vertices[n]); y.push(vertices[n + 1]); z.push(vertices[n + 2]);
    }
    for (let n = 0; n < faces.length; n += 3) {
      i.push(offset + faces[n]); j.push(offset + faces[n + 1]); k.push(offset + faces[n + 2]);
    }
  }
  return {
    type: "mesh3d", x, y, z, i, j, k, hoverinfo: "skip", flatshading: true,
    lighting: { ambient: 0.72, diffuse: 0.6, specular: 0.05, roughness: 0.9, facenormalsepsilon: 0 },
    lightposition: { x: 3000, y: -6000, z: 20000 }, ...look,
  };
}

/** A mesh of a package with its arrays as numbers. */
const meshOf = ({ vertices, faces, many }) =>
  ({ vertices: numbersOf(vertices), faces: numbersOf(faces), many });

/** A scene of a package, the same way. */
function sceneOf(packed) {
  return { ...packed, meshes: packed.meshes.map(meshOf), links: packed.links.map(meshOf) };
}

/** The scene of a problem, which may have obstacles of its own. */
function sceneOfProblem(scene, { obstacles }) {
  if (!scene || !obstacles) return scene;
  return { ...scene, meshes: [meshOf(obstacles), ...scene.meshes.slice(1)] };
}

const isSimplified = (scene) =>
  [...scene.meshes, ...scene.links].some(({ faces, many }) => faces.length < 3 * many);

/** What of a surface is below a height: that of faces' highest corners. */
function cutAt(mesh, height) {
  const { vertices, faces } = mesh;
  const heightOf = (n) => vertices[3 * faces[n] + 2];
  const kept = [];
  for (let n = 0; n < faces.length; n += 3) {
    if (Math.max(heightOf(n), heightOf(n + 1), heightOf(n + 2)) <= height) {
      kept.push(faces[n], faces[n + 1], faces[n + 2]);
    }
  }
  return { vertices, faces: kept };
}

/** The links of a robot in one of a path's postures, (postures, links, 3, 4) as a flat list. */
function posed(links, postures, which) {
  return links.map(({ vertices, faces }, link) => {
    const pose = postures.subarray(12 * (which * links.length + link));
    const moved = new Float64Array(vertices.length);
    for (let n = 0; n < vertices.length; n += 3) {
      for (let axis = 0; axis < 3; axis += 1) {
        const row = 4 * axis;
        moved[n + axis] = pose[row] * vertices[n] + pose[row + 1] * vertices[n + 1]
          + pose[row + 2] * vertices[n + 2] + pose[row + 3];
      }
    }
    return { vertices: moved, faces };
  });
}

/** Sizes of the symbols at a path's points: some far apart get one. */
function symbolSizes([x, y, z]) {
  const lengths = [0];
  for (let n = 1; n < x.length; n += 1) {
    lengths.push(lengths[n - 1] + Math.hypot(x[n] - x[n - 1], y[n] - y[n - 1], z[n] - z[n - 1]));
  }
  const sizes = lengths.map(() => 0);
  for (let part = 1; part <= SYMBOLS_ON_PATH; part += 1) {
    const wanted = (lengths.at(-1) * part) / (SYMBOLS_ON_PATH + 1);
    const at = lengths.findIndex((length) => length >= wanted);
    if (at > 0 && at < x.length - 1) sizes[at] = 5;
  }
  return sizes;
}

/** The coordinates of a path's curves: of a robot that is followed at several points one each. */
const curvesOf = ({ curves }) => curves.map((curve) => columnsOf(numbersOf(curve), 3));

/** Lists of values as one, in which lines break from one list to the next. */
const joined = (lists, gap) => lists.flatMap((list, n) => (n ? [gap, ...list] : list));

function pathTrace(attempt, who) {
  const curves = curvesOf(attempt.drawn);
  const [x, y, z] = [0, 1, 2].map((axis) => joined(curves.map((curve) => curve[axis]), null));
  const colour = colourOf(who);
  return {
    type: "scatter3d", mode: "lines+markers", x, y, z, name: plain(who.name), meta: "path",
    line: { color: colour, width: 6, dash: attempt.outcome === "VALID" ? "solid" : "dash" },
    marker: { color: colour, size: joined(curves.map(symbolSizes), 0), symbol: who.symbol, line: { width: 0 } },
    hovertemplate: `${plain(who.name)} (${plain(attempt.outcome)})<extra></extra>`,
  };
}

/** A cross of lines, as fonts need not have the letters that plotly takes for one. */
function markTrace(attempt, who, { lower, upper }) {
  const middles = attempt.contact.drawn.curves.map(numbersOf);
  const arm = MARK * Math.max(...upper.map((high, axis) => high - lower[axis]));
  const [x, y, z] = [0, 1, 2].map((axis) => middles.flatMap((middle) =>
    DIAGONALS.flatMap((diagonal) =>
      [middle[axis] - arm * diagonal[axis], middle[axis] + arm * diagonal[axis], null])));
  return {
    type: "scatter3d", mode: "lines", x, y, z, meta: "collision",
    name: plain(`${who.name} collides`), hovertemplate: `${plain(who.name)} collides<extra></extra>`,
    line: { color: COLLISION, width: 9 },
  };
}

function endTraces({ start, goal }) {
  if (!start) return [];
  return [["start", start, START, "circle"], ["goal", goal, GOAL, "diamond"]].map(
    ([text, points, color, symbol]) => ({
      type: "scatter3d", mode: "markers+text", meta: text,
      x: points.map(([x]) => x), y: points.map(([, y]) => y), z: points.map(([, , z]) => z),
      text: points.map(() => text),
      textposition: "top center", textfont: { color: themed("--ink"), size: 13 },
      marker: { color, size: 7, symbol, line: { color: "#fff", width: 1 } },
      hovertemplate: `${text}<extra></extra>`,
    }));
}

/** The robot at start and goal, and on the way in the posture that is chosen. */
function robotTraces(scene, attempt, who, posture, touching) {
  const postures = numbersOf(attempt.drawn.postures);
  const last = postures.length / (12 * scene.links.length) - 1;
  const still = [[0, START], [last, GOAL]].map(([which, color]) =>
    surface(posed(scene.links, postures, which), { color, opacity: 0.35, meta: "robot" }));
  const [there, which] = touching
    ? [numbersOf(attempt.contact.drawn.postures), 0] : [postures, posture];
  const color = touching ? COLLISION : colourOf(who);
  return [...still, surface(posed(scene.links, there, which), { color, meta: "posture" })];
}

function sceneLayout(scene, uirevision) {
  const axis = {
    showbackground: false, gridcolor: themed("--rule"), zeroline: false, showspikes: false,
    color: themed("--muted"), nticks: 6, title: { text: "" },
  };
  const { offsetWidth, offsetHeight } = byId("view");
  const back = Math.max(1, 1.15 * offsetHeight / offsetWidth); // where the picture is narrow
  const [x, y, z] = scene.enclosed ? [0.25, -0.95, 1.85] : [0.95, -1.25, 0.75];
  const camera = { eye: { x: back * x, y: back * y, z: back * z }, center: { x: 0, y: 0, z: -0.12 } };
  return {
    paper_bgcolor: themed("--scene"), margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false,
    uirevision, font: { family: "system-ui, sans-serif", size: 11, color: themed("--muted") },
    scene: { aspectmode: "data", xaxis: axis, yaxis: axis, zaxis: axis, camera },
  };
}
