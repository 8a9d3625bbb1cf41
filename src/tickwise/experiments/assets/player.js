// The player: chooses a recorded episode and moves through its ticks.

const SPEEDS = [1, 2, 4, 8, 16];

class Player {
  constructor(root, data) {
    this.root = root;
    this.data = data;
    this.timer = null;
    this.tick = 0;
    this.chosen = { method: 0, run: 0, point: 0, episode: 0 };
    const telling = ["IV", "III", "V", "II", "I", "source"].map((key) => data.methods.findIndex((each) => each.key === key));
    this.chosen.method = telling.find((index) => index >= 0);
    this.chosen.point = this.points.length - 1;
    const returns = this.points.at(-1).episodes.map((each) => each.return);
    this.chosen.episode = returns.indexOf(Math.max(...returns));
    root.previousElementSibling.remove(); // it says that there is no player
    root.hidden = false;
    root.tabIndex = 0;
    this.drive = new Drive(this);
    this.listen();
    this.load();
  }

  find(kind, name) {
    return this.root.querySelector(`[data-${kind}="${name}"]`);
  }

  get method() {
    return this.data.methods[this.chosen.method];
  }

  get points() {
    return this.method.runs[clamp(this.chosen.run, 0, this.method.runs.length - 1)].points;
  }

  get last() {
    return this.episode.states.length - 1;
  }

  listen() {
    for (const name of Object.keys(this.chosen)) {
      this.find("choose", name).addEventListener("change", (event) => this.choose(name, Number(event.target.value)));
    }
    this.find("choose", "truth").addEventListener("change", () => this.show());
    this.find("choose", "tick").addEventListener("input", (event) => this.go(Number(event.target.value)));
    this.find("choose", "speed").addEventListener("change", () => this.playing && this.play());
    const actions = {
      first: () => this.go(0),
      back: () => this.go(this.tick - 1),
      play: () => this.toggle(),
      forth: () => this.go(this.tick + 1),
      last: () => this.go(this.last),
    };
    for (const [name, action] of Object.entries(actions)) this.find("do", name).addEventListener("click", action);
    this.root.addEventListener("keydown", (event) => this.press(event, actions));
  }

