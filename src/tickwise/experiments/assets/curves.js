// Learning curves to look into: values under the pointer, and a closer look at a stretch of episodes.

const LOOKS = {
  I: { dash: "2 3", meaning: "τ-states" },
  II: { dash: "8 3", meaning: "φ′ᵀ, no information gain" },
  III: { dash: "10 3 2 3", meaning: "φᵀ" },
  IV: { dash: null, meaning: "φᵀ, transferred Q̄" },
  V: { dash: "5 2", meaning: "closed loop" },
};

const LEAST_POINTS = 40; // with fewer of them in view, the curve of more points is shown

/** Round numbers for an axis. */
const ticksOf = (low, high, wanted) => {
  const rough = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const ticks = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-9; value += step) ticks.push(Math.round(value / step) * step);
  return ticks;
};

const shortNumber = (value) => {
  if (value >= 1e6) return `${numberText(value / 1e6, 2)}M`;
  return value >= 1000 ? `${numberText(value / 1000, 2)}k` : numberText(value, value < 10 ? 1 : 0);
};

class Chart {
  constructor(chart, { optimum, worst }, hidden) {
    Object.assign(this, { chart, optimum, worst, hidden, at: null });
    const room = 0.04 * (optimum - worst);
    this.full = { x: chart.limits.map((value) => this.scale(value)), y: [worst - room, optimum + 2.5 * room] };
    this.view = this.full;
    const label = `${chart.title}: mean return over ${chart.unit}. Left and right arrow keys read values, plus and minus zoom, shift with arrows moves, 0 resets.`;
    this.plot = svg("svg", { class: "plot", role: "img", "aria-label": label, tabindex: 0 });
    const button = (text, label, action) => {
      const made = html("button", { type: "button", "aria-label": `${chart.title}: ${label}`, title: label }, text);
      made.addEventListener("click", action);
      return made;
    };
    this.closer = button("+", "Zoom in", () => this.scaleView(0.5));
    this.further = button("−", "Zoom out", () => this.scaleView(2));
    this.reset = button("Reset", "Reset zoom", () => this.zoom(this.full));
    const buttons = html("span", { class: "zooms" }, this.closer, this.further, this.reset);
    [this.further.disabled, this.reset.disabled] = [true, true];
    this.readout = html("div", { class: "readout", "aria-live": "polite" });
    const name = html("span", {}, html("strong", {}, chart.title), " ", html("span", { class: "note" }, `mean return by ${chart.unit}`));
    const head = html("p", { class: "chart-head" }, name, buttons);
    this.element = html("div", { class: "chart" }, head, this.plot, this.readout);
    this.plot.addEventListener("pointerdown", (event) => this.press(event));
    this.plot.addEventListener("pointermove", (event) => this.move(event));
    this.plot.addEventListener("pointerup", (event) => this.release(event));
    this.plot.addEventListener("pointercancel", () => this.drop());
    this.plot.addEventListener("pointerleave", () => !this.from && this.read(null));
    this.plot.addEventListener("dblclick", () => this.zoom(this.full));
    this.plot.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.draw()).observe(this.plot);
    this.read(null);
  }

  scale(value) {
    return this.chart.log ? Math.log10(value) : value;
  }

  unscale(value) {
    return this.chart.log ? 10 ** value : value;
  }

  /** The curves at the resolution that the view asks for. */
  get curves() {
    const { levels } = this.chart;
    const share = (this.view.x[1] - this.view.x[0]) / (this.full.x[1] - this.full.x[0]);
    const longest = Math.max(...Object.values(levels[0]).map(({ x }) => x.length));
    const chosen = longest * share >= Math.min(LEAST_POINTS, longest) ? levels[0] : levels[1];
    return Object.entries(chosen).filter(([name]) => !this.hidden.has(name));
  }

  draw() {
    const width = this.plot.clientWidth;
    if (!width) return;
    const height = clamp(width * 0.6, 220, 340);
    this.box = { left: 48, right: width - 18, top: 10, bottom: height - 26 };
    this.plot.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.plot.style.height = `${height}px`;
    const { left, right, top, bottom } = this.box;
    this.clip = this.clip || `clip-${(Chart.count = (Chart.count || 0) + 1)}`;
    const frame = svg("rect", { x: left, y: top, width: right - left, height: bottom - top });
    const content = svg("g", { "clip-path": `url(#${this.clip})` });
    const best = this.y(this.optimum);
    content.append(svg("path", { d: `M${left} ${best} H${right}`, class: "optimum" }));
    content.append(svg("text", { x: right - 4, y: best - 4, "text-anchor": "end", class: "optimum-name" }, `V* = ${numberText(this.optimum, 1)}`));
    for (const [name, curve] of this.curves) content.append(...this.curve(name, curve));
    this.cross = svg("g", { class: "cross" });
    this.band = svg("rect", { class: "selection", visibility: "hidden" });
    this.plot.replaceChildren(svg("defs", {}, svg("clipPath", { id: this.clip }, frame)), this.axes(), content, this.cross, this.band);
    this.showCross();
  }

  x(episodes) {
    const [low, high] = this.view.x;
    return this.box.left + ((this.scale(episodes) - low) / (high - low)) * (this.box.right - this.box.left);
  }

  y(value) {
    const [low, high] = this.view.y;
    return this.box.bottom - ((value - low) / (high - low)) * (this.box.bottom - this.box.top);
  }

  axes() {
    const { left, right, top, bottom } = this.box;
    const group = svg("g", { class: "axes" });
    for (const value of ticksOf(...this.view.y, 5)) {
      group.append(svg("path", { d: `M${left} ${this.y(value)} H${right}` }));
      group.append(svg("text", { x: left - 6, y: this.y(value) + 4, "text-anchor": "end" }, numberText(value, 2)));
    }
    for (const value of this.columns()) {
      group.append(svg("path", { d: `M${this.x(value)} ${top} V${bottom}` }));
      group.append(svg("text", { x: this.x(value), y: bottom + 17, "text-anchor": "middle" }, shortNumber(value)));
    }
    return group;
  }

  columns() {
    const [low, high] = this.view.x.map((value) => this.unscale(value));
    const wanted = clamp(Math.floor((this.box.right - this.box.left) / 80), 2, 8);
    if (!this.chart.log || high / low < 8) return ticksOf(low, high, wanted);
    const steps = high / low < 200 ? [1, 2, 5] : [1];
    const powers = Array.from({ length: 12 }, (_, power) => 10 ** power);
    return powers.flatMap((power) => steps.map((step) => step * power)).filter((value) => value >= low && value <= high);
  }

  curve(name, { x, mean, low, high }) {
    if (!x.length) return [];
    const line = (values) => values.map((value, index) => `${this.x(x[index]).toFixed(1)} ${this.y(value).toFixed(1)}`);
    const back = line(high).reverse();
    const { dash } = LOOKS[name];
    return [
      svg("path", { d: `M${line(low).join(" L")} L${back.join(" L")} Z`, class: `method-${name} interval` }),
      svg("path", { d: `M${line(mean).join(" L")}`, class: `method-${name} mean`, "stroke-dasharray": dash }),
    ];
  }

  /** The values next to a number of episodes. */
  read(episodes) {
    this.at = episodes;
    this.showCross();
    if (episodes === null) {
      this.readout.replaceChildren(html("span", { class: "note" }, "Point at the curves, or focus them and press ← or →, to read values. Drag, or press + and −, to zoom."));
      return;
    }
    const rows = this.curves.flatMap(([name, curve]) => {
      const index = this.nearest(curve.x, episodes);
      if (index === null) return [];
      const [mean, low, high] = [curve.mean, curve.low, curve.high].map((values) => numberText(values[index], 1));
      return [html("span", { class: "value" }, html("span", { class: `swatch method-${name}` }), `${name}: ${mean} `, html("span", { class: "note" }, `[${low}, ${high}]`))];
    });
    this.readout.replaceChildren(html("strong", {}, `${numberText(Math.round(episodes))} episodes `), ...rows);
  }

  /** The index of the nearest point; null beyond the end of a curve. */
  nearest(x, episodes) {
    if (!x.length) return null;
    const wanted = this.scale(episodes);
    const away = x.map((value) => Math.abs(this.scale(value) - wanted));
    const index = away.indexOf(Math.min(...away));
    const width = x.length > 1 ? Math.abs(this.scale(x[Math.max(index, 1)]) - this.scale(x[Math.max(index, 1) - 1])) : Infinity;
    return away[index] <= width ? index : null;
  }

  showCross() {
    if (!this.cross) return;
    this.cross.replaceChildren();
    if (this.at === null || this.at === undefined) return;
    const x = this.x(this.at);
    if (x < this.box.left - 1 || x > this.box.right + 1) return;
    this.cross.append(svg("path", { d: `M${x} ${this.box.top} V${this.box.bottom}` }));
    for (const [name, curve] of this.curves) {
      const index = this.nearest(curve.x, this.at);
      if (index === null) continue;
      this.cross.append(svg("circle", { cx: this.x(curve.x[index]), cy: this.y(curve.mean[index]), r: 4, class: `method-${name} dot` }));
    }
  }

  place(event) {
    const box = this.plot.getBoundingClientRect();
    return [clamp(event.clientX - box.left, this.box.left, this.box.right), clamp(event.clientY - box.top, this.box.top, this.box.bottom)];
  }

  /** The number of episodes, and the return, at a place of the plot. */
  valuesAt([x, y]) {
    const { left, right, top, bottom } = this.box;
    const across = this.view.x[0] + ((x - left) / (right - left)) * (this.view.x[1] - this.view.x[0]);
    const up = this.view.y[0] + ((bottom - y) / (bottom - top)) * (this.view.y[1] - this.view.y[0]);
    return [across, up];
  }

  press(event) {
    if (event.button !== 0 || event.pointerType === "touch") {
      this.move(event);
      return; // on a touch screen a finger reads values and scrolls the page
    }
    this.from = this.place(event);
    this.plot.setPointerCapture(event.pointerId);
  }

  move(event) {
    const to = this.place(event);
    this.read(this.unscale(this.valuesAt(to)[0]));
    if (!this.from) return;
    const tall = Math.abs(to[1] - this.from[1]) > 40;
    const [x, y] = [Math.min(to[0], this.from[0]), tall ? Math.min(to[1], this.from[1]) : this.box.top];
    const height = tall ? Math.abs(to[1] - this.from[1]) : this.box.bottom - this.box.top;
    const frame = { x, y, width: Math.abs(to[0] - this.from[0]), height, visibility: "visible" };
    for (const [name, value] of Object.entries(frame)) this.band.setAttribute(name, value);
  }

  release(event) {
    if (!this.from) return;
    const [from, to] = [this.from, this.place(event)];
    this.drop();
    if (Math.abs(to[0] - from[0]) < 8) return;
    const [a, b] = [this.valuesAt(from), this.valuesAt(to)];
    const ordered = (axis) => [Math.min(a[axis], b[axis]), Math.max(a[axis], b[axis])];
    this.zoom({ x: ordered(0), y: Math.abs(to[1] - from[1]) > 40 ? ordered(1) : this.view.y });
  }

  drop() {
    this.from = null;
    if (this.band) this.band.setAttribute("visibility", "hidden");
  }

  zoom({ x, y }) {
    const least = (this.full.x[1] - this.full.x[0]) / 500;
    const [low, high] = [Math.max(x[0], this.full.x[0]), Math.min(x[1], this.full.x[1])];
    if (high - low < least) return;
    this.view = { x: [low, high], y };
    const whole = low === this.full.x[0] && high === this.full.x[1];
    this.further.disabled = whole;
    this.reset.disabled = whole && y === this.full.y;
    this.closer.disabled = (high - low) / 2 < least;
    this.plot.dataset.from = Math.round(this.unscale(low));
    this.plot.dataset.to = Math.round(this.unscale(high));
    this.draw();
  }

  /** Where values are read, else the middle of the view, on the scale of the axis. */
  get middle() {
    const [low, high] = this.view.x;
    return this.at === null ? (low + high) / 2 : clamp(this.scale(this.at), low, high);
  }

  /** Show so many times as many episodes as now, around those that are read. */
  scaleView(factor) {
    const { middle } = this;
    this.zoom({ x: this.view.x.map((end) => middle + (end - middle) * factor), y: this.view.y });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [low, high] = this.view.x;
    const width = high - low;
    const shift = (by) => () => {
      const moved = clamp(by * width, this.full.x[0] - low, this.full.x[1] - high);
      this.zoom({ x: [low + moved, high + moved], y: this.view.y });
    };
    const step = (by) => () => this.read(this.unscale(clamp(this.middle + (by * width) / 50, low, high)));
    const keys = {
      ArrowLeft: event.shiftKey ? shift(-0.25) : step(-1),
      ArrowRight: event.shiftKey ? shift(0.25) : step(1),
      "+": () => this.scaleView(0.5),
      "=": () => this.scaleView(0.5),
      "-": () => this.scaleView(2),
      0: () => this.zoom(this.full),
      Escape: () => this.zoom(this.full),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  }
}

for (const live of document.querySelectorAll(".live-curves")) {
  const data = dataAfter(live);
  if (!data || !data.charts.length) continue;
  const hidden = new Set();
  const charts = data.charts.map((chart) => new Chart(chart, data, hidden));
  const names = Object.keys(data.charts[0].levels[0]);
  const legend = names.map((name) => {
    const box = html("input", { type: "checkbox", checked: true });
    box.addEventListener("change", () => {
      if (box.checked) hidden.delete(name);
      else hidden.add(name);
      for (const chart of charts) chart.draw();
    });
    const line = svg("path", { d: "M0 6 H34", class: `method-${name} mean`, "stroke-dasharray": LOOKS[name].dash });
    const sample = svg("svg", { viewBox: "0 0 34 12", class: "sample", "aria-hidden": "true" }, line);
    return html("label", { class: "check" }, box, sample, `${name}: ${LOOKS[name].meaning}`);
  });
  live.append(html("div", { class: "legend", role: "group", "aria-label": "Methods shown" }, ...legend));
  live.append(html("div", { class: "charts" }, ...charts.map(({ element }) => element)));
  live.hidden = false;
  live.parentNode.classList.add("has-live");
}
