// The robot in a reader's own hands: the gridworld's moves, with their slips and failures.

const STEPS = [[1, 0], [0, 1], [-1, 0], [0, -1]]; // by heading: east, north, west, south

/** The state that an action leads to; `chance`, a uniform number in [0, 1), decides what it really does. */
const moved = (state, action, { size, slip, turnFailure }, chance) => {
  const { i, j, heading, cell } = placeOf(state, size);
  if (action > 0) {
    const turn = chance < turnFailure ? 0 : action === 1 ? 1 : 3;
    return 4 * cell + ((heading + turn) % 4);
  }
  let turn = 0;
  if (chance < slip) turn = 1;
  else if (chance < 2 * slip) turn = 3;
  const [di, dj] = STEPS[(heading + turn) % 4];
  const inside = [i + di, j + dj].every((at) => at >= 0 && at < size);
  return inside ? state + 4 * (di * size + dj) : state;
};

/** What there is to do for who drives; the player asks it for the episode that is played. */
class Drive {
  constructor(player) {
    this.player = player;
    this.episode = null;
    this.actions = { straight: () => this.act(0), left: () => this.act(1), right: () => this.act(2) };
    for (const [name, action] of Object.entries(this.actions)) player.find("drive", name).addEventListener("click", action);
    player.find("drive", "begin").addEventListener("click", () => this.begin());
    player.find("drive", "end").addEventListener("click", () => this.end());
    player.find("do", "drive").addEventListener("click", () => this.begin());
    this.keys = {
      ArrowUp: this.actions.straight,
      ArrowLeft: this.actions.left,
      ArrowRight: this.actions.right,
      Enter: () => this.begin(),
      Escape: () => this.end(),
    };
  }

  /** From where the recorded episode began. */
  begin() {
    const { player } = this;
    this.episode = { states: [(this.episode || player.episode).states[0]], actions: [], disjunct: player.episode.disjunct };
    player.load();
    player.find("drive", "straight").focus({ preventScroll: true });
  }

  end() {
    this.episode = null;
    this.player.load();
    this.player.find("do", "drive").focus({ preventScroll: true });
  }

  act(action) {
    const { player, episode } = this;
    if (episode.states.length > player.task.deadline) return;
    episode.states.push(moved(episode.states.at(-1), action, player.task, Math.random()));
    episode.actions.push(action);
    player.extend();
  }

  /** Show what belongs to driving, or what belongs to recordings. */
  show() {
    const driving = this.episode !== null;
    const { root } = this.player;
    root.classList.toggle("driving", driving);
    for (const element of root.querySelectorAll(".choices select")) element.disabled = driving;
    this.player.find("show", "driving").hidden = !driving;
    this.player.find("do", "drive").hidden = driving || !this.player.formula;
  }

  outcome() {
    const { player } = this;
    return `Yours to drive, until tick ${player.task.deadline}. Make ${player.formula.symbol} true: ${player.formula.english}.`;
  }
}
