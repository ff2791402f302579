"use strict";
// What the page holds: data as numbers, colours as the style sheet has them, small pieces of DOM.
// Foreign text is only ever set as textContent or drawn on a canvas.

const data = JSON.parse(document.getElementById("page-data").textContent);

/** Return a packed column as an array of n numbers, null where unknown. */
function column(packed, n) {
  if ("c" in packed) return new Array(n).fill(packed.c);
  const bytes = Uint8Array.from(atob(packed.i ?? packed.f), (c) => c.charCodeAt(0));
  if ("i" in packed) return Array.from(new Int16Array(bytes.buffer));
  const base = packed.b ?? 0;
  return Array.from(new Float32Array(bytes.buffer), (v) => (Number.isNaN(v) ? null : v + base));
}

const decoded = new Map(); // of channels by name, and of times by the key of their message, a space before

/** Return the message and the field of a channel's name; a damaged log may have points in either. */
function keyOf(name) {
  for (let dot = name.indexOf("."); dot >= 0; dot = name.indexOf(".", dot + 1)) {
    const key = name.slice(0, dot), own = name.slice(dot + 1);
    if (Object.hasOwn(data.messages, key) && Object.hasOwn(data.messages[key].f, own)) return [key, own];
  }
  throw new Error(`${name} is no channel of this page`);
}

/** Return a channel of the log as {t, v, unit, stepped}; each is decoded once. */
function channel(name) {
  if (decoded.has(name)) return decoded.get(name);
  const [key, own] = keyOf(name);
  const message = data.messages[key];
  const field = message.f[own];
  if (!decoded.has(` ${key}`)) decoded.set(` ${key}`, column(message.t, message.k));
  const found = { t: decoded.get(` ${key}`), v: column(field, message.k), unit: field.u, stepped: !!field.s };
  decoded.set(name, found);
  return found;
}

/** Return how far apart, s, two records may be between which none is missing. */
function longestStep(t) {
  const steps = [];
  for (let i = 1; i < t.length; i++) steps.push(t[i] - t[i - 1]);
  steps.sort((a, b) => a - b);
  return Math.max(2, 5 * (steps[steps.length >> 1] ?? 0));
}

/** Return times and values with an unknown value put where records are missing for long. */
function broken(t, v) {
  const most = longestStep(t);
  if (!t.some((one, i) => i && one - t[i - 1] > most)) return [t, v];
  const times = [], values = [];
  for (let i = 0; i < t.length; i++) {
    if (i && t[i] - t[i - 1] > most) { times.push((t[i] + t[i - 1]) / 2); values.push(null); }
    times.push(t[i]); values.push(v[i]);
  }
  return [times, values];
}

/** Return a colour of the style sheet, as it is on this ground; asked for once, since a pan asks a
 *  thousand times a frame. */
const inks = new Map();
function colour(name) {
  if (!inks.has(name)) inks.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return inks.get(name);
}

function element(tag, text, classes) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (classes) made.className = classes;
  return made;
}

/** Return what a dotted path names in the data; keys may hold one dot ("finding.0"). */
function panelAt(place) {
  const part = place.split(".");
  if (part[0] === "overview") return data.overview[+part[1]];
  const held = data.cases[`${part[1]}.${part[2]}`];
  if (part[3] === "sized") return held.sized[+part[4]];
  return part[3] === "context" ? data.overview[held.context[+part[4]]] : held.tests[+part[4]][+part[5]];
}

/** Return the last place in ascending times that is not after t, or 0. */
function before(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

function modeAt(t) {
  return data.modes.findLast((mode) => mode[0] <= t && t <= mode[1])?.[2] ?? "";
}

const modeNames = [...new Set(data.modes.map((mode) => mode[2]))];
