"""What the extended state and transfer buy in environments that others wrote: the parts that the examples share.

An agent that wants the goal, and knows of no times, leaves logs in the source and in the target. They are labelled by
whether a timed requirement was met, which no agent ever sees but for its label or its reward at the end. From them the
formulas are inferred; four agents then learn the target, which remember nothing, the tick, the formula's location and
clocks, or these with values that were learned in the source.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.ticker import StrMethodFormatter
from numpy.typing import NDArray
from scipy.stats import binom

from tickwise.envs.enumeration import Tabulation
from tickwise.envs.planning import best_success_probability
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.temporal import FormulaTask
from tickwise.experiments.figures.style import STYLE, canvas
from tickwise.inference.exact import ExactSettings
from tickwise.inference.prior import BoxPrior
from tickwise.inference.readable import readable
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.sdnf import SDNF
from tickwise.rl.qlearning import Problem, QSettings, collect, evaluate, learn
from tickwise.rl.states import Memory, automaton_memory, tau_memory, tick_memory
from tickwise.transfer.hypothesis import Task, require_transferable, tick_tables, transfer_structure
from tickwise.transfer.landmarks import landmarks
from tickwise.transfer.qtransfer import transfer_q

METHODS = {
    "state": ("#000000", ":"),
    "state and tick": ("#CC79A7", "--"),
    "extended state": ("#0072B2", "-."),
    "extended state, transferred values": ("#D55E00", "-"),
}
"""The agents, each with its colour and line."""

EVALUATIONS = 10
"""Evaluations in a row whose mean says whether a level is reached."""


@dataclass(frozen=True)
class Place:
    """A world with its requirement and what an agent without one wants there, such as the goal.

    Attributes:
        mdp: The world.
        requirement: What has to be done, and when.
        wish: What the agent wants whose episodes are logged.
    """

    mdp: TabularMDP
    requirement: FormulaTask
    wish: FormulaTask

    @classmethod
    def of(cls, tabulation: Tabulation, requirement: str, wish: str, deadline: int) -> Place:
        """A world and the formulas over it; an episode lasts until the deadline, since what is over stays over."""
        tasks = (FormulaTask(text, deadline, reward=100, penalty=0) for text in (requirement, wish))
        return cls(tabulation.mdp, *tasks)

    @cached_property
    def best(self) -> float:
        """The probability with which the best policy meets the requirement."""
        return best_success_probability(self.mdp, self.requirement.table(self.mdp))


@dataclass(frozen=True)
class Inferred:
    """What the logs of both tasks say.

    Attributes:
        formulas: φ^S and φ^T.
        logs: The logs of the source and of the target.
        reason: Why logical transferability is identified.
    """

    formulas: tuple[SDNF, SDNF]
    logs: tuple[LabelledTrajectories, LabelledTrajectories]
    reason: str


def logged(
    places: Sequence[Place], settings: QSettings, episodes: int, most: int, rng: np.random.Generator
) -> LabelledTrajectories:
    """Logs of an agent that learns what it wants, labelled by the requirement (the data collection phase).

    Args:
        places: The worlds, whose requirements are the same.
        settings: How the agent learns.
        episodes: Episodes in each world.
        most: The most logs kept: up to a quarter with label 1; of the others two thirds have the wish granted.
        rng: The source of all randomness.

    Returns:
        The logs.
    """
    paths, granted = [], []
    for place in places:
        problem = Problem(place.mdp, place.wish.table(place.mdp), tau_memory(place.mdp, 1))
        returns, states = collect(problem, problem.initial_q(settings), settings, rng, episodes)
        paths.append(place.mdp.coordinates[states])
        granted.append(returns > 0)
    values, pleased = np.concatenate(paths), np.concatenate(granted)
    variables = places[0].mdp.variables
    good = places[0].requirement.sdnf.formula.verdict(values, variables=variables) > 0
    kinds = ((good, most // 4), (~good & pleased, most // 2), (~good & ~pleased, most // 4))
    kept = [rng.permutation(np.flatnonzero(kind))[:count] for kind, count in kinds]
    rows = np.sort(np.concatenate(kept))
    return LabelledTrajectories.from_arrays(values[rows], np.where(good[rows], 1, -1), variables=variables)


def inferred(
    source: LabelledTrajectories, target: LabelledTrajectories, settings: InferenceSettings, limits: ExactSettings
) -> Inferred:
    """Infer φ^S, decide whether the target is logically transferable, and fit φ^T (Steps 1 and 2).

    Raises:
        NotTransferableError: If logical transferability is not identified.
    """
    tasks = [Task(logs, _prior(logs), SearchSpace.from_data(logs)) for logs in (source, target)]
    hypothesis = transfer_structure(*tasks, settings, limits, np.random.default_rng(0), np.random.default_rng(1))
    pairs = zip(require_transferable(hypothesis), tasks, strict=True)
    formulas = [readable(formula, task.data, task.space) for formula, task in pairs]
    return Inferred((formulas[0], formulas[1]), (source, target), hypothesis.reason)


def _prior(logs: LabelledTrajectories) -> BoxPrior:
    """Uniform draws from the range of the logs."""
    low, high = np.nanmin(logs.values, axis=(0, 1)), np.nanmax(logs.values, axis=(0, 1))
    return BoxPrior(dict(zip(logs.variables, zip(low - 0.5, high + 0.5, strict=True), strict=True)), logs.horizon)


def memories(formula: SDNF, place: Place) -> dict[str, Memory]:
    """What each agent remembers; the last two the same."""
    horizon = place.requirement.deadline
    extended = automaton_memory(place.mdp, tick_tables(formula, horizon))
    return dict(
        zip(METHODS, (tau_memory(place.mdp, 1), tick_memory(place.mdp, horizon), extended, extended), strict=True)
    )


def transferred(
    found: Inferred, source: Place, target: Place, settings: QSettings, episodes: int, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Learn in the source on the extended state, and transfer the values to the target (Algorithm 2).

    Args:
        found: The formulas and the logs.
        source: Where to learn.
        target: Where the values go.
        settings: How to learn in the source.
        episodes: Episodes of learning.
        rng: The source of all randomness.

    Returns:
        Q̄^T, shape ``(memory states, states, actions)``.
    """
    pairs = list(zip(found.formulas, (source, target), found.logs, strict=True))
    near, far = (automaton_memory(p.mdp, tick_tables(f, p.requirement.deadline)) for f, p, _ in pairs)
    problem = Problem(source.mdp, source.requirement.table(source.mdp), near)
    values = problem.initial_q(settings)
    learn(problem, values, settings, rng, episodes)
    marks = tuple(
        [landmarks(t, logs) for t in memory.tables] for memory, (*_, logs) in zip((near, far), pairs, strict=True)
    )
    return transfer_q(source.mdp, near, values, target.mdp, far, settings.initial, landmarks=marks)


