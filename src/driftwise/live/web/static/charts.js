// uPlot, dressed in the colours of the page: lines with bands, events as marks, one cursor for all charts of a page.
/* global uPlot */

export function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  return { ink: of("ink"), quiet: of("quiet"), grid: of("line"), line: of("blue"), band: of("band"), alarm: of("alarm") };
}

const STEPS = [0.001, 0.01, 0.1, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14400, 43200, 86400, 604800, 2592000, 31536000];
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
const round = (value) => (value == null ? "" : String(Number(value.toPrecision(5))).replace("-", "−"));

// Instants under an axis whose ticks are `step` seconds apart; the day where it is a new one.
function instants(times, step) {
  const day = (when) => when.toLocaleDateString([], { month: "short", day: "numeric" });
  let last = null;
  return times.map((time) => {
    const when = new Date(time * 1000), options = { hour: "2-digit", minute: "2-digit", hour12: false };
    if (step < 60) options.second = "2-digit";
    const today = day(when), isNew = last !== null && today !== last;
    last = today;
    return step >= 86400 || isNew ? today : when.toLocaleTimeString([], options);
  });
}

// columns: time, then for each line {label, kind}; kind is "line", "points", "low", "high" or "ahead".
export class Chart {
  constructor(node, lines, { level = [], marks = () => [] } = {}) {
    Object.assign(this, { node, lines, level, marks });
    this.data = [[], ...lines.map(() => [])];
    this.between = [0, 1];
    this.watch = new ResizeObserver(() => this.plot?.setSize(this.#size()));
    this.watch.observe(node);
    this.dress();
  }

  dress() {
    this.plot?.destroy();
    this.colours = colours();
    this.plot = new uPlot(this.#options(), this.data, this.node);
  }

  // Show columns between two instants.
  set(data, between) {
    this.data = data;
    this.between = between;
    this.plot.setData(data);
  }

  end() {
    this.watch.disconnect();
    this.plot.destroy();
  }

  #size() {
    return { width: Math.max(this.node.clientWidth, 100), height: Math.max(this.node.clientHeight, 80) };
  }

  #options() {
    const { ink, quiet, grid, line, band } = this.colours;
    const axis = { stroke: quiet, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 }, font: "12px system-ui" };
    const looks = {
      line: { stroke: line, width: 1.6, points: { show: false } },
      points: { stroke: ink, width: 0, paths: () => null, points: { show: true, size: 3.5, width: 0, fill: ink } },
      low: { stroke: "transparent", points: { show: false } },
      high: { stroke: "transparent", points: { show: false } },
      ahead: { stroke: line, width: 1.6, dash: [5, 4], points: { show: false } },
    };
    const bands = [];
    this.lines.forEach(({ kind }, k) => { if (kind === "high") bands.push({ series: [k + 1, k + 2], fill: band }); });
    return {
      ...this.#size(),
      legend: { show: false },
      padding: [8, 10, 0, 0],
      cursor: { sync: { key: "driftwise" }, drag: { x: false, y: false }, points: { show: false } },
      scales: { x: { time: true, range: () => this.between }, y: { range: () => this.#range() } },
      axes: [{ ...axis, space: 64, size: 32, incrs: STEPS, values: (_, times, __, ___, step) => instants(times, step) }, { ...axis, size: 62, values: (_, ticks) => ticks.map(round) }],
      series: [{}, ...this.lines.map(({ label, kind }) => ({ label, spanGaps: false, ...looks[kind] }))],
      bands,
      hooks: { draw: [(plot) => this.#mark(plot)] },
    };
  }

  // Heights that hold the values and their bands, but no band much wider than is usual.
  #range() {
    const of = (...kinds) => this.lines.flatMap(({ kind }, k) => (kinds.includes(kind) ? this.data[k + 1] : [])).filter((v) => v != null);
    const values = of("points").length ? of("points", "ahead") : of("line");
    if (!values.length) return [0, 1];
    const edge = (all, is) => all.reduce((a, b) => (is(b, a) ? b : a));
    const less = (a, b) => a < b, more = (a, b) => a > b;
    const low = edge(values, less), high = edge(values, more), lows = of("low"), highs = of("high");
    const usual = 1.5 * (median(highs.map((value, k) => value - lows[k])) ?? 0) || (high > low ? 0 : Math.abs(low) || 1);
    const least = Math.max(edge([low, ...lows], less), low - usual), most = Math.min(edge([high, ...highs], more), high + usual);
    return [least - 0.06 * (most - least || 1), most + 0.06 * (most - least || 1)];
  }

  #mark(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = devicePixelRatio;
    const stroke = (colour, dash, from, to) => {
      ctx.strokeStyle = colour;
      ctx.setLineDash(dash);
      ctx.beginPath();
      ctx.moveTo(...from);
      ctx.lineTo(...to);
      ctx.stroke();
    };
    for (const time of this.marks()) {
      const x = plot.valToPos(time, "x", true);
      stroke(this.colours.alarm, [], [x, bbox.top], [x, bbox.top + bbox.height]);
    }
    for (const value of this.level) {
      const y = plot.valToPos(value, "y", true);
      stroke(this.colours.quiet, [6, 5], [bbox.left, y], [bbox.left + bbox.width, y]);
    }
    ctx.restore();
  }
}
