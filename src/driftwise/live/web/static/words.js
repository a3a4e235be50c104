// Numbers, times and states as people read them; elements made of text, never of markup.

export const STATES = {
  lost: { name: "Lost", kind: "bad", help: "the estimate was lost and begins afresh" },
  jump: { name: "Jumped", kind: "bad", help: "parameters moved at once" },
  drift: { name: "Drifts", kind: "bad", help: "parameters move steadily" },
  noise: { name: "Noise", kind: "bad", help: "louder or quieter than before" },
  stuck: { name: "Stuck", kind: "warn", help: "the sensor gives one value" },
  model: { name: "Model", kind: "warn", help: "the model is chosen again" },
  silent: { name: "Silent", kind: "warn", help: "no sample for too long" },
  outliers: { name: "Outliers", kind: "warn", help: "single samples far from what was predicted" },
  back: { name: "Back", kind: "warn", help: "samples come again" },
  identifying: { name: "Identifying", kind: "new", help: "the model is being chosen" },
  "warming up": { name: "Warming up", kind: "new", help: "too few samples yet" },
  well: { name: "Well", kind: "good", help: "as predicted" },
};

// What is the matter with a series: an event that nobody has acknowledged, though the estimates are well again.
export function matter({ status, acknowledged, event }) {
  return status === "well" && !acknowledged && event ? event.kind : status;
}

export function mark(node, status) {
  node.dataset.kind = STATES[status]?.kind ?? "warn";
  write(node, STATES[status]?.name ?? status);
}

export function element(tag, about = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(about)) {
    if (name === "class") made.className = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export function number(value, digits = 4) {
  if (value == null || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e6 || size < 1e-4 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  return text.includes("e") ? text.replace("-", "−").replace("e-", "e−") : trimmed(text).replace("-", "−");
}

// Without a power of ten: 4 digits of 12345 are 12345, not 1.234e+4.
function trimmed(text) {
  return text.includes("e") ? String(Number(text)) : text;
}

export function plusMinus(value, deviation) {
  if (value == null) return "–";
  if (deviation == null || !(deviation > 0)) return number(value);
  const places = Math.min(Math.max(1 - Math.floor(Math.log10(deviation)), 0), 12);
  if (Math.abs(value) >= 1e6 || (places > 8)) return `${number(value)} ± ${number(deviation, 2)}`;
  return `${value.toFixed(places)} ± ${deviation.toFixed(places)}`.replace(/^-/, "−");
}

export function clock(seconds) {
  if (seconds == null) return "–";
  const when = new Date(seconds * 1000);
  const today = new Date().toDateString() === when.toDateString();
  const time = when.toLocaleTimeString([], { hour12: false });
  return today ? time : `${when.toLocaleDateString([], { year: "numeric", month: "short", day: "numeric" })} ${time}`;
}

export function ago(seconds, now) {
  const past = Math.max(now - seconds, 0);
  if (past < 60) return `${Math.floor(past)} s ago`;
  if (past < 3600) return `${Math.floor(past / 60)} min ago`;
  if (past < 172800) return `${Math.floor(past / 3600)} h ago`;
  return `${Math.floor(past / 86400)} days ago`;
}

export function count(howMany, what) {
  return `${howMany.toLocaleString("en").replaceAll(",", "\u202f")} ${what}`;
}

export function told(event, now) {
  return `${event.sentence.replace(/\.$/, "")}, ${ago(event.time, now)}`;
}
