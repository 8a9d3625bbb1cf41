// Timed automata: their runs, what prefixes say of a formula's parts, and the drawing with the current location.

/** The run on letters, one a tick: all clocks grow by one between ticks, then the one edge that fits is taken. */
const runOf = (automaton, letters) => {
  let location = automaton.initial;
  let clocks = automaton.clocks.map(() => 0);
  return letters.map((letter, tick) => {
    if (tick > 0) clocks = clocks.map((value) => value + 1);
    const edge = automaton.edges.find(
      (each) =>
        each.source === location &&
        (letter & each.mask) === each.wanted &&
        each.ranges.every(([low, high], clock) => low <= clocks[clock] && (high === null || clocks[clock] <= high)),
    );
    location = edge.target;
    clocks = clocks.map((value, clock) => (edge.resets.includes(clock) ? 0 : value));
    return { edge, location, clocks };
  });
};

/** What a location says of the conjunction: 1 true, 0 unknown, -1 false. */
const outcomeOf = (automaton, location) =>
  ({ accepting: 1, rejecting: -1, working: 0 })[automaton.locations[location].kind];

/** The three-valued verdict of a part once the ticks up to `tick` are known (Kleene's min and max). */
const verdictOf = (part, holding, tick) => {
  const over = (operator, from, to, value) => {
    const values = [];
    for (let at = from; at <= to; at += 1) values.push(value(at));
    return operator === "F" ? Math.max(...values) : Math.min(...values);
  };
  const atom = (at) => (at > tick ? 0 : holding[at] ? 1 : -1);
  const [outer, inner] = part.operator;
  const within = inner ? (at) => over(inner, at, at + part.duration, atom) : atom;
  return over(outer, part.window[0], part.window[1], within);
};

const VERDICTS = {
  1: { sign: "✓", word: "true", kind: "is-true" },
  0: { sign: "○", word: "open", kind: "is-open" },
  "-1": { sign: "✗", word: "false", kind: "is-false" },
};

const RADIUS = 22;
const ROW = 102;
const LINE_HEIGHT = 15;
const LEAST = 0.78; // of its size: where there is less room the drawing scrolls, for smaller labels could not be read

class AutomatonView {
  constructor(automaton) {
    this.automaton = automaton;
    const nested = automaton.parts.map((part) => part.operator.length === 2);
    const columns = automaton.parts.length;
    // labels on the left of a column need room, and more beside those on the right of the column before it
    this.step = nested.slice(1).some((each, before) => each && nested[before]) ? 410 : nested.slice(1).some(Boolean) ? 330 : 225;
    const rows = automaton.locations.map(({ place }) => place[1]);
    const [lowest, highest] = [Math.min(...rows), Math.max(...rows)];
    const left = nested[0] ? 172 : 52;
    this.places = automaton.locations.map(({ place: [x, y] }) => [left + x * this.step, 80 + (highest - y) * ROW]);
    this.above = new Set(
      automaton.locations.flatMap(({ place: [x, y] }, number) =>
        automaton.locations.some(({ place }) => place[0] === x && place[1] === y + 1) ? [number] : [],
      ),
    );
    const width = left + columns * this.step + 40;
    const height = 80 + (highest - lowest) * ROW + RADIUS + 14;
    this.edges = new Map();
    this.circles = [];
    this.element = svg("svg", { viewBox: `0 0 ${width} ${height}`, class: "automaton", role: "img" });
    this.element.style.maxWidth = `${width}px`;
    this.element.style.minWidth = `${LEAST * width}px`;
    this.title = svg("title");
    this.element.append(this.title, svg("defs", {}, ...["plain", "taken"].map((kind) => this.marker(kind))));
    this.drawEdges();
    automaton.locations.forEach((location, number) => this.drawLocation(location, number));
  }

  /** Identifiers of markers hold for the whole page, so each drawing has its own. */
  marker(kind) {
    AutomatonView.count = (AutomatonView.count || 0) + 1;
    this[kind] = `arrow-${AutomatonView.count}`;
    const shape = svg("path", { d: "M0 0 L10 4 L0 8 Z", class: `head ${kind}` });
    const size = { markerWidth: 10, markerHeight: 8, refX: 9, refY: 4, markerUnits: "userSpaceOnUse" };
    return svg("marker", { id: this[kind], orient: "auto", ...size }, shape);
  }

