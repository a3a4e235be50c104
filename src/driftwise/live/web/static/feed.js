// What the service tells: all series at first, then those that changed; begun anew whenever the line was cut.
import { Recent } from "./spark.js";

const QUIET = 25; // s without a word from the service until the line counts as cut; it says something every ten

export class Feed extends EventTarget {
  constructor() {
    super();
    this.series = new Map();
    this.now = 0;
    this.key = null;
    this.source = null;
    this.wait = 0.5;
    setInterval(() => this.#watch(), 1000);
  }

  // Follow all series, and one of them with everything that is known of it.
  follow(key = null) {
    if (this.source && this.key === key) return;
    this.key = key;
    this.open();
  }

  open() {
    this.source?.close();
    clearTimeout(this.again);
    this.heard = performance.now();
    const source = this.source = new EventSource(this.key === null ? "stream" : `stream?key=${encodeURIComponent(this.key)}`);
    const on = (name, act) => source.addEventListener(name, (message) => {
      if (source !== this.source) return;
      this.heard = performance.now();
      if (message.data) act(JSON.parse(message.data));
    });
    on("all", (data) => this.#all(data));
    on("changed", (data) => this.#changed(data));
    on("series", (data) => this.#tell("series", data));
    on("beat", () => {});
    source.onerror = () => { if (source === this.source) this.#cut(); };
  }

  #cut() {
    this.source.close();
    this.#tell("link", "gone");
    clearTimeout(this.again);
    this.again = setTimeout(() => this.#retry(), 1000 * this.wait);
    this.wait = Math.min(2 * this.wait, 10);
  }

  // An EventSource does not tell why it ended: ask whether it is the token that is missing.
  async #retry() {
    const answer = await fetch("api/service").catch(() => null);
    if (answer?.status === 401) this.#tell("link", "door");
    else if (answer?.ok) this.open();
    else this.#cut();
  }

  #watch() {
    const open = this.source && this.source.readyState !== EventSource.CLOSED;
    if (open && performance.now() - this.heard > 1000 * QUIET) this.#cut();
  }

  #all({ now, columns, rows }) {
    this.columns = columns;
    this.wait = 0.5;
    this.now = now;
    const known = this.series;
    this.series = new Map();
    for (const row of rows) this.#take(row, { recent: known.get(row[0])?.recent ?? new Recent() });
    this.#tell("link", "live");
    this.#tell("changed", null);
  }

  #changed({ now, rows }) {
    this.now = now;
    for (const row of rows) this.#take(row, this.series.get(row[0]) ?? { recent: new Recent() });
    this.#tell("changed", rows);
  }

  #take(row, into) {
    this.columns.forEach((name, k) => { into[name] = row[k]; });
    into.recent.push(into.count, into.output);
    this.series.set(into.key, into);
  }

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}

export async function ask(path, options) {
  const answer = await fetch(path, options);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

export function acknowledge(number) {
  return ask(`api/events/${number}/acknowledge`, { method: "POST" });
}
