// The map of tracks: asks once a second, draws East and North at equal scales; what came with the plots is only ever text.
import { element, write } from "./words.js";

const find = (id) => document.getElementById(id);
const map = find("map"), root = document.documentElement;
const EVERY = 1000; // ms between two questions
const SILENT = 10; // s without a plot until it is said
const LEAST = 400, MARGIN = 0.08; // m that are shown at least; of the map, about the tracks
const DATED = 1e8; // s: times beyond are Unix times
const SURE = 15; // degrees: a course of a larger deviation is not known

const HEADS = [...document.querySelectorAll("th")];

let told = null, marked = null, isFitted = true, rows = new Map();
let view = { east: 0, north: 0, scale: 0 }; // the middle, and metres in a pixel; 0 before the first track

async function ask() {
  try {
    const answer = await fetch("tracks", { signal: AbortSignal.timeout(5000) });
    if (!answer.ok) throw new Error(String(answer.status));
    told = await answer.json();
    link("live");
    draw();
  } catch (error) {
    if (told) write(find("answer"), "What is drawn is the last that was heard.");
    link("gone");
    find("answer").classList.add("alarm");
    if (!["TypeError", "TimeoutError", "AbortError"].includes(error.name) && !/^\d+$/.test(error.message)) console.error(error);
  }
  setTimeout(ask, EVERY);
}

function link(state) {
  find("link").dataset.link = state;
  write(find("link"), { live: "live", gone: "the tracker has ended, or does not answer; trying again …" }[state]);
}

// --- which part of the plane is seen ------------------------------------------------------------------------

const size = () => [map.clientWidth || 800, map.clientHeight || 500];
const shown = () => told.tracks.filter((track) => track.position.every((v) => v !== null));

function fit(tracks) {
  const places = tracks.flatMap((track) => [track.position, tip(track), ...track.trail]).filter((p) => p.every((v) => v !== null));
  if (!places.length) return;
  const [low, high] = [Math.min, Math.max].map((of) => [0, 1].map((k) => places.reduce((found, p) => of(found, p[k]), places[0][k])));
  const [width, height] = size(), room = 1 - 2 * MARGIN;
  const scale = Math.max((high[0] - low[0]) / width, (high[1] - low[1]) / height, LEAST / width) / room;
  const inside = [low, high].every((p) => Math.abs(p[0] - view.east) < view.scale * width * 0.47 && Math.abs(p[1] - view.north) < view.scale * height * 0.45);
  if (inside && scale > 0.6 * view.scale) return; // a map that stands still is easier to read
  view = { east: (low[0] + high[0]) / 2, north: (low[1] + high[1]) / 2, scale: 1.1 * scale };
}

const tip = (track) => track.velocity.includes(null) ? track.position : track.position.map((at, k) => at + told.ahead * track.velocity[k]);

function pixel([east, north]) {
  const [width, height] = size();
  return [width / 2 + (east - view.east) / view.scale, height / 2 - (north - view.north) / view.scale];
}

function zoom(factor, x = size()[0] / 2, y = size()[1] / 2) {
  const [width, height] = size(), scale = Math.min(Math.max(view.scale * factor, 0.01), 1e5), d = view.scale - scale;
  view = { east: view.east + (x - width / 2) * d, north: view.north - (y - height / 2) * d, scale };
  free();
}

function move(x, y) {
  view = { ...view, east: view.east - x * view.scale, north: view.north + y * view.scale };
  free();
}

function free(isAll = false) {
  isFitted = isAll;
  find("all").setAttribute("aria-pressed", isAll);
  if (isAll) view.scale = 0;
  draw();
}

// --- drawing ------------------------------------------------------------------------------------------------

