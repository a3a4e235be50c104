// Sparklines on a canvas: the last outputs of a series, NaN where one is missing.

const LENGTH = 120;

export class Recent {
  constructor() {
    this.values = [];
    this.count = 0; // samples of the series up to the last value
    this.isStale = true; // samples came that nobody sent
  }

  fill(count, values) {
    this.values = values.map((value) => value ?? NaN);
    this.count = count;
    this.isStale = false;
  }

  push(count, value) {
    if (count === this.count) return;
    this.isStale ||= count !== this.count + 1;
    this.values.push(value ?? NaN);
    if (this.values.length > LENGTH) this.values.shift();
    this.count = count;
  }
}

export function draw(canvas, values, colour) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return;
  const wide = Math.round(width * ratio), high = Math.round(height * ratio);
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  let least = Infinity, most = -Infinity;
  for (const value of values) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  if (!(most >= least) || values.length < 2) return;
  const x = (k) => 2 + (width - 4) * (k + LENGTH - values.length) / (LENGTH - 1);
  const y = (value) => height - 3 - (height - 6) * (most > least ? (value - least) / (most - least) : 0.5);
  pen.strokeStyle = colour;
  pen.lineWidth = 1.5;
  pen.lineJoin = "round";
  pen.beginPath();
  let isDown = false;
  values.forEach((value, k) => {
    if (Number.isNaN(value)) isDown = false;
    else if (isDown) pen.lineTo(x(k), y(value));
    else { pen.moveTo(x(k), y(value)); isDown = true; }
  });
  pen.stroke();
}
