// All series: only the rows in sight are elements; they follow their series when the order changes.
import { acknowledge, ask } from "./feed.js";
import { draw } from "./spark.js";
import { STATES, count, element, mark, matter, number, plusMinus, told, write } from "./words.js";

const AROUND = 4; // rows beyond the edges of the window that are ready
const HOLD = 2; // s between two orders, so that nothing dances

const find = (id) => document.getElementById(id);
const byKey = new Intl.Collator("en", { numeric: true }).compare;
const ORDERS = {
  look: (a, b) => b.score - a.score || (b.event?.time ?? -Infinity) - (a.event?.time ?? -Infinity) || a.place - b.place,
  key: (a, b) => a.place - b.place,
  event: (a, b) => (b.event?.time ?? -Infinity) - (a.event?.time ?? -Infinity) || a.place - b.place,
  surprise: (a, b) => (b.nis ?? -1) - (a.nis ?? -1) || a.place - b.place,
};

export class List {
  constructor(feed, colours) {
    this.feed = feed;
    this.colours = colours;
    this.rows = new Map();
    this.order = [];
    this.wanted = "all";
    this.ordered = -Infinity;
    this.asked = -Infinity;
    this.box = find("rows");
    find("find").addEventListener("input", () => this.#reorder());
    find("sort").addEventListener("change", () => this.#reorder());
    this.box.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("scroll", () => this.#soon(), { passive: true });
    addEventListener("resize", () => this.#soon());
    feed.addEventListener("changed", (event) => this.#changed(event.detail));
  }

  show(shown) {
    this.shown = shown;
    if (shown) this.#reorder();
  }

  redraw() {
    for (const row of this.rows.values()) row.drawn = null;
    this.#soon();
  }

  #changed(rows) {
    if (rows === null) {
      [...this.feed.series.values()].sort((a, b) => byKey(a.key, b.key)).forEach((one, place) => { one.place = place; });
    }
    if (!this.shown) return;
    const isNew = rows === null || this.order.length === 0 || rows.some(([key]) => this.feed.series.get(key).place === undefined);
    const isDue = performance.now() - this.ordered > 1000 * HOLD && !this.box.contains(document.activeElement);
    if (isNew || isDue) this.#reorder();
    else this.#soon();
  }

  #reorder() {
    const all = [...this.feed.series.values()], counts = { all: all.length, look: 0 };
    for (const one of all) {
      one.place ??= all.length;
      const status = matter(one);
      counts[status] = (counts[status] ?? 0) + 1;
      if (one.score > 0) counts.look += 1;
    }
    const part = find("find").value.trim().toLowerCase();
    const fits = { all: () => true, look: (one) => one.score > 0 }[this.wanted] ?? ((one) => matter(one) === this.wanted);
    this.order = all.filter((one) => fits(one) && (!part || one.key.toLowerCase().includes(part))).sort(ORDERS[find("sort").value]);
    this.ordered = performance.now();
    this.#chips(counts);
    this.#answer(counts);
    find("none").hidden = this.order.length > 0;
    write(find("none"), all.length ? "No series is like that." : "No series yet: it appears when its first sample comes.");
    this.#soon();
  }

  #answer(counts) {
    const words = !counts.all ? "Waiting for samples."
      : counts.look ? `${counts.look} of ${count(counts.all, "series")} ${counts.look === 1 ? "needs" : "need"} a look.`
      : `${count(counts.all, "series")}: nothing needs a look.`;
    write(find("answer"), words);
    find("answer").classList.toggle("alarm", counts.look > 0);
    document.title = counts.look ? `(${counts.look}) driftwise` : "driftwise";
  }

  #chips(counts) {
    const box = find("states");
    for (const state of ["all", "look", ...Object.keys(STATES)]) {
      let chip = box.querySelector(`[data-state="${state}"]`);
      if (!chip) {
        chip = element("button", { type: "button", "data-state": state, title: STATES[state]?.help, onclick: () => {
          this.wanted = state;
          this.#reorder();
        } });
        box.append(chip);
      }
      const name = { all: "All", look: "Needs a look" }[state] ?? STATES[state].name;
      chip.hidden = state !== "all" && !counts[state] && this.wanted !== state;
      chip.setAttribute("aria-pressed", String(this.wanted === state));
      write(chip, `${name} ${counts[state] ?? 0}`);
    }
  }

  #soon() {
    if (this.shown && !this.frame) this.frame = requestAnimationFrame(() => { this.frame = null; this.#draw(); });
  }

  #draw() {
    const height = matchMedia("(max-width:900px)").matches ? 88 : 52;
    this.box.style.height = `${this.order.length * height}px`;
    const top = this.box.getBoundingClientRect().top;
    const first = Math.max(Math.floor(-top / height) - AROUND, 0);
    const last = Math.min(Math.ceil((innerHeight - top) / height) + AROUND, this.order.length);
    const inSight = new Map(this.order.slice(first, last).map((one, k) => [one.key, first + k]));
    const held = document.activeElement?.closest?.(".row")?.dataset.key;
    for (const [key, row] of this.rows) {
      if (!inSight.has(key) && key !== held) { row.node.remove(); this.rows.delete(key); }
    }
    const unknown = [];
    for (const [key, place] of inSight) {
      let row = this.rows.get(key);
      if (!row) {
        row = this.#row(key);
        this.rows.set(key, row);
        this.box.append(row.node);
      }
      row.node.style.transform = `translateY(${place * height}px)`;
      row.node.setAttribute("aria-posinset", place + 1);
      row.node.setAttribute("aria-setsize", this.order.length);
      row.place = place;
      this.#fill(row, this.feed.series.get(key));
      if (this.feed.series.get(key).recent.isStale) unknown.push(key);
    }
    if (unknown.length && performance.now() - this.asked > 1000) this.#past(unknown);
  }

  #row(key) {
    const parts = {
      link: element("a", { href: `#/series/${encodeURIComponent(key)}` }, key),
      state: element("span", { class: "state" }),
      output: element("span", { class: "value output" }),
      predicted: element("span", { class: "value predicted" }),
      nis: element("span", { class: "value nis" }),
      canvas: element("canvas", { "aria-hidden": "true" }),
      words: element("span"),
      seen: element("button", { type: "button", "aria-label": `Acknowledge the last event of ${key}`, onclick: () => this.#seen(key) }, "Seen"),
    };
    const node = element("div", { class: "row", role: "listitem", "data-key": key },
      element("span", { class: "who" }, parts.link, parts.state), parts.output, parts.predicted, parts.nis, parts.canvas,
      element("span", { class: "event" }, parts.words, parts.seen));
    return { node, ...parts };
  }

  #fill(row, one) {
    mark(row.state, matter(one));
    write(row.link, one.name || one.key);
    write(row.output, number(one.output) + (one.unit ? ` ${one.unit}` : ""));
    write(row.predicted, one.low == null ? number(one.prediction) : plusMinus(one.prediction, (one.high - one.low) / 2));
    write(row.nis, number(one.nis, 2));
    write(row.words, one.event ? told(one.event, this.feed.now) : "");
    row.seen.hidden = !one.event || one.acknowledged;
    const drawn = `${one.recent.count} ${one.recent.values.length} ${row.canvas.clientWidth}`;
    if (row.drawn === drawn) return;
    row.drawn = drawn;
    draw(row.canvas, one.recent.values, this.colours().line);
  }

  async #past(keys) {
    this.asked = performance.now();
    const query = keys.slice(0, 50).map((key) => `key=${encodeURIComponent(key)}`).join("&");
    const past = await ask(`api/recent?${query}`).catch(() => ({}));
    for (const [key, { count, output }] of Object.entries(past)) this.feed.series.get(key)?.recent.fill(count, output);
    this.#soon();
  }

  async #seen(key) {
    const one = this.feed.series.get(key);
    await acknowledge(one.event.number).catch(() => {});
  }

  #key(event) {
    const key = document.activeElement?.closest?.(".row")?.dataset.key;
    const at = this.order.findIndex((one) => one.key === key), page = Math.floor(innerHeight / 60);
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity }[event.key];
    if (at < 0 || step === undefined) return;
    event.preventDefault();
    const to = Math.min(Math.max(at + step, 0), this.order.length - 1);
    const height = this.box.clientHeight / this.order.length, top = this.box.getBoundingClientRect().top + scrollY + to * height;
    if (top < scrollY + 60) scrollTo(0, top - 60);
    if (top + height > scrollY + innerHeight) scrollTo(0, top + height - innerHeight + 8);
    this.#draw();
    this.rows.get(this.order[to].key)?.link.focus({ preventScroll: true });
  }
}
