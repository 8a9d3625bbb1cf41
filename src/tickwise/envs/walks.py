"""Random walks in a world, with their actions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP, cumulative
from tickwise.envs.tasks import TaskTable
from tickwise.errors import DataError


@dataclass(frozen=True, slots=True, eq=False)
class Walks:
    """Episodes with their actions.

    Attributes:
        states: The states s_0 … s_L of each episode, -1 after its end, shape ``(episodes, ticks + 1)``.
        actions: The action at each tick but the last, -1 after the end, shape ``(episodes, ticks)``.

    Raises:
        DataError: If the shapes do not fit, or there is no episode.
    """

    states: NDArray[np.int32]
    actions: NDArray[np.int32]

    def __post_init__(self) -> None:
        states, actions = self.states.shape, self.actions.shape
        if len(states) != 2 or not all(states) or actions != (states[0], states[1] - 1):
            raise DataError(
                f"the states of walks have shape {states} and the actions {actions}; use (episodes, ticks + 1) and "
                "(episodes, ticks), with one episode or more"
            )


def random_walks(mdp: TabularMDP, task: TaskTable, episodes: int, rng: np.random.Generator) -> Walks:
    """Episodes of uniformly random actions, each until its deadline or where its task ends it.

    Args:
        mdp: The world.
        task: The hidden task.
        episodes: How many.
        rng: The generator that all draws come from.

    Returns:
        The episodes.
    """
    starts, thresholds = cumulative(mdp.initial), cumulative(mdp.probability)
    states = np.full((episodes, task.horizon + 1), -1, dtype=np.int32)
    actions = np.full((episodes, task.horizon), -1, dtype=np.int32)
    alive = np.arange(episodes)
    s = np.searchsorted(starts, rng.random(episodes), side="right")
    states[:, 0] = s
    w = task.delta[0, task.letter[s]]
    for tick in range(task.horizon):
        action = rng.integers(mdp.n_actions, size=len(alive))
        outcome = (thresholds[s, action] <= rng.random(len(alive))[:, None]).sum(axis=1)
        s = mdp.successor[s, action, outcome]
        actions[alive, tick], states[alive, tick + 1] = action, s
        w = task.delta[w, task.letter[s]]
        goes_on = ~task.terminated[w]
        alive, s, w = alive[goes_on], s[goes_on], w[goes_on]
    return Walks(states, actions)
