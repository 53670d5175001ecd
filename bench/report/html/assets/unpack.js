"use strict";
// What Python packed, and small things that all other parts use.

const report = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);

/** An element. Texts among the children stay texts, whatever is in them. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== false && value !== null) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}

/** The text that a script element holds as the base64 of its gzip. */
function unpacked(id) {
  const bytes = bytesOf(byId(id).textContent);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

const ARRAYS = { Int16Array, Int32Array };

/** Numbers as `packing.packed` wrote them. */
function numbersOf({ type, step, data }) {
  return Float64Array.from(new ARRAYS[type](bytesOf(data).buffer), (whole) => whole * step);
}

/** Every `stride`-th of some numbers, from the first ones on: columns of a table. */
function columnsOf(numbers, stride) {
  return Array.from({ length: stride }, (_, first) =>
    Array.from({ length: numbers.length / stride }, (_, row) => numbers[row * stride + first]));
}

let loading = null;

/** The plotting library, which is unpacked and run when something is first drawn. */
function plotly() {
  loading ??= unpacked("plotly").then((source) => {
    document.head.append(element("script", {}, source));
    return window.Plotly;
  });
  return loading;
}

const isDark = matchMedia("(prefers-color-scheme: dark)");
const colourOf = (planner) => planner[isDark.matches ? "dark" : "light"];
const themed = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** A text that plotly, which takes some of HTML, shows as it is. */
const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll("%{", "%&#123;");

const MODE_BAR = { responsive: true, displaylogo: false };