  press(event, actions) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const pressable = ["BUTTON", "SUMMARY"].includes(event.target.tagName) || event.target.type === "checkbox";
    if ([" ", "Enter"].includes(event.key) && pressable) return; // there it presses what has the focus
    const cycle = (name, by, count) => () => this.choose(name, (this.chosen[name] + by + count) % count);
    const keys = {
      " ": actions.play,
      ArrowLeft: actions.back,
      ArrowRight: actions.forth,
      Home: actions.first,
      End: actions.last,
      "-": () => this.changeSpeed(-1),
      "+": () => this.changeSpeed(1),
      "=": () => this.changeSpeed(1),
      ",": cycle("episode", -1, this.point.episodes.length),
      ".": cycle("episode", 1, this.point.episodes.length),
      "[": cycle("point", -1, this.points.length),
      "]": cycle("point", 1, this.points.length),
      m: cycle("method", 1, this.data.methods.length),
      r: cycle("run", 1, this.method.runs.length),
    };
    const action = this.drive.episode ? this.drive.keys[event.key] : keys[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  choose(name, value) {
    this.chosen[name] = value;
    this.load();
  }

  changeSpeed(by) {
    const select = this.find("choose", "speed");
    select.selectedIndex = clamp(select.selectedIndex + by, 0, SPEEDS.length - 1);
    if (this.playing) this.play();
  }

  /** Take up the chosen episode from its first tick. */
  load() {
    this.pause();
    this.chosen.run = clamp(this.chosen.run, 0, this.method.runs.length - 1);
    this.chosen.point = clamp(this.chosen.point, 0, this.points.length - 1);
    this.point = this.points[this.chosen.point];
    this.chosen.episode = clamp(this.chosen.episode, 0, this.point.episodes.length - 1);
    this.episode = this.drive.episode || this.point.episodes[this.chosen.episode];
    this.task = this.data.tasks[this.method.task];
    this.formula = this.data.formulas[this.point.formula || this.method.formula] || null;
    this.offer("method", this.data.methods.map(({ title }) => title));
    this.find("choose", "method").title = this.method.title; // a narrow screen cuts it off
    this.offer("run", this.method.runs.map(({ run }) => run));
    this.offer("point", this.points.map(({ learned, mean }) =>
      `${numberText(learned)} episodes (mean return ${numberText(mean, 1)})`));
    this.offer("episode", this.point.episodes.map((each, number) =>
      `${number + 1} (return ${numberText(each.return, 1)})`));
    const scrubber = this.find("choose", "tick");
    scrubber.max = this.last;
    this.world = new WorldView(this.task, this.formula);
    this.world.load(this.episode.states);
    this.find("show", "world").replaceChildren(this.world.element);
    this.readFormula();
    this.find("show", "outcome").textContent = this.drive.episode ? this.drive.outcome() : this.outcome();
    this.drive.show();
    this.find("show", "formula").textContent = this.formula ? this.meaning() : "";
    const { title, runs } = this.method;
    const run = `run ${runs[this.chosen.run].run}, after ${numberText(this.point.learned)} learned episodes`;
    this.find("show", "episode").textContent = `${title}; ${run}, episode ${this.chosen.episode + 1}.`;
    this.go(0);
  }

  /** Take up what was added to the end of the episode. */
  extend() {
    this.find("choose", "tick").max = this.last;
    this.world.extend(this.episode.states);
    this.readFormula();
    this.go(this.last);
  }

  offer(name, options) {
    const select = this.find("choose", name);
    select.replaceChildren(...options.map((text, value) => html("option", { value }, text)));
    select.value = this.chosen[name];
  }

  /** The run of each automaton on the episode, and the panels that show it. */
  readFormula() {
    const cells = this.episode.states.map((state) => placeOf(state, this.task.size).cell);
    const timeline = new Timeline(this.task.deadline, (tick) => this.go(tick));
    const automata = this.formula ? this.formula.automata : [];
    this.followed = this.method.follows ? Math.max(this.episode.disjunct, 0) : 0;
    this.views = automata.map((automaton, number) => {
      const holding = automaton.parts.map(({ region, complemented }) =>
        cells.map((cell) => (this.formula.regions[region].cells[cell] === "1") !== complemented));
      const letters = cells.map((_, tick) =>
        holding.reduce((letter, holds, bit) => letter | (holds[tick] ? 1 << bit : 0), 0));
      const run = runOf(automaton, letters);
      const which = automata.length > 1 ? `, disjunct ${number + 1}` : "";
      const title = `${this.formula.symbol}${which}: location`;
      const followed = this.method.follows && automata.length > 1 && this.followed === number;
      timeline.addLocations(title, automaton, run, followed ? "the one that the learner follows" : null);
      automaton.parts.forEach((part, index) => timeline.addPart(part, holding[index]));
      return { automaton, run, view: new AutomatonView(automaton), clocks: html("p", { class: "clocks" }) };
    });
    const panels = this.views.map(({ view, clocks }, number) => {
      const parts = [html("div", { class: "scroll" }, view.element), clocks];
      if (number === this.followed) return html("div", { class: "automaton-box" }, ...parts);
      return html("details", { class: "automaton-box" }, html("summary", {}, `The automaton of disjunct ${number + 1}`), ...parts);
    });
    if (automata.length) timeline.finish(this.formula.symbol, automata.map(({ parts }) => parts));
    if (panels.length) panels.unshift(...panels.splice(this.followed, 1));
    const observer = html("p", { class: "note" }, "Method I does not know this automaton; it only looks on.");
    const missing = html("p", { class: "missing" }, "No formula was inferred, so there is no automaton.");
    const notes = panels.length ? (this.method.follows ? [] : [observer]) : [missing];
    this.find("show", "automata").replaceChildren(...panels, ...notes);
    this.timeline = timeline;
    this.find("show", "timeline").replaceChildren(timeline.element);
  }

  /** The formula in words, and whose it is where it changes on the way. */
  meaning() {
    const { formula, learned, tested } = this.point;
    const whose = `, this run’s ${tested ? "formula" : "best guess"} after ${numberText(learned)} episodes`;
    return `${this.formula.symbol}${formula ? whose : ""}: ${this.formula.english}.`;
  }

  outcome() {
    const { success } = this.episode;
    const early = this.last < this.task.deadline ? `, which ended it at tick ${this.last}` : "";
    const said = success ? "the hidden task was done" : `the hidden task failed${early}`;
    return `Return ${numberText(this.episode.return, 1)}: ${said}.`;
  }

  go(tick) {
    this.tick = clamp(tick, 0, this.last);
    if (this.tick === this.last) this.pause();
    this.show();
  }

  get playing() {
    return this.timer !== null;
  }

  toggle() {
    if (this.playing) {
      this.pause();
      this.show();
      return;
    }
    if (this.tick === this.last) this.go(0);
    this.play();
  }

  play() {
    clearInterval(this.timer);
    this.timer = setInterval(() => this.go(this.tick + 1), 1000 / Number(this.find("choose", "speed").value));
    this.label("Pause", "M6 5h4v14H6ZM14 5h4v14h-4Z");
  }

  pause() {
    clearInterval(this.timer);
    this.timer = null;
    this.label("Play", "M7 4l13 8-13 8Z");
  }

  label(word, icon) {
    const button = this.find("do", "play");
    button.setAttribute("aria-label", word);
    button.title = `${word} (Space)`;
    button.querySelector("path").setAttribute("d", icon);
    // a reader of the screen hears each step, but not each tick that is played
    this.find("show", "now").setAttribute("aria-live", this.playing ? "off" : "polite");
  }

  show() {
    const { tick, root } = this;
    this.world.truth.classList.toggle("off", !this.find("choose", "truth").checked);
    this.world.show(tick, this.data.headings);
    for (const { automaton, run, view, clocks } of this.views) {
      view.show(run[tick]);
      this.showClocks(automaton, run[tick], clocks);
      const scroll = view.element.parentNode;
      if (scroll.scrollWidth > scroll.clientWidth) {
        scroll.scrollLeft = view.shareOf(run[tick].location) * scroll.scrollWidth - scroll.clientWidth / 2;
      }
    }
    this.timeline.show(tick);
    const scrubber = this.find("choose", "tick");
    scrubber.value = tick;
    scrubber.setAttribute("aria-valuetext", `tick ${tick} of ${this.last}`);
    this.find("show", "tick").textContent = `tick ${tick} of ${this.last}`;
    this.find("show", "deed").textContent = this.deed();
    this.find("show", "now").textContent = this.now();
    root.dataset.tick = tick;
    root.dataset.locations = JSON.stringify(this.views.map(({ run }) => run[tick].location));
    root.dataset.clocks = JSON.stringify(this.views.map(({ run }) => run[tick].clocks));
  }

  showClocks(automaton, { location, clocks }, element) {
    const { active, name, meaning } = automaton.locations[location];
    const chips = clocks.map((value, clock) => {
      const idle = !active.includes(clock);
      return html("span", { class: idle ? "clock idle" : "clock", title: idle ? "no guard reads it here" : null },
        `${automaton.clocks[clock]} = ${value}`);
    });
    element.replaceChildren(html("strong", {}, name), ` ${meaning} `, ...chips);
  }

  /** What the robot did to get here. */
  deed() {
    const within = this.world.within(this.tick);
    const where = within.length ? ` The robot is in ${within.join(" and ")}.` : "";
    if (!this.tick) return `The episode begins.${where}`;
    const [before, now] = [this.tick - 1, this.tick].map((at) => placeOf(this.episode.states[at], this.task.size));
    const action = this.episode.actions[this.tick - 1];
    const [dx, dy] = [now.i - before.i, now.j - before.j];
    const [x, y] = STEPS[before.heading];
    const [ahead, side] = [dx * x + dy * y, dy * x - dx * y];
    let how = "";
    if (action === 0 && side) how = `, and slipped to the ${side > 0 ? "left" : "right"}`;
    else if (action === 0 && !ahead) how = ", and stayed at the wall";
    else if (action > 0 && now.heading === before.heading) how = ", and the turn failed";
    return `Action: ${this.data.actions[action]}${how}.${where}`;
  }

  now() {
    const { tick, episode, task } = this;
    const verdict = Math.max(-1, ...this.views.map(({ automaton, run }) => outcomeOf(automaton, run[tick].location)));
    const says = this.views.length ? `${this.formula.symbol} is ${verdict ? VERDICTS[verdict].word : "not decided yet"}. ` : "";
    if (this.drive.episode) return `Tick ${tick}: ${says}`;
    const sum = episode.rewards.slice(0, tick + 1).reduce((total, reward) => total + reward, 0);
    return `Tick ${tick}: ${says}Hidden task: ${task.stages[episode.stages[tick]]}. Return so far: ${numberText(sum, 1)}.`;
  }
}

for (const root of document.querySelectorAll(".player")) {
  const data = dataAfter(root);
  if (data) new Player(root, data);
}