function drawn(tag, about, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(about)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

const path = (places) => places.map((p) => pixel(p).map((v) => v.toFixed(1)).join(",")).join(" ");
const line = (kind, [x1, y1], [x2, y2]) => drawn("line", { class: kind, x1, y1, x2, y2 });

function length(metres) {
  const [value, unit] = Math.abs(metres) >= 1000 ? [metres / 1000, " km"] : [metres, " m"];
  return metres ? `${+value.toPrecision(6)}${unit}`.replace("-", "\u2212") : "0";
}

function grid() {
  const [width, height] = size(), wanted = 110 * view.scale, ten = 10 ** Math.floor(Math.log10(wanted));
  const step = ten * [1, 2, 5, 10].find((k) => k * ten >= wanted), parts = [], words = [];
  for (let k = Math.ceil((view.east - view.scale * width / 2) / step); k * step < view.east + view.scale * width / 2; k++) {
    const x = pixel([k * step, 0])[0];
    parts.push(line(k ? "grid" : "grid zero", [x, 0], [x, height]));
    if (x > 70 && x < width - 70 - step / view.scale) words.push(drawn("text", { class: "quiet", x: x + 4, y: height - 6 }, length(k * step)));
  }
  for (let k = Math.ceil((view.north - view.scale * height / 2) / step); k * step < view.north + view.scale * height / 2; k++) {
    const y = pixel([0, k * step])[1];
    parts.push(line(k ? "grid" : "grid zero", [0, y], [width, y]));
    if (y > 60 && y < height - 24) words.push(drawn("text", { class: "quiet", x: 6, y: y - 4 }, length(k * step)));
  }
  const long = step / view.scale, x = width - 20 - long, y = height - 18;
  words.push(drawn("path", { class: "bar", d: `M${x},${y - 6}v6h${long}v-6` }));
  words.push(drawn("text", { id: "scale", x: x + long / 2, y: y - 6, "text-anchor": "middle" }, length(step)));
  words.push(drawn("path", { class: "north", d: `M${width - 26},34v-18l-5,8h10l-5,-8` }), drawn("text", { x: width - 26, y: 49, "text-anchor": "middle" }, "N"));
  return [parts, words];
}

// A name stands beside its track where neither a track nor another name is, rather off its line than on it.
function label(track, taken) {
  const [x, y] = pixel(track.position), wide = 7.2 * track.name.length, [width, height] = size();
  const along = ([dx, dy]) => Math.abs(dx * track.velocity[0] - (dy - 4) * track.velocity[1]);
  for (const [dx, dy, anchor] of [[9, -7, 0], [9, 16, 0], [-9, -7, 1], [-9, 16, 1]].sort((p, q) => along(p) - along(q))) {
    const box = [x + dx - anchor * wide, y + dy - 11, x + dx + (1 - anchor) * wide, y + dy + 3];
    const isFree = box[0] > 0 && box[2] < width && box[1] > 0 && box[3] < height;
    if (!isFree || taken.some((b) => box[0] < b[2] && box[2] > b[0] && box[1] < b[3] && box[3] > b[1])) continue;
    taken.push(box);
    return [drawn("text", { x: x + dx, y: y + dy, "text-anchor": anchor ? "end" : "start" }, track.name)];
  }
  return [];
}

function figure(track, taken) {
  const group = drawn("g", { class: `track ${track.status}${track.id === marked ? " marked" : ""}`, "data-id": track.id });
  const [x, y] = pixel(track.position), [a, b, course] = track.ellipse;
  const places = track.trail.filter((p) => p.every((v) => v !== null));
  group.append(drawn("polyline", { class: "trail", points: path(places) }));
  if (a !== null) {
    group.append(drawn("ellipse", { class: "ellipse", rx: b / view.scale, ry: a / view.scale, transform: `translate(${x} ${y}) rotate(${course})` }));
  }
  group.append(line("course", [x, y], pixel(tip(track))), drawn("circle", { class: "place", cx: x, cy: y, r: 4.5 }), ...label(track, taken));
  return group;
}

function mark(id) {
  marked = marked === id ? null : id;
  draw();
}

// --- words --------------------------------------------------------------------------------------------------

const number = (value, digits = 0) => value === null ? "–" : value.toFixed(digits).replace("-", "\u2212");
const instant = (time) => time > DATED ? `${new Date(1000 * time).toISOString().slice(11, 19)} UTC` : `${number(time, 1)} s`;
const many = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
const lasting = (seconds) => seconds < 120 ? `${seconds.toFixed(0)} s` : `${(seconds / 60).toFixed(0)} min`;

function cells(track) {
  const digits = track.speed !== null && track.speed < 20 ? 1 : 0, isKnown = track.course_sd !== null && track.course_sd < SURE;
  return [
    track.name,
    track.speed === null ? "–" : `${number(track.speed, digits)} ± ${number(2 * track.speed_sd, digits)}`,
    isKnown ? `${number(track.course)} ± ${number(2 * track.course_sd)}` : "–",
    number(track.ellipse[0]),
    track.position.map((v) => number(v === null ? null : v / 1000, 2)).join(", "),
    instant(track.time),
    track.status,
  ];
}

// Rows are kept, so that a press on one is not lost when the next numbers come.
function table() {
  const order = [...told.tracks].sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }) || a.id - b.id);
  const known = rows;
  rows = new Map(order.map(({ id }) => [id, known.get(id) ?? element("tr", { onclick: () => mark(id) }, ...HEADS.map(() => element("td")))]));
  for (const track of order) {
    const made = rows.get(track.id);
    cells(track).forEach((text, k) => write(made.children[k], text));
    made.classList.toggle("marked", track.id === marked);
  }
  const body = find("rows"), wanted = [...rows.values()];
  if (wanted.length !== body.children.length || wanted.some((made, k) => made !== body.children[k])) body.replaceChildren(...wanted);
}