  drawEdges() {
    const { locations, initial } = this.automaton;
    const groups = new Map();
    for (const edge of this.automaton.edges) {
      if (locations[edge.source].kind !== "working") continue;
      const key = `${edge.source} ${edge.target}`;
      groups.set(key, [...(groups.get(key) || []), edge]);
    }
    for (const edges of groups.values()) {
      const { source, target } = edges[0];
      const { path, at, anchor, rise } = source === target ? this.loop(source) : this.curve(source, target);
      const line = svg("path", { d: path, class: "edge", "marker-end": `url(#${this.plain})` });
      const rows = edges.flatMap((edge) => edge.label.map((text) => ({ edge, text })));
      const top = { bottom: -(rows.length - 1) * LINE_HEIGHT - 3, centre: 4.5 - ((rows.length - 1) * LINE_HEIGHT) / 2, top: 12 };
      const texts = rows.map(({ edge, text }, number) => {
        const place = { x: at[0], y: at[1] + top[rise] + number * LINE_HEIGHT };
        return { edge, text: svg("text", { ...place, "text-anchor": anchor, class: "guard" }, text) };
      });
      this.element.append(line);
      for (const edge of edges) {
        this.edges.set(edge, { line, texts: texts.filter((each) => each.edge === edge).map((each) => each.text) });
      }
      this.labels = [...(this.labels || []), ...texts.map((each) => each.text)];
    }
    this.element.append(...(this.labels || []));
    const [x, y] = this.places[initial];
    const slant = RADIUS * Math.SQRT1_2;
    const start = `M${x - 44} ${y + 44} L${x - slant} ${y + slant}`;
    this.element.append(svg("path", { d: start, class: "edge", "marker-end": `url(#${this.plain})` }));
  }

  loop(location) {
    const [x, y] = this.places[location];
    let shape = { angle: 215, at: [x - 48, y + 42], anchor: "end", rise: "centre" };
    if (!this.above.has(location)) shape = { angle: 90, at: [x + 24, y - 52], anchor: "start", rise: "centre" };
    else if (location === this.automaton.initial) shape = { angle: 180, at: [x - 58, y - 2], anchor: "end", rise: "centre" };
    const turn = (shape.angle * Math.PI) / 180;
    const point = (reach, angle) => `${x + reach * Math.cos(angle)} ${y - reach * Math.sin(angle)}`;
    const path =
      `M${point(RADIUS, turn - 0.5)} C${point(70, turn - 0.5)} ${point(70, turn + 0.5)} ${point(RADIUS + 1, turn + 0.5)}`;
    return { ...shape, path };
  }

  /** An edge between two locations, and where its label stands; both follow from where the two are. */
  curve(source, target) {
    const [[x1, y1], [x2, y2]] = [this.places[source], this.places[target]];
    const rows = Math.round((y1 - y2) / ROW);
    const rejecting = this.automaton.locations[target].kind === "rejecting";
    let bend = [(x1 + x2) / 2, (y1 + y2) / 2];
    let label = [0, -6, "middle", "bottom"];
    if (x1 !== x2 && rows) {
      if (!this.above.has(target)) bend = [x1 + 0.62 * (x2 - x1), y1];
      label = [9, -6, "start", "bottom"];
    } else if (x1 !== x2) label = [10, -6, "middle", "bottom"];
    else if (rows === 1) [bend, label] = [[x1 - 30, (y1 + y2) / 2], [-7, 0, "end", "centre"]];
    else if (rows === -1 && !rejecting) [bend, label] = [[x1 + 30, (y1 + y2) / 2], [7, 4, "start", "centre"]];
    else if (rows === -1) label = [7, 0, "start", "centre"];
    else [bend, label] = [[x1 + 250, (y1 + y2) / 2], [-4, 24, "start", "top"]];
    const rim = ([x, y], gap) => {
      const [across, down] = [bend[0] - x, bend[1] - y];
      const length = Math.hypot(across, down) || 1;
      return [x + ((RADIUS + gap) * across) / length, y + ((RADIUS + gap) * down) / length];
    };
    const [first, last] = [rim([x1, y1], 0), rim([x2, y2], 1)];
    const middle = [0, 1].map((axis) => 0.25 * (first[axis] + last[axis]) + 0.5 * bend[axis]);
    const at = [middle[0] + label[0], middle[1] + label[1]];
    return { path: `M${first} Q${bend} ${last}`, at, anchor: label[2], rise: label[3] };
  }

  drawLocation(location, number) {
    const [x, y] = this.places[number];
    const circle = svg("circle", { cx: x, cy: y, r: RADIUS, class: "place", fill: location.fill });
    const inner = location.kind === "accepting" ? svg("circle", { cx: x, cy: y, r: RADIUS - 4, class: "inner" }) : null;
    const name = svg("text", { x, y: y + 4.5, "text-anchor": "middle", class: "name" }, location.name);
    const ring = svg("circle", { cx: x, cy: y, r: RADIUS + 6, class: "ring" });
    const group = svg("g", { class: "location" }, svg("title", {}, location.meaning), ring, circle, inner, name);
    this.circles.push(group);
    this.element.append(group);
  }

  /** Where each location lies from left to right, as a share of the width. */
  shareOf(location) {
    return this.places[location][0] / this.element.viewBox.baseVal.width;
  }

  show({ location, edge }) {
    this.circles.forEach((group, number) => group.classList.toggle("current", number === location));
    for (const [each, { line, texts }] of this.edges) {
      for (const text of texts) text.classList.toggle("taken", each === edge);
      if (each.target !== edge.target || each.source !== edge.source) {
        line.classList.remove("taken");
        line.setAttribute("marker-end", `url(#${this.plain})`);
      }
    }
    const taken = this.edges.get(edge);
    if (taken) {
      taken.line.classList.add("taken");
      taken.line.setAttribute("marker-end", `url(#${this.taken})`);
    }
    const { name, meaning } = this.automaton.locations[location];
    this.title.textContent = `Timed automaton, now in ${name}: ${meaning}`;
  }
}
