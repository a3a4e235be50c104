// One series: the output with its band and what is expected next, parameters, squared surprise, events.
import { Chart } from "./charts.js";
import { acknowledge, ask } from "./feed.js";
import { Past } from "./past.js";
import { clock, count, element, mark, matter, number, plusMinus, told, write } from "./words.js";

const SPANS = { "5 min": 300, "1 h": 3600, "1 day": 86400, All: Infinity };
const FRESH = 10; // s until the past is asked for again, where samples came faster than they are sent

const find = (id) => document.getElementById(id);

export class Series {
  constructor(feed) {
    this.feed = feed;
    this.span = 300;
    for (const [name, span] of Object.entries(SPANS)) {
      find("spans").append(element("button", { type: "button", "data-span": span, onclick: () => this.#spanned(span) }, name));
    }
    find("all-seen").addEventListener("click", () => this.#seen(this.events.filter((event) => !event.acknowledged)));
    feed.addEventListener("series", ({ detail }) => { if (detail.key === this.key) this.#take(detail); });
    feed.addEventListener("changed", ({ detail }) => { if (detail === null && this.key !== null) this.#load(); });
    this.key = null;
    this.charts = new Map();
  }

  show(key) {
    if (key === this.key) return;
    for (const chart of this.charts.values()) chart.end();
    this.charts.clear();
    find("parameters").replaceChildren();
    Object.assign(this, { key, past: new Past(), events: [], view: null, skipped: false });
    if (key === null) return;
    write(find("series-title"), key);
    write(find("series-answer"), "");
    const marks = () => this.events.map(({ time }) => time);
    const band = [{ label: "high", kind: "high" }, { label: "low", kind: "low" }];
    const lines = [{ label: "measured", kind: "points" }, { label: "predicted", kind: "line" }, ...band, { label: "expected", kind: "ahead" }];
    this.charts.set("output", new Chart(find("output"), lines, { marks }));
    this.charts.set("nis", new Chart(find("nis"), [{ label: "NIS", kind: "line" }], { level: [3.841], marks }));
    this.#spanned(this.span);
  }

  dress() {
    for (const chart of this.charts.values()) chart.dress();
  }

  #spanned(span) {
    this.span = span;
    for (const chip of find("spans").children) chip.setAttribute("aria-pressed", String(Number(chip.dataset.span) === span));
    this.#load();
  }

  async #load() {
    const key = this.key, path = `api/series/${encodeURIComponent(key)}`;
    this.loaded = performance.now();
    this.skipped = false;
    const one = await ask(path).catch(() => null);
    if (one === null || this.key !== key) return;
    const start = Number.isFinite(this.span) && one.time != null ? `?start=${one.time - this.span}` : "";
    const past = await ask(`${path}/history${start}`).catch(() => null);
    if (past === null || this.key !== key) return;
    this.past.begin(past);
    this.events = one.events;
    this.#take(one);
    this.#events();
  }

  #take(view) {
    if (view.missing) {
      write(find("series-answer"), "There is no such series.");
      return;
    }
    this.skipped ||= this.view !== null && view.count > this.view.count + 1;
    this.view = view;
    this.past.add(view);
    const last = view.event, known = this.events.findIndex(({ number }) => number === last?.number);
    if (last && known < 0) { this.events.push(last); this.#events(); }
    else if (last && known >= 0 && this.events[known].acknowledged !== last.acknowledged) { this.events[known] = last; this.#events(); }
    if (!this.frame) this.frame = requestAnimationFrame(() => { this.frame = null; this.#draw(); });
    if (this.skipped && performance.now() - this.loaded > 1000 * FRESH) this.#load();
  }

  #draw() {
    const view = this.view;
    if (this.key === null || view === null) return;
    const past = this.past, start = Math.max((view.time ?? 0) - this.span, past.begins), between = [start, past.ends(view.ahead)];
    mark(find("series-state"), matter(view));
    write(find("series-title"), view.name || view.key);
    this.#words(view);
    this.#cards(view);
    this.charts.get("output").set(past.outputs(start, view.ahead), between);
    this.charts.get("nis").set(past.squares(start), between);
    past.parameters.forEach(({ name }, k) => this.#parameter(name).set(past.path(k, start), between));
    this.#numbers(view.parameters);
    document.title = `${view.name || view.key} · driftwise`;
  }

  #words(view) {
    const waiting = this.events.filter((event) => !event.acknowledged).length;
    const calm = view.count ? "Nothing has happened yet." : "No sample yet.";
    write(find("series-answer"), view.event ? told(view.event, this.feed.now) : calm);
    find("series-answer").classList.toggle("alarm", waiting > 0);
    find("all-seen").hidden = waiting === 0;
    write(find("all-seen"), waiting > 1 ? `Acknowledge all ${waiting}` : "Acknowledge");
    const unit = view.unit ? `, in ${view.unit}` : "";
    write(find("output-say"), `Measured (dots), predicted one sample before (line, band of 95 %), expected next (dashed)${unit}.`);
  }

  #cards(view) {
    const half = view.low == null ? null : (view.high - view.low) / 2;
    const cards = [
      ["Output", number(view.output) + (view.unit ? ` ${view.unit}` : ""), clock(view.time)],
      ["Predicted", plusMinus(view.prediction, half), "± holds 95 %"],
      ["NIS", number(view.nis, 3), "1 where error bars are true"],
      ["Samples", count(view.count, "").trim(), ""],
      ["Model", view.model || "–", ""],
    ];
    const box = find("cards");
    if (!box.children.length) {
      for (const [name] of cards) box.append(element("div", {}, element("dt", {}, name), element("dd", {}, element("span"), element("small"))));
    }
    cards.forEach(([, value, note], k) => {
      write(box.children[k].querySelector("span"), value);
      box.children[k].classList.toggle("long", value.length > 16);
      write(box.children[k].querySelector("small"), note);
    });
  }

  #parameter(name) {
    const id = `parameter ${name}`;
    if (!this.charts.has(id)) {
      const node = element("div", { class: "chart" });
      find("parameters").append(element("div", {}, element("h3", {}, name), node));
      const lines = [{ label: name, kind: "line" }, { label: "high", kind: "high" }, { label: "low", kind: "low" }];
      this.charts.set(id, new Chart(node, lines, { marks: () => this.events.map(({ time }) => time) }));
    }
    return this.charts.get(id);
  }

  #events() {
    find("no-events").hidden = this.events.length > 0;
    find("events").closest("table").hidden = this.events.length === 0;
    const focused = document.activeElement?.dataset?.number;
    find("events").replaceChildren(...[...this.events].reverse().slice(0, 100).map((event) => element("tr", {},
      element("td", {}, clock(event.time)), element("td", {}, event.kind), element("td", {}, event.sentence),
      element("td", {}, event.acknowledged ? "seen" : element("button", { type: "button", "data-number": event.number,
        "aria-label": `Acknowledge: ${event.sentence}`, onclick: () => this.#seen([event]) }, "Seen")))));
    if (focused) find("events").querySelector(`[data-number="${focused}"]`)?.focus();
  }

  #numbers(parameters) {
    const body = find("numbers");
    while (body.children.length > parameters.length) body.lastChild.remove();
    parameters.forEach(({ name, value, std }, k) => {
      if (!body.children[k]) body.append(element("tr", {}, element("td"), element("td"), element("td")));
      [name, plusMinus(value, std), number(std, 2)].forEach((text, c) => write(body.children[k].children[c], text));
    });
  }

  async #seen(events) {
    for (const event of events) {
      const now = await acknowledge(event.number).catch(() => null);
      if (now) Object.assign(event, now);
    }
    this.#events();
    if (this.view) this.#draw();
  }
}
