// What holds when: a lane for the locations of each automaton and one for each part of the formula.

class Timeline {
  constructor(deadline, choose) {
    this.ticks = deadline + 1;
    this.lanes = [];
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

  cells(kinds) {
    return kinds.flatMap((kind, tick) => {
      if (!kind) return [];
      const looks = kind.startsWith("#") ? { fill: kind, class: "cell" } : { class: `cell ${kind}` };
      return [svg("rect", { x: tick, y: 0, width: 1, height: 1, ...looks })];
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
    const cells = this.cells(holding.map((holds) => (holds ? "holds" : null)));
    const { strip, cursor } = this.strip([frame, ...cells]);
    const sign = html("span", { class: "sign" });
    const word = html("span", { class: "word" });
    const english = html("span", { class: "note" }, part.english);
    this.element.append(
      html("div", { class: "lane" }, html("p", { class: "lane-text" }, sign, part.text, " ", word, english), strip),
    );
    this.lanes.push({ cells, cursor, update: (tick) => {
      const verdict = verdictOf(part, holding, tick);
      this.mark(sign, verdict);
      word.textContent = VERDICTS[verdict].word;
      sign.parentNode.dataset.verdict = verdict;
    } });
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
