// A gridworld with its regions, the robot and its way.

const CELL = 40;
const EDGE = 22;

/** The cell (i, j) and the heading of a numbered state, as the environment counts them. */
const placeOf = (state, size) => {
  const cell = Math.floor(state / 4);
  return { i: Math.floor(cell / size), j: cell % size, heading: state % 4, cell };
};

class WorldView {
  constructor(task, formula) {
    this.size = task.size;
    const side = task.size * CELL;
    this.element = svg("svg", { viewBox: `0 0 ${side + EDGE + 8} ${side + EDGE + 10}`, class: "map", role: "img" });
    this.title = svg("title");
    this.element.append(this.title, this.floor(side));
    this.truth = svg("g", { class: "truth" }, ...task.landmarks.map((each) => this.landmark(each)));
    this.regions = (formula ? formula.regions : []).map((region) => this.region(region));
    this.ghost = svg("polyline", { class: "ghost" });
    this.trail = svg("polyline", { class: "trail" });
    this.begin = svg("circle", { r: 5, class: "begin" });
    const body = "M16 0 L-12 12 L-6 0 L-12 -12 Z";
    this.robot = svg("g", { class: "robot" }, svg("circle", { r: 17 }), svg("path", { d: body }));
    const names = this.regions.map(({ name }) => name);
    this.element.append(...this.regions.map(({ group }) => group), this.truth, this.ghost, this.trail, this.begin);
    this.element.append(...names, this.robot);
    this.turned = null;
  }

  x(value) {
    return EDGE + value * CELL;
  }

  y(value) {
    return 8 + (this.size - value) * CELL;
  }

  floor(side) {
    const group = svg("g", { class: "floor" });
    group.append(svg("rect", { x: this.x(0), y: this.y(this.size), width: side, height: side }));
    for (let line = 0; line <= this.size; line += 1) {
      group.append(svg("path", { d: `M${this.x(line)} ${this.y(0)} V${this.y(this.size)}` }));
      group.append(svg("path", { d: `M${this.x(0)} ${this.y(line)} H${this.x(this.size)}` }));
      group.append(svg("text", { x: this.x(line), y: this.y(0) + 15, "text-anchor": "middle" }, line));
      group.append(svg("text", { x: EDGE - 6, y: this.y(line) + 4, "text-anchor": "end" }, line));
    }
    return group;
  }

  frame([left, bottom, right, top]) {
    return { x: this.x(left), y: this.y(top), width: (right - left) * CELL, height: (top - bottom) * CELL };
  }

  landmark({ name, rectangle, colour }) {
    const frame = this.frame(rectangle);
    const lines = [];
    // slanted lines, cut at the frame by hand: a pattern or a clip path would need an identifier of its own
    for (let shift = 12; shift < frame.width + frame.height; shift += 12) {
      const [from, to] = [Math.max(0, shift - frame.height), Math.min(frame.width, shift)];
      lines.push(`M${frame.x + from} ${frame.y + shift - from} L${frame.x + to} ${frame.y + shift - to}`);
    }
    const above = rectangle[3] + 0.6 <= this.size;
    const y = above ? frame.y - 5 : frame.y + frame.height + 16;
    const label = svg("text", { x: frame.x + frame.width, y, "text-anchor": "end" }, name);
    return svg("g", {}, svg("path", { d: lines.join(" "), class: "hatch" }), svg("rect", { ...frame, class: colour }), label);
  }

  region({ name, rectangle, colour, cells }) {
    const frame = this.frame(rectangle);
    let place = { x: frame.x + 5, y: frame.y + 17 };
    if (Math.min(frame.width, frame.height) < 2 * CELL) { // the robot would hide it
      const y = frame.y + frame.height / 2 + 5;
      const left = rectangle[0] >= 1;
      place = { x: left ? frame.x - 6 : frame.x + frame.width + 6, y, "text-anchor": left ? "end" : "start" };
    }
    const label = svg("text", { ...place, class: "region-name" }, name);
    return { cells, name: label, group: svg("rect", { ...frame, class: `region ${colour}` }) };
  }

  /** Take up an episode: its whole way is drawn faintly. */
  load(states) {
    this.extend(states);
    const [first] = this.path;
    this.begin.setAttribute("cx", this.x(first.i + 0.5));
    this.begin.setAttribute("cy", this.y(first.j + 0.5));
    this.turned = null;
  }

  extend(states) {
    this.path = states.map((state) => placeOf(state, this.size));
    this.ghost.setAttribute("points", this.points(this.path));
  }

  points(path) {
    return path.map(({ i, j }) => `${this.x(i + 0.5)},${this.y(j + 0.5)}`).join(" ");
  }

  /** The names of the regions that the robot is in. */
  within(tick) {
    return this.regions.filter(({ cells }) => cells[this.path[tick].cell] === "1").map(({ name }) => name.textContent);
  }

  show(tick, headings) {
    const { i, j, heading, cell } = this.path[tick];
    this.trail.setAttribute("points", this.points(this.path.slice(0, tick + 1)));
    // the shorter way round, so that a turn from south to east is no spin
    const before = this.turned === null ? heading : this.turned;
    this.turned = before + ((((heading - before) % 4) + 6) % 4) - 2;
    const turn = `rotate(${-90 * this.turned}deg)`;
    this.robot.style.transform = `translate(${this.x(i + 0.5)}px, ${this.y(j + 0.5)}px) ${turn}`;
    for (const { cells, group, name } of this.regions) {
      const lit = cells[cell] === "1";
      group.classList.toggle("lit", lit);
      name.classList.toggle("lit", lit);
    }
    const within = this.within(tick);
    const where = within.length ? `, in ${within.join(" and ")}` : "";
    this.title.textContent = `World of ${this.size} by ${this.size} cells; the robot is in cell (${i}, ${j}), facing ${headings[heading]}${where}`;
  }
}
