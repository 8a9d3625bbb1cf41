"""τ-states: the last observations instead of an automaton, as the paper's first method has them."""

from __future__ import annotations

from collections import deque
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from tickwise.envs.wrappers.forms import numbering
from tickwise.errors import ConfigurationError


class TauState(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Let the observation be the last τ observations, the τ-states of Section V.

    The observation is finite, Discrete or MultiDiscrete. The entries are its numbers plus 1, the oldest first, and 0
    stands for "before tick 0". For images and vectors there is `gymnasium.wrappers.FrameStackObservation`.

    Args:
        env: An environment with finite observations.
        tau: The horizon τ, at least 1.

    Raises:
        ConfigurationError: If τ is less than 1, or the observation is not finite.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], tau: int = 5) -> None:
        RecordConstructorArgs.__init__(self, tau=tau)
        super().__init__(env)
        if isinstance(tau, bool) or not isinstance(tau, (int, np.integer)) or tau < 1:
            raise ConfigurationError(f"the horizon of τ-states is {tau!r}; use a whole number of 1 or more")
        count, self._number = numbering(env.observation_space, "TauState")
        self.observation_space = spaces.MultiDiscrete(np.full(tau, count + 1))
        self._last: deque[int] = deque(maxlen=int(tau))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode, with nothing before it."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._last.extend([0] * (self._last.maxlen or 1))
        return self._state(observation), info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self._state(observation), reward, terminated, truncated, info

    def _state(self, observation: Any) -> NDArray[np.int64]:
        self._last.append(int(self._number(observation)) + 1)
        return np.array(self._last, dtype=np.int64)
