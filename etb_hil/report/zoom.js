"use strict";
/* Zoom in the page's plots. Each plot is a <g data-box data-x data-y>: its frame in the drawing, and the values at the
   frame's edges. What is drawn inside the frame is moved and stretched; scales are drawn anew; lines keep their width. */

const SVG = "http://www.w3.org/2000/svg";
const HINT = "Drag over a range to zoom, with shift to move; double-click to go back. Keys on a chosen plot: + - arrows 0.";
const SMALLEST = 1e-4; // of the full range

const numbers = (text) => text.split(" ").map(Number);
const element = (name, attributes) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
};

/* Times are days since 1970, as matplotlib has them: steps of minutes, hours and days, told as hours or as a date. */
const MINUTE = 1 / 1440;
const STEPS = [1, 2, 5, 10, 30, 60, 180, 360, 720, 1440, 2880, 10080, 43200, 129600, 525600].map((n) => n * MINUTE);
const dated = (days, step) => {
  const text = new Date(Math.round(days * 1440) * 60000).toISOString();
  return step < 1 && text.slice(11, 16) !== "00:00" ? text.slice(11, 16) : step < 30 ? text.slice(5, 10) : text.slice(0, 7);
};

/* A plot's frame, what is drawn inside it, and its scales as they were drawn. */
class Plot {
  constructor(group) {
    this.group = group;
    [this.left, this.top, this.width, this.height] = numbers(group.dataset.box);
    this.full = { x: numbers(group.dataset.x), y: numbers(group.dataset.y) };
    this.shown = { x: [...this.full.x], y: [...this.full.y] };
    const scales = [...group.children].filter((child) => child.matches(".axis, [id*='matplotlib.axis_']"));
    this.scales = scales.map((scale) => [...scale.children].filter((child) => child.matches(".tick, [id*='tick_']")));
    this.hasValues = this.scales[1].length > 0;
    this.scale = element("g", { class: "scale" });
    group.append(this.scale);
    this.collect([...group.children].filter((child) => !scales.includes(child) && child !== this.scale));
  }

  /* Finds what stands inside the frame: paths are stretched, texts and marks only moved. */
  collect(children) {
    this.stretched = [];
    this.moved = [];
    for (const child of children) {
      const clipped = child.querySelector("[clip-path]");
      if (!clipped) continue;
      const frame = element("g", { "clip-path": clipped.getAttribute("clip-path") });
      child.before(frame);
      frame.append(child);
      for (const each of child.querySelectorAll("[clip-path]")) each.removeAttribute("clip-path");
      const single = [...child.querySelectorAll("use, text, .mark")];
      for (const each of single) {
        const box = each.getBBox();
        const holder = element("g", {});
        each.before(holder);
        holder.append(each);
        this.moved.push([holder, box.x + box.width / 2, box.y + box.height / 2]);
      }
      if (!single.length) this.stretched.push(child);
    }
  }

  factor(axis) {
    const [full, shown] = [this.full[axis], this.shown[axis]];
    return (full[1] - full[0]) / (shown[1] - shown[0]);
  }

  place(axis, value) {
    const [from, to] = this.shown[axis];
    const share = (value - from) / (to - from);
    return axis === "x" ? this.left + share * this.width : this.top + (1 - share) * this.height;
  }

  value(axis, place) {
    const share = axis === "x" ? (place - this.left) / this.width : 1 - (place - this.top) / this.height;
    const [from, to] = this.shown[axis];
    return from + share * (to - from);
  }

  holds(x, y) {
    return x >= this.left && x <= this.left + this.width && y >= this.top && y <= this.top + this.height;
  }

  show(axis, from, to) {
    const [low, high] = this.full[axis];
    const range = Math.min(Math.max(to - from, SMALLEST * (high - low)), high - low);
    const start = Math.min(Math.max(from, low), high - range);
    this.shown[axis] = [start, start + range];
  }

  draw() {
    const [kx, ky] = [this.factor("x"), this.factor("y")];
    const dx = this.place("x", this.full.x[0]) - kx * this.left;
    const dy = this.place("y", this.full.y[1]) - ky * this.top;
    const zoomed = kx !== 1 || ky !== 1;
    for (const each of this.stretched) {
      each.setAttribute("transform", `matrix(${kx} 0 0 ${ky} ${dx} ${dy})`);
      each.classList.toggle("stretched", zoomed);
    }
    for (const [each, x, y] of this.moved) {
      each.setAttribute("transform", `translate(${kx * x + dx - x} ${ky * y + dy - y})`);
    }
    this.scale.replaceChildren();
    ["x", "y"].forEach((axis, index) => {
      const same = this.factor(axis) === 1;
      for (const tick of this.scales[index]) tick.style.display = same ? "" : "none";
      if (!same && this.scales[index].length) this.drawScale(axis, this.scales[index].some((t) => t.querySelector("text")));
    });
  }

  drawScale(axis, labelled) {
    const [from, to] = this.shown[axis];
    const rough = (to - from) / (axis === "x" ? this.width / 60 : this.height / 35);
    const isTime = axis === "x" && "dates" in this.group.dataset;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = isTime ? STEPS.find((each) => each >= rough) || STEPS.at(-1) : power * ([1, 2, 5].find((digit) => digit * power >= rough) || 10);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let k = Math.ceil(from / step - 1e-6); k * step <= to + 1e-6 * step; k++) {
      const at = this.place(axis, k * step);
      const [right, bottom] = [this.left + this.width, this.top + this.height];
      const ends = axis === "x" ? { x1: at, x2: at, y1: this.top, y2: bottom } : { x1: this.left, x2: right, y1: at, y2: at };
      this.scale.append(element("line", ends));
      if (!labelled) continue;
      const [x, y, anchor] = axis === "x" ? [at, bottom + 14, "middle"] : [this.left - 6, at + 3.5, "end"];
      const label = element("text", { x, y, "text-anchor": anchor });
      label.textContent = isTime ? dated(k * step, step) : (k * step).toFixed(digits).replace("-", "\u2212");
      this.scale.append(label);
    }
  }
}

