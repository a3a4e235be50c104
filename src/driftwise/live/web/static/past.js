// What one series did, in columns that grow as samples come.

const Z = 1.959964; // deviations of a band of 95 %
const MOST = 3000; // rows

export class Past {
  constructor() {
    this.begin({ time: [], output: [], prediction: [], std: [], past: { time: [], parameters: [] } });
  }

  begin({ time, output, prediction, std, past }) {
    Object.assign(this, { time, output, prediction, std });
    this.pathTime = past.time;
    this.parameters = past.parameters;
  }

  // Take a series as it is now.
  add(view) {
    if (view.time == null) return;
    if (!(view.time <= this.time.at(-1))) {
      this.time.push(view.time);
      this.output.push(view.output);
      this.prediction.push(view.prediction);
      this.std.push(view.low == null ? null : (view.high - view.low) / (2 * Z));
      if (this.time.length > MOST) for (const name of ["time", "output", "prediction", "std"]) this[name].splice(0, MOST / 3);
    }
    if (view.time <= this.pathTime.at(-1)) return;
    const known = this.parameters.map(({ name }) => name);
    for (const { name } of view.parameters) {
      if (known.includes(name)) continue; // another model
      this.parameters.push({ name, value: this.pathTime.map(() => null), std: this.pathTime.map(() => null) });
    }
    this.pathTime.push(view.time);
    const tooMany = this.pathTime.length > MOST ? MOST / 3 : 0;
    this.pathTime.splice(0, tooMany);
    for (const one of this.parameters) {
      const now = view.parameters.find(({ name }) => name === one.name);
      one.value.push(now?.value ?? null);
      one.std.push(now?.std ?? null);
      one.value.splice(0, tooMany);
      one.std.splice(0, tooMany);
    }
  }

  get begins() {
    return Math.min(this.time[0] ?? Infinity, this.pathTime[0] ?? Infinity);
  }

  ends(ahead) {
    return (this.time.at(-1) ?? 1) + (ahead.length * this.step() || 1);
  }

  // Columns of the chart of the output from `start` on: measured, predicted, its band, and what is expected next.
  outputs(start, ahead) {
    const from = first(this.time, start), time = this.time.slice(from), empty = time.map(() => null);
    const low = [], high = [];
    for (let k = from; k < this.time.length; k++) {
      const is = this.prediction[k] != null && this.std[k] != null;
      low.push(is ? this.prediction[k] - Z * this.std[k] : null);
      high.push(is ? this.prediction[k] + Z * this.std[k] : null);
    }
    const columns = [time, this.output.slice(from), this.prediction.slice(from), high, low, empty];
    const step = this.step();
    if (!ahead.length || !step || !time.length) return columns;
    columns[5][time.length - 1] = columns[1].at(-1);
    const last = time.at(-1);
    ahead.forEach(([prediction, least, most], k) => {
      [last + (k + 1) * step, null, null, most, least, prediction].forEach((value, c) => columns[c].push(value));
    });
    return columns;
  }

  squares(start) {
    const from = first(this.time, start), squares = [];
    for (let k = from; k < this.time.length; k++) {
      const error = this.output[k] == null || this.prediction[k] == null ? null : this.output[k] - this.prediction[k];
      squares.push(error == null || !this.std[k] ? null : (error / this.std[k]) ** 2);
    }
    return [this.time.slice(from), squares];
  }

  path(k, start) {
    const from = first(this.pathTime, start), { value, std } = this.parameters[k];
    const band = (sign) => value.slice(from).map((v, i) => (v == null || std[from + i] == null ? null : v + sign * 2 * std[from + i]));
    return [this.pathTime.slice(from), value.slice(from), band(1), band(-1)];
  }

  // The usual time between two samples: the median of the last ones.
  step() {
    const last = this.time.slice(-21), gaps = last.slice(1).map((time, k) => time - last[k]).sort((a, b) => a - b);
    return gaps.length ? gaps[gaps.length >> 1] : null;
  }
}

function first(times, start) {
  const found = times.findIndex((time) => time >= start);
  return found < 0 ? 0 : found;
}
