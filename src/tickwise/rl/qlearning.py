"""Tabular Q-learning on the states that a memory makes of a world, and greedy evaluation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import read_only
from tickwise.envs.tabulate import TabularMDP, cumulative
from tickwise.envs.tasks import TaskTable
from tickwise.errors import ConfigurationError
from tickwise.rl.kernels import greedy_returns, q_learning
from tickwise.rl.states import Memory
from tickwise.rl.stream import put_back, take_stream


@dataclass(frozen=True, slots=True)
class QSettings:
    """Settings of Q-learning; the paper gives α and γ, the rest was chosen by measurement.

    Attributes:
        alpha: Learning rate α.
        gamma: Discount factor γ.
        epsilon: Probability of a random action; otherwise a greedy one, ties broken at random.
        initial: Initial Q-value of every state and action.

    Raises:
        ConfigurationError: If a setting is out of range.
    """

    alpha: float = 0.8
    gamma: float = 0.99
    epsilon: float = 0.0
    initial: float = 50.0

    def __post_init__(self) -> None:
        for name, low, high in (("alpha", 0, 1), ("gamma", 0, 1), ("epsilon", 0, 1)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ConfigurationError(f"{name} is {value}; use a number from {low} to {high}")
        if not np.isfinite(self.initial):
            raise ConfigurationError(f"the initial Q-value is {self.initial}; use a finite number")


@dataclass(frozen=True, eq=False)
class Problem:
    """A world, its hidden task and the agent's memory: what a table-driven learner runs on.

    Attributes:
        mdp: The world.
        task: The hidden task; the agent sees its rewards only.
        memory: What the agent remembers.
    """

    mdp: TabularMDP
    task: TaskTable
    memory: Memory

    @cached_property
    def arrays(self) -> tuple[Any, ...]:
        """The arguments that the compiled loops share, in their order."""
        mdp, task, memory = self.mdp, self.task, self.memory
        return (
            cumulative(mdp.initial), mdp.successor, cumulative(mdp.probability),
            task.delta[0, task.letter], task.delta, task.letter, task.reward, task.final_reward,
            task.terminated, task.horizon, memory.start, memory.delta, memory.letter,
        )  # fmt: skip

    def terminated(self, paths: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Which episodes the task ended, as an environment says at the last step; the deadline alone does not.

        Args:
            paths: MDP states of each episode, -1 after its end, shape ``(episodes, horizon + 1)``.

        Returns:
            Shape ``(episodes,)``.
        """
        return self.replayed(paths)[1]

    def replayed(self, paths: NDArray[np.int32]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """What an agent was told at each step of some episodes.

        Args:
            paths: MDP states of each episode, -1 after its end, shape ``(episodes, horizon + 1)``.

        Returns:
            The rewards, 0 after the end, shape ``(episodes, horizon)``; and whether the task ended the episode, shape
            ``(episodes,)``.
        """
        task = self.task
        w = task.delta[0, task.letter[paths[:, 0]]]
        rewards = np.zeros((len(paths), task.horizon))
        ended = np.zeros(len(paths), dtype=np.bool_)
        for t in range(1, task.horizon + 1):
            rows = np.flatnonzero(paths[:, t] >= 0)
            s = paths[rows, t]
            w[rows] = task.delta[w[rows], task.letter[s]]
            rewards[rows, t - 1] = task.reward[w[rows], s] + (task.final_reward[w[rows]] if t == task.horizon else 0.0)
            ended[rows] |= task.terminated[w[rows]]
        return rewards, ended

    def initial_q(self, settings: QSettings) -> NDArray[np.float32]:
        """A fresh Q-table at the settings' initial value, shape ``(memory states, states, actions)``."""
        shape = (self.memory.n_states, self.mdp.n_states, self.mdp.n_actions)
        return np.full(shape, settings.initial, dtype=np.float32)


def learn(
    problem: Problem, q: NDArray[np.float32], settings: QSettings, rng: np.random.Generator, episodes: int
) -> NDArray[np.float32]:
    """Learn for some episodes; a later call with the same table and generator goes on where this one ended.

    Args:
        problem: What to learn.
        q: The Q-table, changed in place, shape ``(memory states, states, actions)``.
        settings: Learning rate, discount and exploration.
        rng: The generator that all draws come from.
        episodes: The number of episodes.

    Returns:
        The undiscounted return of each episode, shape ``(episodes,)``.
    """
    returns = np.empty(episodes, dtype=np.float32)
    nothing = np.empty((0, 0), dtype=np.int32)
    _play(problem, q, settings, rng, returns, nothing)
    return returns


def collect(
    problem: Problem, q: NDArray[np.float32], settings: QSettings, rng: np.random.Generator, episodes: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Learn as `learn` does, and record where every episode went: the data collection phase (Section IV-A).

    Returns:
        The returns, shape ``(episodes,)``, and the MDP states of each episode with -1 after its end, shape
        ``(episodes, horizon + 1)``.
    """
    returns = np.empty(episodes, dtype=np.float32)
    paths = np.empty((episodes, problem.task.horizon + 1), dtype=np.int32)
    _play(problem, q, settings, rng, returns, paths)
    return returns, paths


def _play(
    problem: Problem,
    q: NDArray[np.float32],
    settings: QSettings,
    rng: np.random.Generator,
    returns: NDArray[np.float32],
    paths: NDArray[np.int32],
) -> None:
    # floats, since whole numbers would have the loop compiled once more
    rates = float(settings.alpha), float(settings.gamma), float(settings.epsilon)
    stream = take_stream(rng)
    arguments: tuple[Any, ...] = (*problem.arrays, *rates, stream, q, returns, paths)
    q_learning(*arguments)
    put_back(rng, stream)


def evaluate(problem: Problem, q: NDArray[np.float32], seed: np.random.SeedSequence, episodes: int) -> float:
    """The mean undiscounted return of the greedy policy over fixed seeds, ties to the lower action.

    Args:
        problem: What was learned.
        q: The Q-table, left as it is.
        seed: The seed of the evaluation; the same one makes evaluations comparable.
        episodes: The number of episodes.

    Returns:
        The mean return, in units of reward.
    """
    returns = np.empty(episodes, dtype=np.float32)
    arguments: tuple[Any, ...] = (*problem.arrays, take_stream(np.random.default_rng(seed)), read_only(q), returns)
    greedy_returns(*arguments)
    return float(returns.mean(dtype=np.float64))
