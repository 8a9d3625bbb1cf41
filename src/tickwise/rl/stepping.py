"""Q-learning over an environment's ``reset`` and ``step``: what the compiled kernels do, for what is no table."""

from __future__ import annotations

from typing import Any, Protocol, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError
from tickwise.rl.qlearning import QSettings
from tickwise.rl.qtable import QTable


class Environment(Protocol):
    """What is needed of an environment; every Gymnasium environment with numbered actions has it."""

    def reset(self, *, seed: int | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        ...

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick."""
        ...


def learn_by_steps(
    env: Environment, q: QTable, settings: QSettings, rng: np.random.Generator, episodes: int
) -> NDArray[np.float64]:
    """Q-learning (Section IV-B, Step 3) with ε-greedy actions and random ties, as `learn` has it for tables.

    One uniform number is drawn for each action, as in the kernel; an environment that draws from the same generator
    gives the same episodes and values as the kernel does. After a truncation the value of the last observation counts,
    after a termination nothing does.

    Args:
        env: The environment, whose actions are the numbers from 0.
        q: The table, changed in place; its initial values count, not those of the settings.
        settings: Learning rate, discount and exploration.
        rng: The generator that actions are drawn from.
        episodes: The number of episodes.

    Returns:
        The undiscounted return of each episode, shape ``(episodes,)``.

    Raises:
        ConfigurationError: If the environment has another number of actions than the table.
    """
    _check_actions(env, q)
    returns = np.zeros(episodes)
    for episode in range(episodes):
        observation, _ = env.reset()
        over = False
        while not over:
            action = _draw_action(q.row(observation), settings.epsilon, rng.random())
            following, reward, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
            target = float(reward)
            if not terminated:
                target += settings.gamma * float(q.row(following).max())
            row = q.row(observation)
            row[action] = float(row[action]) + settings.alpha * (target - float(row[action]))
            returns[episode] += float(reward)
            observation = following
    return returns


def play_by_steps(env: Environment, q: QTable, episodes: int, seed: int) -> NDArray[np.float64]:
    """Play the greedy policy, ties to the lower action; the table is left as it is.

    Args:
        env: The environment.
        q: The table.
        episodes: The number of episodes.
        seed: The seed of the first reset, so that evaluations can be compared.

    Returns:
        The undiscounted return of each episode, shape ``(episodes,)``.

    Raises:
        ConfigurationError: As `learn_by_steps`.
    """
    _check_actions(env, q)
    returns = np.zeros(episodes)
    for episode in range(episodes):
        observation, _ = env.reset(seed=seed if episode == 0 else None)
        over = False
        while not over:
            observation, reward, terminated, truncated, _ = env.step(int(q.look(observation).argmax()))
            returns[episode] += float(reward)
            over = terminated or truncated
    return returns


def _check_actions(env: Environment, q: QTable) -> None:
    space: Any = getattr(env, "action_space", None)
    if space is not None and (getattr(space, "n", None) != q.n_actions or getattr(space, "start", 0) != 0):
        raise ConfigurationError(
            f"the table has {q.n_actions} actions and the environment {space}; "
            "make the table for actions that are numbers from 0"
        )


def _draw_action(values: NDArray[np.float32], epsilon: float, number: float) -> int:
    """The action that a uniform number selects, in the kernel's way."""
    if number < epsilon:
        return int(number / epsilon * len(values))
    best = np.flatnonzero(values == values.max())
    return int(best[int((number - epsilon) / (1.0 - epsilon) * len(best))])