function say() {
  const isSilent = told.plots > 0 && told.silent > SILENT;
  const beyond = told.total > told.tracks.length ? `, of which the ${told.tracks.length} seen last are shown` : "";
  const lead = !told.plots ? "Waiting for the first plots."
    : isSilent ? `No plot has come for ${lasting(10 * Math.floor(told.silent / 10))}.`
    : told.total ? `${many(told.total, "track")}${beyond}.` : "Plots come; no track is confirmed yet.";
  write(find("answer"), lead);
  find("answer").classList.toggle("alarm", isSilent);
  const ahead = told.ahead === 60 ? "minute" : `${told.ahead / 60} minutes`;
  write(find("legend"), `Dot: the position at the last plot; faint line: the last ten minutes; straight line: the next ${ahead}; shaded: the 95 % ellipse; hollow: coasting. ± is two deviations.`);
  write(find("counts"), `${many(told.plots, "plot")}${told.time === null ? "" : `, until ${instant(told.time)}`}`);
}

function draw() {
  if (!told) return;
  const tracks = shown(), [width, height] = size();
  say();
  table();
  if (isFitted || !view.scale) fit(tracks);
  if (!view.scale) return;
  map.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const taken = [[0, 0, 140, 56], [width - 50, 0, width, 56], [width - 200, height - 40, width, height]];
  for (const [x, y] of tracks.map((track) => pixel(track.position))) taken.push([x - 4, y - 4, x + 4, y + 4]);
  const [lines, words] = grid();
  const first = [...tracks].sort((a, b) => (b.id === marked) - (a.id === marked)); // its name comes first
  map.replaceChildren(...lines, ...first.map((track) => figure(track, taken)).reverse(), ...words);
}

// --- hands --------------------------------------------------------------------------------------------------

let held = null, isDragged = false;
map.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; isDragged = false; });
addEventListener("pointerup", (event) => {
  if (held && !isDragged && told) markAt(event);
  held = null;
});
addEventListener("pointermove", (event) => {
  if (!held || !view.scale || (!isDragged && Math.hypot(event.clientX - held[0], event.clientY - held[1]) < 4)) return;
  isDragged = true;
  move(event.clientX - held[0], event.clientY - held[1]);
  held = [event.clientX, event.clientY];
});

function markAt(event) {
  const box = map.getBoundingClientRect();
  const off = (track) => Math.hypot(...pixel(track.position).map((v, k) => v - [event.clientX - box.left, event.clientY - box.top][k]));
  const near = shown().filter((track) => off(track) < 16).sort((a, b) => off(a) - off(b))[0];
  if (near) mark(near.id);
}
map.addEventListener("wheel", (event) => {
  event.preventDefault();
  const box = map.getBoundingClientRect();
  if (view.scale) zoom(Math.exp(0.0015 * event.deltaY), event.clientX - box.left, event.clientY - box.top);
}, { passive: false });
map.addEventListener("keydown", (event) => {
  const act = {
    ArrowLeft: () => move(60, 0), ArrowRight: () => move(-60, 0), ArrowUp: () => move(0, 60), ArrowDown: () => move(0, -60),
    "+": () => zoom(0.7), "=": () => zoom(0.7), "-": () => zoom(1.4),
  }[event.key];
  if (!act || !view.scale) return;
  event.preventDefault();
  act();
});
find("nearer").addEventListener("click", () => view.scale && zoom(0.7));
find("farther").addEventListener("click", () => view.scale && zoom(1.4));
find("all").addEventListener("click", () => free(true));
addEventListener("resize", draw);

function theme() {
  const dark = root.dataset.theme === "dark";
  write(find("theme"), dark ? "Light" : "Dark");
  find("theme").setAttribute("aria-label", dark ? "Change to the light theme" : "Change to the dark theme");
}
find("theme").addEventListener("click", () => {
  root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("driftwise-theme", root.dataset.theme);
  theme();
});

theme();
ask();