@dataclass(frozen=True)
class Learning:
    """How the agents learn and are judged.

    Attributes:
        target: Settings of Q-learning in the target, the same for every agent.
        source: Settings of Q-learning in the source.
        source_episodes: Episodes of learning in the source.
        episodes: Episodes of learning in the target.
        step: Episodes between evaluations.
        plays: Episodes of an evaluation; one is enough where nothing is random.
    """

    target: QSettings
    source: QSettings
    source_episodes: int
    episodes: int
    step: int
    plays: int


def curves(
    found: Inferred, source: Place, target: Place, learning: Learning, seed: int
) -> dict[str, NDArray[np.float64]]:
    """Let every agent learn the target once.

    Args:
        found: The formulas and the logs.
        source: The source, where transferred values are learned.
        target: The target.
        learning: How to learn.
        seed: The seed of all of it.

    Returns:
        For each agent the share of episodes in which the greedy policy succeeds, as a share of what the best policy
        reaches, before learning and after each step, shape ``(episodes / step + 1,)``.
    """
    task = target.requirement.table(target.mdp)
    best = target.best * target.requirement.reward
    result = {}
    for number, (name, memory) in enumerate(memories(found.formulas[1], target).items()):
        problem, rng = Problem(target.mdp, task, memory), np.random.default_rng((seed, number))
        values = problem.initial_q(learning.target)
        if "transferred" in name:
            values = transferred(found, source, target, learning.source, learning.source_episodes, rng)
        shares = []
        for begun in range(0, learning.episodes + 1, learning.step):
            if begun:
                learn(problem, values, learning.target, rng, learning.step)
            shares.append(evaluate(problem, values, np.random.SeedSequence(1), learning.plays) / best)
        result[name] = np.array(shares)
    return result