/* One drawing: its plots lie above each other and share what is across. */
function enable(svg) {
  const plots = [...svg.querySelectorAll("g[data-box]")].map((group) => new Plot(group));
  if (!plots.length) return;
  const band = element("rect", { class: "band" });
  const readout = document.createElement("output");
  svg.after(readout);
  svg.tabIndex = 0;
  let drag = null;

  const at = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [point.x, point.y];
  };
  const showX = (from, to) => plots.forEach((plot) => plot.show("x", from, to));
  const draw = () => plots.forEach((plot) => plot.draw());
  const reset = () => {
    for (const plot of plots) plot.shown = { x: [...plot.full.x], y: [...plot.full.y] };
    draw();
  };
  const magnify = (factor, share = 0.5) => {
    const [from, to] = plots[0].shown.x;
    const middle = from + share * (to - from);
    showX(middle - share * (to - from) * factor, middle + (1 - share) * (to - from) * factor);
    draw();
  };
  const times = plots.at(-1).group.dataset;
  const said = (label, value) =>
    label === times.xlabel && "dates" in times ? new Date(value * 864e5).toISOString().slice(0, 16).replace("T", " ") : value.toPrecision(4);
  const read = (x, y) => {
    const plot = plots.find((each) => each.holds(x, y));
    const across = plots.at(-1).group.dataset.xlabel;
    readout.textContent = !plot ? "" : [[across, plot.value("x", x)], [plot.group.dataset.ylabel, plot.value("y", y)]]
      .filter(([label]) => label).map(([label, value]) => `${label}: ${said(label, value)}`).join("   ");
  };

  svg.addEventListener("pointerdown", (event) => {
    const [x, y] = at(event);
    const plot = plots.find((each) => each.holds(x, y));
    if (!plot || event.button !== 0) return;
    drag = { plot, x, y, moves: event.shiftKey, from: { x: plot.shown.x, y: plot.shown.y } };
    svg.setPointerCapture(event.pointerId);
    event.preventDefault();
    svg.focus({ preventScroll: true });
  });
  svg.addEventListener("pointermove", (event) => {
    const [x, y] = at(event);
    read(x, y);
    if (!drag) return;
    const { plot } = drag;
    if (drag.moves) {
      const across = ((drag.x - x) / plot.width) * (drag.from.x[1] - drag.from.x[0]);
      const up = ((y - drag.y) / plot.height) * (drag.from.y[1] - drag.from.y[0]);
      showX(drag.from.x[0] + across, drag.from.x[1] + across);
      if (plot.hasValues) plot.show("y", drag.from.y[0] + up, drag.from.y[1] + up);
      draw();
      return;
    }
    const tall = plot.hasValues && Math.abs(y - drag.y) > 0.1 * plot.height;
    const [top, bottom] = tall ? [Math.min(y, drag.y), Math.max(y, drag.y)] : [plot.top, plot.top + plot.height];
    const box = { x: Math.min(x, drag.x), y: top, width: Math.abs(x - drag.x), height: bottom - top };
    for (const [key, value] of Object.entries(box)) band.setAttribute(key, value);
    drag.box = { ...box, tall };
    svg.append(band);
  });
  svg.addEventListener("pointerup", () => {
    band.remove();
    const { plot, box } = drag || {};
    drag = null;
    if (!box || box.width < 3) return;
    const down = [plot.value("y", box.y + box.height), plot.value("y", box.y)];
    showX(plot.value("x", box.x), plot.value("x", box.x + box.width));
    if (box.tall) plot.show("y", ...down);
    draw();
  });
  svg.addEventListener("pointercancel", () => { band.remove(); drag = null; });
  svg.addEventListener("pointerleave", () => { readout.textContent = ""; });
  svg.addEventListener("dblclick", reset);
  svg.addEventListener("keydown", (event) => {
    const [from, to] = plots[0].shown.x;
    const step = 0.25 * (to - from);
    const move = (by) => { showX(from + by, to + by); draw(); };
    const actions = {
      "+": () => magnify(0.5), "=": () => magnify(0.5), "-": () => magnify(2), "0": reset, Escape: reset,
      ArrowLeft: () => move(-step), ArrowRight: () => move(step),
    };
    if (!actions[event.key] || event.ctrlKey || event.metaKey) return;
    actions[event.key]();
    event.preventDefault();
  });
}

/* A drawing that this width of the screen hides has no sizes: it is enabled when it is shown. */
function enableWhenShown(svg) {
  const sizes = new ResizeObserver(() => {
    if (!svg.getClientRects().length) return;
    sizes.disconnect();
    enable(svg);
  });
  sizes.observe(svg);
}

for (const svg of document.querySelectorAll("figure svg")) (svg.getClientRects().length ? enable : enableWhenShown)(svg);
const first = document.querySelector("figure svg");
if (first) {
  const hint = document.createElement("p");
  hint.className = "note hint";
  hint.textContent = HINT;
  (first.closest("section") ?? first.closest("figure")).before(hint);
}
