// The page: which view is shown, the theme, the state of the line, the door.
import { colours } from "./charts.js";
import { Feed } from "./feed.js";
import { List } from "./list.js";
import { Series } from "./series.js";
import { count, write } from "./words.js";

const find = (id) => document.getElementById(id);
const feed = new Feed();
let palette = colours();
const list = new List(feed, () => palette), series = new Series(feed);

function chosen() {
  const found = location.hash.match(/^#\/series\/(.+)$/);
  return found ? decodeURIComponent(found[1]) : null;
}

function show() {
  const key = chosen();
  find("door").hidden = true;
  find("overview").hidden = key !== null;
  find("series").hidden = key === null;
  feed.follow(key);
  list.show(key === null);
  series.show(key);
}

function theme() {
  const dark = document.documentElement.dataset.theme === "dark";
  write(find("theme"), dark ? "Light" : "Dark");
  find("theme").setAttribute("aria-label", dark ? "Change to the light theme" : "Change to the dark theme");
  palette = colours();
  list.redraw();
  series.dress();
}

find("theme").addEventListener("click", () => {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("driftwise-theme", root.dataset.theme);
  theme();
});

find("door").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await fetch("sign-in", { method: "POST", body: find("token").value });
  write(find("refused"), answer.ok ? "" : answer.status === 429 ? "Too many wrong tokens; wait a minute." : "That is not the token.");
  if (!answer.ok) return;
  find("token").value = "";
  feed.open();
  show();
});

feed.addEventListener("link", ({ detail }) => {
  find("link").dataset.link = detail;
  write(find("link"), { live: "live", gone: "the service does not answer; trying again …", door: "signed out" }[detail]);
  if (detail !== "door") return;
  for (const id of ["overview", "series"]) find(id).hidden = true;
  find("door").hidden = false;
  find("token").focus();
});

feed.addEventListener("changed", () => {
  let samples = 0;
  for (const one of feed.series.values()) samples += one.count;
  write(find("counts"), `${count(feed.series.size, "series")}, ${count(samples, "samples")}`);
});

addEventListener("hashchange", () => {
  show();
  scrollTo(0, 0);
  find("content").focus({ preventScroll: true });
});

theme();
show();
