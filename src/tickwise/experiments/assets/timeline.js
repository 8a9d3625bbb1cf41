// What holds when: a lane for the locations of each automaton and one for each part of the formula.

class Timeline {
  constructor(deadline, choose) {
    this.ticks = deadline + 1;
    this.lanes = [];
    this.literals = [];
    this.element = html("div", { class: "lanes" });
    const drag = (event) => {
      if (event.type === "pointermove" && !event.buttons) return;
      const lane = event.target.closest(".lane-strip");
      if (!lane) return;
      const box = lane.getBoundingClientRect();
      choose(Math.floor(((event.clientX - box.left) / box.width) * this.ticks));
    };
    this.element.addEventListener("pointerdown", drag);
    this.element.addEventListener("pointermove", drag);
  }

  strip(marks) {
    const cursor = svg("rect", { y: 0, width: 1, height: 1, class: "cursor" });
    const box = { viewBox: `0 0 ${this.ticks} 1`, preserveAspectRatio: "none", class: "lane-strip", "aria-hidden": "true" };
    const ground = svg("rect", { width: this.ticks, height: 1, class: "ground" });
    return { strip: svg("svg", box, ground, ...marks, cursor), cursor };
  }

  /** A cell for each tick of some kind; outside of the window, where nothing depends on it, a low one. */
  cells(kinds, [from, to] = [0, Infinity]) {
    return kinds.flatMap((kind, tick) => {
      if (!kind) return [];
      const looks = kind.startsWith("#") ? { fill: kind, class: "cell" } : { class: `cell ${kind}` };
      const height = tick >= from && tick <= to ? 1 : 0.25;
      return [svg("rect", { x: tick, y: 1 - height, width: 1, height, ...looks })];
    });
  }

  addLocations(title, automaton, run, followed) {
    const cells = this.cells(
      run.map(({ location }) => (outcomeOf(automaton, location) > 0 ? "accepted" : automaton.locations[location].fill)),
    );
    const { strip, cursor } = this.strip(cells);
    const sign = html("span", { class: "sign" });
    const name = html("strong");
    const note = followed ? html("span", { class: "note" }, followed) : null;
    const text = html("p", { class: "lane-text" }, sign, title, " ", name, note);
    this.element.append(html("div", { class: "lane" }, text, strip));
    this.lanes.push({ cells, cursor, update: (tick) => {
      const { location } = run[tick];
      this.mark(sign, outcomeOf(automaton, location));
      name.textContent = automaton.locations[location].name;
    } });
  }

  addPart(part, holding) {
    const [from, to] = [part.window[0], part.window[1] + part.duration];
    const frame = svg("rect", { x: from, y: 0, width: to - from + 1, height: 1, class: "window" });
    const cells = this.cells(holding.map((holds) => (holds ? "holds" : null)), [from, to]);
    const { strip, cursor } = this.strip([frame, ...cells]);
    const sign = html("span", { class: "sign" });
    const word = html("span", { class: "word" });
    const english = html("span", { class: "note" }, part.english);
    const literal = { sign: html("span", { "aria-hidden": "true" }), element: html("span") };
    literal.element.append(literal.sign, part.text);
    this.literals.push(literal.element);
    this.element.append(
      html("div", { class: "lane" }, html("p", { class: "lane-text" }, sign, part.text, " ", word, english), strip),
    );
    this.lanes.push({ cells, cursor, update: (tick) => {
      const verdict = verdictOf(part, holding, tick);
      this.mark(sign, verdict);
      word.textContent = VERDICTS[verdict].word;
      sign.parentNode.dataset.verdict = verdict;
      literal.sign.textContent = VERDICTS[verdict].sign;
      literal.element.className = `literal ${VERDICTS[verdict].kind}`;
    } });
  }

  /** Above the lanes the formula, whose parts turn true or false; below them what their colours mean. */
  finish(symbol, disjuncts) {
    const rest = [...this.literals];
    const line = disjuncts.flatMap((parts, number) => {
      const conjunction = rest.splice(0, parts.length).flatMap((literal, index) => (index ? [" ∧ ", literal] : [literal]));
      const enclosed = disjuncts.length > 1 && parts.length > 1 ? ["( ", ...conjunction, " )"] : conjunction;
      return number ? [" ∨ ", ...enclosed] : enclosed;
    });
    this.element.prepend(html("p", { class: "parts" }, `${symbol} = `, ...line));
    const sample = (kind, text) => {
      const box = svg("svg", { viewBox: "0 0 20 10", "aria-hidden": "true" }, svg("rect", { width: 20, height: 10, class: kind }));
      return html("span", {}, box, ` ${text}`);
    };
    const [holds, window] = [sample("cell holds", "what a part asks of the state holds"), sample("window", "ticks that it looks at; lanes are low elsewhere")];
    this.element.append(html("p", { class: "note lane-key" }, holds, window, sample("cell holds ahead", "still to come")));
  }

  mark(sign, verdict) {
    sign.textContent = VERDICTS[verdict].sign;
    sign.className = `sign ${VERDICTS[verdict].kind}`;
  }

  show(tick) {
    for (const { cells, cursor, update } of this.lanes) {
      cursor.setAttribute("x", tick);
      for (const cell of cells) cell.classList.toggle("ahead", Number(cell.getAttribute("x")) > tick);
      update(tick);
    }
  }
}