def episodes_to(shares: NDArray[np.float64], step: int, level: float = 0.9) -> int | None:
    """The episodes from which ten evaluations in a row have a mean of at least a level; None if there are none."""
    means = np.convolve(shares, np.full(EVALUATIONS, 1 / EVALUATIONS), mode="valid")
    there = np.flatnonzero(means >= level - 1e-9)
    return int(there[0]) * step if len(there) else None


def table(runs: Sequence[Mapping[str, NDArray[np.float64]]], step: int) -> str:
    """How long it takes to 90 % of the best success: median, its interval, and how many runs got there, as text."""
    lines = [f"{'agent':<36}{'median':>9}  95 % interval      reached"]
    for name in filter(runs[0].__contains__, METHODS):
        reached = [episodes_to(run[name], step) for run in runs]
        middle, low, high = (_text(value) for value in median_interval(reached))
        there = sum(value is not None for value in reached)
        lines.append(f"{name:<36}{middle:>9}  {f'{low} to {high}':<18} {there} of {len(reached)}")
    return "\n".join(lines)


def median_interval(values: Sequence[int | None]) -> tuple[float, float, float]:
    """The median and its 95 % interval from order statistics, which hold whatever the distribution and the censoring.

    Args:
        values: Episodes of each run; None for more than were learned.

    Returns:
        The median and the ends of its interval; infinite where a run that did not get there is one of them.
    """
    ordered = np.sort([np.inf if value is None else value for value in values])
    rank = int(binom.ppf(0.025, len(ordered), 0.5))
    rank = max(rank - 1, 0)  # the interval between these order statistics covers the median with at least 95 %
    middle = (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) / 2
    return float(middle), float(ordered[rank]), float(ordered[-1 - rank])


def _text(value: float) -> str:
    return f"{value:,.0f}" if np.isfinite(value) else "never"


def draw(
    runs: Sequence[Mapping[str, NDArray[np.float64]]],
    total: int,
    step: int,
    title: str,
    path: Path,
    unit: str = "episodes",
) -> None:
    """Draw the agents' curves: the mean over the runs and its 95 % interval.

    Args:
        runs: What `curves` gives for each seed.
        total: How long they learned.
        step: How long from one evaluation to the next.
        title: The figure's title.
        path: The file to write.
        unit: What is counted.
    """
    times = np.arange(0, total + 1, step)
    with matplotlib.rc_context(STYLE):
        figure = canvas(4.4)
        axes = figure.subplots()
        for name in filter(runs[0].__contains__, METHODS):
            colour, line = METHODS[name]
            shares = np.array([run[name] for run in runs])
            mean = shares.mean(axis=0)
            error = 1.96 * shares.std(axis=0, ddof=1) / np.sqrt(len(shares)) if len(shares) > 1 else 0 * mean
            axes.plot(times, 100 * mean, color=colour, linestyle=line, linewidth=2, label=name)
            axes.fill_between(times, 100 * (mean - error), 100 * (mean + error), color=colour, alpha=0.15, linewidth=0)
        axes.set(xlabel=f"{unit} of learning in the target", ylabel="success of the greedy policy, % of the best")
        axes.set(title=title, xlim=(0, total), ylim=(-2, 102))
        axes.set_xscale("symlog", linthresh=step)
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
        axes.grid(axis="y")
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        figure.savefig(path, bbox_inches="tight", dpi=150)
