"""Rehearsal: how long it takes to learn a task from given values, tried out in a model of the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator, seed_sequence
from tickwise.envs.planning import optimal_value, worst_value
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import LearningForm, QLearning
from tickwise.rl.qlearning import Problem, evaluate


@dataclass(frozen=True, slots=True)
class Goal:
    """When something counts as learned, and how that is found out.

    Attributes:
        level: The share of the way from the worst policy's return to the best one's, V*, that is enough.
        step: Episodes of learning between evaluations of the greedy policy.
        plays: Episodes of an evaluation.
        most: Episodes of learning at most, up to a whole number of steps.

    Raises:
        ConfigurationError: If a number is out of range.
    """

    level: float = 0.95
    step: int = 100
    plays: int = 200
    most: int = 100_000

    def __post_init__(self) -> None:
        if not 0 < self.level <= 1:
            raise ConfigurationError(f"level is {self.level!r}; use a share above 0, at most 1")
        for name in ("step", "plays", "most"):
            if getattr(self, name) < 1:
                raise ConfigurationError(f"{name} is {getattr(self, name)!r}; use 1 or more")

    def threshold(self, problem: Problem) -> float:
        """The mean return that is enough, exactly."""
        worst, best = (value(problem.mdp, problem.task) for value in (worst_value, optimal_value))
        return worst + self.level * (best - worst)


def learning_times(
    problem: Problem,
    q: NDArray[np.float32] | None,
    seed: int,
    runs: int,
    *,
    form: LearningForm | None = None,
    goal: Goal | None = None,
) -> list[int | None]:
    """The episodes of learning before the first evaluation, on fixed seeds, that reaches a goal.

    Args:
        problem: What to learn.
        q: Values to begin with, such as transferred ones, shape ``(memory states, states, actions)``; None for those
            of the settings.
        seed: The root seed; runs of the same number draw the same, whatever the values.
        runs: How often to learn.
        form: The form of learning; by default Q-learning with the default settings.
        goal: What has to be reached.

    Returns:
        The episodes of each run, None where the goal's most were not enough.
    """
    form, goal = form or QLearning(), goal or Goal()
    enough, fixed = goal.threshold(problem), seed_sequence(seed, "evaluate")

    def time(run: int) -> int | None:
        learner, rng = form.learner(problem, q), generator(seed, "learn", run)
        for episodes in range(0, goal.most + 1, goal.step):
            if episodes:
                learner.learn(rng, goal.step)
            if evaluate(problem, learner.q, fixed, goal.plays) >= enough:
                return episodes
        return None

    return [time(run) for run in range(runs)]


def rehearsal(
    problem: Problem,
    q: NDArray[np.float32] | None,
    seed: int = 0,
    runs: int = 5,
    *,
    form: LearningForm | None = None,
    goal: Goal | None = None,
) -> float:
    """How many episodes it takes to learn a task from given values, as an estimate from a model.

    Of several sources, the one is best whose values need the fewest; without values it says whether any helps. No
    episode of the target is needed but those that its model and its formula are from.

    Args:
        problem: The target's formula in the model of its world (see `tickwise.envs.estimation.estimated` and
            `tickwise.envs.temporal.sdnf_table`), with the memory of both.
        q: The transferred values, shape ``(memory states, states, actions)``; None for those of the settings.
        seed: The root seed; use the same for all that is compared.
        runs: How often to learn in the model.
        form: The form of learning that will be used in the target; by default Q-learning with the default settings.
        goal: What has to be reached.

    Returns:
        The mean number of episodes, where a run that does not get there counts with the goal's most.
    """
    goal = goal or Goal()
    times = learning_times(problem, q, seed, runs, form=form, goal=goal)
    return float(np.mean([goal.most if time is None else time for time in times]))
