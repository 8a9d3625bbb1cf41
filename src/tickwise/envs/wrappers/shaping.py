"""Potential-based reward shaping from a timed automaton."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike

from tickwise.automata.distance import acceptance_potential
from tickwise.envs.wrappers.extended import TABLE_STATE, ExtendedState
from tickwise.errors import ConfigurationError


class PotentialShaping(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    r"""Add γ·Φ(x′) − Φ(x) to the reward, so that progress in the automaton is felt at once.

    Φ depends on the extended state only and counts as 0 in terminal states. Along any episode the added rewards sum up
    to −Φ(x₀), discounted, whatever the agent does: the values of all policies change by the same amount, so that the
    optimal policies stay the same (Ng, Harada and Russell, 1999). With a table of Q-values it does just what starting
    from the initial values Q₀ + Φ does (Wiewiora, 2003). Where an episode is truncated, agents go on from the value
    of x′, so its potential is not taken as 0.

    Args:
        env: An environment wrapped in `ExtendedState`, at any depth.
        gamma: The agent's discount factor γ, in (0, 1]; with another one the optimal policy may change.
        scale: What acceptance is worth; the size of the task's reward is a good choice.
        potential: Φ of each table state, shape ``(table states,)``; by default
            `tickwise.automata.distance.acceptance_potential`; `progress_potential` there is another.

    Raises:
        ConfigurationError: If there is no extended state, γ is out of range, or the potential has another shape.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        gamma: float,
        scale: float = 1.0,
        potential: ArrayLike | None = None,
    ) -> None:
        RecordConstructorArgs.__init__(self, gamma=gamma, scale=scale, potential=potential)
        super().__init__(env)
        if not 0 < gamma <= 1:
            raise ConfigurationError(f"gamma is {gamma}; use the agent's discount factor, above 0 and at most 1")
        own = acceptance_potential(_extended(env).monitor.tables, gamma, scale)
        self._potential = own if potential is None else np.asarray(potential, dtype=np.float64)
        if self._potential.shape != own.shape or not np.isfinite(self._potential).all():
            raise ConfigurationError(
                f"the potential has shape {self._potential.shape}; use {len(own)} finite numbers, one a table state"
            )
        self._gamma = gamma
        self._before = 0.0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see the wrapped environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._before = float(self._potential[info[TABLE_STATE]])
        return observation, info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick; ``info["unshaped_reward"]`` is the reward without what is added."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        after = 0.0 if terminated else float(self._potential[info[TABLE_STATE]])
        shaped = float(reward) + self._gamma * after - self._before
        self._before = after
        return observation, shaped, terminated, truncated, info | {"unshaped_reward": float(reward)}


def _extended(env: gymnasium.Env[Any, Any]) -> ExtendedState:
    below: Any = env
    while isinstance(below, gymnasium.Wrapper):
        if isinstance(below, ExtendedState):
            return below
        below = below.env
    raise ConfigurationError("PotentialShaping needs extended states; wrap the environment in ExtendedState first")
