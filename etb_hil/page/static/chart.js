// Charts on a canvas: axes with ticks, limits as dashed lines, points and lines; colours from the style sheet.

const LETTERS = 16; // px that a label above or below its line needs

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function ticks(low, high, most) {
  const rough = (high - low) / Math.max(most, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= rough);
  const found = [];
  for (let at = Math.ceil(low / step) * step; at <= high + step * 1e-9; at += step) found.push(Math.abs(at) < step * 1e-9 ? 0 : at);
  return found;
}

function range(values, least) {
  let low = Infinity, high = -Infinity;
  for (const value of values) if (value !== null && value !== undefined && Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
  if (low > high) return [0, least];
  const room = Math.max((high - low) * 0.06, least * 0.05);
  return [low - room, high + room];
}

// Draw series {points: [[x, y], ...], colour, kind: "line" | "dots"} and lines {y, from, to, label} into a canvas.
export function draw(canvas, { series, lines = [], xLabel, yLabel, xTick, yTick, x, y, marks = [] }) {
  const ratio = devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "13px system-ui, sans-serif";
  const all = series.flatMap((one) => one.points);
  const [xLow, xHigh] = x ?? range(all.map((point) => point[0]), 1);
  const [yLow, yHigh] = y ?? range([...all.map((point) => point[1]), ...lines.map((line) => line.y)], 0.01);
  const left = 58, right = 12, top = 8, bottom = 40;
  const atX = (value) => left + ((value - xLow) / (xHigh - xLow)) * (width - left - right);
  const atY = (value) => height - bottom - ((value - yLow) / (yHigh - yLow)) * (height - top - bottom);
  pen.strokeStyle = style("--grid");
  pen.fillStyle = style("--quiet");
  pen.lineWidth = 1;
  pen.textBaseline = "middle";
  for (const value of ticks(yLow, yHigh, (height - top - bottom) / 34)) {
    pen.beginPath(); pen.moveTo(left, atY(value)); pen.lineTo(width - right, atY(value)); pen.stroke();
    pen.textAlign = "right"; pen.fillText(yTick(value), left - 6, atY(value));
  }
  pen.textBaseline = "top";
  for (const value of ticks(xLow, xHigh, (width - left - right) / 80)) {
    pen.beginPath(); pen.moveTo(atX(value), top); pen.lineTo(atX(value), height - bottom); pen.stroke();
    pen.textAlign = "center"; pen.fillText(xTick(value), atX(value), height - bottom + 5);
  }
  pen.textAlign = "right"; pen.fillText(xLabel, width - right, height - 17);
  pen.save(); pen.translate(11, top + 2); pen.rotate(-Math.PI / 2); pen.textAlign = "right"; pen.fillText(yLabel, 0, -5); pen.restore();
  pen.save();
  pen.beginPath(); pen.rect(left, top, width - left - right, height - top - bottom); pen.clip();
  for (const one of series) {
    pen.strokeStyle = pen.fillStyle = style(one.colour);
    pen.lineWidth = one.width ?? 2;
    pen.setLineDash(one.dash ?? []);
    if (one.kind === "dots") {
      for (const [px, py, colour] of one.points) {
        if (py === null) continue;
        if (colour) pen.fillStyle = style(colour);
        pen.beginPath(); pen.arc(atX(px), atY(py), one.size ?? 3, 0, 7); pen.fill();
      }
    } else {
      let down = false;
      pen.beginPath();
      for (const [px, py] of one.points) {
        if (py === null) { down = false; continue; }
        if (down) pen.lineTo(atX(px), atY(py)); else pen.moveTo(atX(px), atY(py));
        down = true;
      }
      pen.stroke();
    }
  }
  pen.setLineDash([7, 5]);
  for (const line of lines) {
    const from = atX(line.from ?? xLow), to = atX(line.to ?? xHigh);
    pen.strokeStyle = pen.fillStyle = style("--bad");
    pen.lineWidth = 2;
    pen.beginPath(); pen.moveTo(from, atY(line.y)); pen.lineTo(to, atY(line.y)); pen.stroke();
    if (line.label) {
      const above = line.y >= 0 ? atY(line.y) >= top + LETTERS : atY(line.y) > height - bottom - LETTERS;
      pen.textAlign = "right"; pen.textBaseline = above ? "bottom" : "top"; pen.fillText(line.label, Math.min(to, width - right) - 4, atY(line.y) + (above ? -2 : 2));
    }
  }
  pen.setLineDash([]);
  for (const mark of marks) {
    pen.strokeStyle = style(mark.colour);
    pen.beginPath(); pen.moveTo(atX(mark.x), top); pen.lineTo(atX(mark.x), height - bottom); pen.stroke();
  }
  pen.restore();
  return { valueAt: (px) => xLow + ((px - left) / (width - left - right)) * (xHigh - xLow) };
}
