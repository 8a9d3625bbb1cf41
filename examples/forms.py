"""Which form of learning needs how many episodes: all of them on the target tasks of both case studies.

Every form learns on extended states of the true formula of the task, and so has no collection to pay for. The closed
loop has the source's formula alone, and every episode counts.

    python examples/forms.py --out runs/forms
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from joblib import Parallel, delayed
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tickwise._seeding import generator, seed_sequence
from tickwise.envs.planning import optimal_value, worst_value
from tickwise.experiments.case_studies import STUDIES
from tickwise.experiments.figures.style import STYLE, canvas
from tickwise.experiments.inferences import search_space, uniform_prior
from tickwise.experiments.measures import median_statistics
from tickwise.experiments.study import StudySpec
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.forms import find_form
from tickwise.rl.learner import Learner, LearningForm, QLearning
from tickwise.rl.qlearning import Problem, evaluate
from tickwise.rl.states import automaton_memory, tau_memory
from tickwise.transfer.closed_loop import ClosedLoop, Target
from tickwise.transfer.episodes import good_return, unbroken
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.settings import LoopSettings

LOOKS = {
    "q": ("Q-learning", "#0072B2", "-."),
    "counterfactual": ("counterfactual updates", "#CC79A7", "--"),
    "shaping": ("shaping by the automaton", "#E69F00", (0, (1, 1))),
    "actor_critic": ("actor and critic", "#56B4E9", (0, (5, 2, 1, 2))),
    "model": ("model", "#D55E00", "-"),
    "loop": ("closed loop, from the source's formula", "#009E73", (0, (3, 1))),
}
"""The forms in words, with colours and lines that tell them apart."""

LONGEST = {"model": 2_000, "loop": 2_000}
"""The most episodes of what plans after each; the others have those that are asked for."""


@dataclass(frozen=True)
class Curve:
    """Greedy returns of one run, as a share of the way from always failing to V*.

    Attributes:
        name: The form, or ``loop``.
        episodes: Episodes before each evaluation, shape ``(points,)``.
        shares: What the policy reached there, shape ``(points,)``.
        collected: Episodes that the closed loop collected for; 0 elsewhere.
    """

    name: str
    episodes: NDArray[np.int64]
    shares: NDArray[np.float64]
    collected: int = 0

    @property
    def needed(self) -> int | None:
        """Episodes until the first evaluation at 95 % of V*, and until the closed loop had done collecting."""
        there = np.flatnonzero(self.shares >= 0.95)
        return max(int(self.episodes[there[0]]), self.collected) if len(there) else None


def points(most: int) -> list[int]:
    """After how many episodes to evaluate: every 20, then every fiftieth part of what was."""
    found = [0]
    while found[-1] < most:
        found.append(min(found[-1] + max(20, found[-1] // 50), most))
    return found


def form_of(spec: StudySpec, name: str) -> LearningForm:
    """A form with its measured settings; Q-learning with those of the study."""
    return QLearning(spec.learning.settings) if name == "q" else find_form(name)()


def begin(spec: StudySpec, name: str, seed: int) -> Learner:
    """What learns the target of a study."""
    environment = spec.target
    mdp, task = environment.mdp(), environment.task_table()
    if name != "loop":
        tables = tick_tables(to_sdnf(parse(spec.true["target"])), task.horizon)
        return form_of(spec, name).learner(Problem(mdp, task, automaton_memory(mdp, tables)))
    is_good = good_return if spec.collection.least_ticks is None else unbroken
    problem = Problem(mdp, task, tau_memory(mdp, 1))
    target = Target(problem, uniform_prior(environment), search_space(environment), spec.inference, is_good)
    source = to_sdnf(parse(spec.true["source"]))
    return ClosedLoop(target, source, LoopSettings(), generator(seed, spec.name, "hypotheses"))


def curve(study: str, name: str, episodes: int, seed: int) -> Curve:
    """One run of one form."""
    spec = STUDIES[study]
    learner, rng, fixed = begin(spec, name, seed), generator(seed, study, name), seed_sequence(0, study, "evaluate")
    problem = learner.problem
    best, worst = (value(problem.mdp, problem.task) for value in (optimal_value, worst_value))
    grid = points(min(episodes, LONGEST.get(name, episodes)))
    values = [evaluate(learner.problem, learner.q, fixed, 200)]
    for before, now in pairwise(grid):
        learner.learn(rng, now - before)
        values.append(evaluate(learner.problem, learner.q, fixed, 200))
    collected = 0
    if isinstance(learner, ClosedLoop):
        collected = grid[-1] if learner.collected is None else learner.collected
    return Curve(name, np.array(grid), (np.array(values) - worst) / (best - worst), collected)


def table(curves: Sequence[Curve], limit: int) -> dict[str, Any]:
    """For each form the median episodes to 95 % of V* with their interval, and how many runs got there."""
    found = {}
    for name in LOOKS:
        needed = [each.needed for each in curves if each.name == name]
        filled = [min(LONGEST.get(name, limit), limit) if value is None else value for value in needed]
        reached = sum(value is not None for value in needed)
        found[name] = {**median_statistics(filled, 0), "reached": reached, "runs": needed}
    return found


def draw(curves: dict[str, Sequence[Curve]]) -> Figure:
    """Medians over the runs and their quartiles, a panel a study."""
    figure = canvas(4.4)
    for number, (study, runs) in enumerate(curves.items()):
        axes = figure.add_axes((0.075 + 0.485 * number, 0.33, 0.43, 0.58))
        for name, (label, colour, line) in LOOKS.items():
            mine = [each for each in runs if each.name == name]
            middle = np.median([each.shares for each in mine], axis=0)
            low, high = np.percentile([each.shares for each in mine], [25, 75], axis=0)
            episodes = np.maximum(mine[0].episodes, 10)
            axes.plot(episodes, 100 * middle, color=colour, linestyle=line, linewidth=2, label=label)
            axes.fill_between(episodes, 100 * low, 100 * high, color=colour, alpha=0.12, linewidth=0)
        axes.axhline(95, color="#555555", linewidth=1, linestyle=(0, (2, 2)))
        axes.set(xscale="log", ylim=(-5, 104), xlabel="episodes in the target task (log scale)")
        axes.set_title(STUDIES[study].title.split(":")[0])
        if number == 0:
            axes.set_ylabel("greedy return, % of the way to V*")
        axes.grid(True)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, handlelength=3.4)
    return figure


def main() -> None:
    """Learn, print the table, draw the curves."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("runs/forms"), help="where table and figure go")
    parser.add_argument("--runs", type=int, default=10, help="runs of each form")
    parser.add_argument("--episodes", type=int, default=40_000, help="episodes of each run")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    curves: dict[str, Sequence[Curve]] = {}
    tables: dict[str, Any] = {}
    for study in STUDIES:
        jobs = [(study, name, arguments.episodes, seed) for name in LOOKS for seed in range(arguments.runs)]
        curves[study] = list(Parallel(n_jobs=arguments.workers)(delayed(curve)(*job) for job in jobs))
        tables[study] = table(curves[study], arguments.episodes)
        print(f"{study}: episodes to 95 % of V*, median of {arguments.runs} runs and its 95 % interval")
        for name, row in tables[study].items():
            there = f"{row['reached']} of {arguments.runs} runs"
            print(f"  {LOOKS[name][0]:40} {row['median']:8,.0f} [{row['low']:,.0f}, {row['high']:,.0f}]  {there}")
    (arguments.out / "forms.json").write_text(json.dumps(tables, indent=1) + "\n")
    with matplotlib.rc_context(STYLE):
        draw(curves).savefig(arguments.out / "forms.png", dpi=110)
    print(f"table and curves are in {arguments.out}")


if __name__ == "__main__":
    main()
