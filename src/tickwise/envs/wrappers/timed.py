"""A timed task for any environment: the reward is what a formula says of the episode."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from tickwise.automata.monitor import Monitor
from tickwise.envs.tasks import check_ticks
from tickwise.envs.temporal import ENDINGS, Ending, check_end
from tickwise.envs.wrappers.labelled import FEATURES, feature_names
from tickwise.errors import ConfigurationError
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Formula


class TimedTask(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Reward an episode for a formula instead of what the environment rewards.

    The agent is not told the formula, nor how far it is. The episode terminates at the deadline, where the
    environment's own episode ends or is truncated, or before as `ends` says; then ``reward`` is given if the formula
    is satisfied, and ``penalty`` if not, and ``info["is_success"]`` says which. Where the episode ends with the
    formula undecided, it is not satisfied. It is what `FormulaTask` is for a gridworld.

    Args:
        env: An environment with named features: wrap it in `Labelled` first.
        formula: The formula, or its text; its variables are features.
        deadline: The deadline in ticks, at least 1; no effect of the formula may reach beyond it.
        reward: Given if the formula is satisfied.
        penalty: Given if it is not.
        ends: When an episode ends before its deadline: never (``"deadline"``), as soon as the formula is
            ``"violated"``, or as soon as it is ``"decided"`` either way; what tick 0 decides ends it at tick 1.

    Raises:
        ConfigurationError: If the environment has no named features, the deadline is before the formula's end-effect
            time (Definition 4), or there is no such end.
        FormulaError: If the formula has no sequential disjunctive normal form.
        UnknownVariableError: If the formula names a variable that is no feature.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        formula: str | Formula | SDNF,
        deadline: int,
        reward: float = 1.0,
        penalty: float = 0.0,
        ends: Ending = "decided",
    ) -> None:
        RecordConstructorArgs.__init__(
            self, formula=formula, deadline=deadline, reward=reward, penalty=penalty, ends=ends
        )
        super().__init__(env)
        check_ticks("deadline", deadline, least=1)
        if ends not in ENDINGS:
            raise ConfigurationError(f"there is no end of an episode {ends!r}; use {', '.join(ENDINGS)}")
        self._monitor = Monitor.of(formula, feature_names(env, "TimedTask"))
        check_end(self._monitor.sdnf, deadline)
        self._deadline, self._reward, self._penalty, self._ends = deadline, reward, penalty, ENDINGS[ends]
        self._states = np.zeros(len(self._monitor.tables), dtype=np.int64)
        self._tick = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._states, self._tick = self._monitor.start(info[FEATURES]), 0
        return observation, info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick; the environment's own reward is not given."""
        observation, _, terminated, truncated, info = self.env.step(action)
        self._states, self._tick = self._monitor.advance(self._states, info[FEATURES]), self._tick + 1
        verdict = int(self._monitor.verdict(self._states))
        over = terminated or verdict in self._ends or self._tick >= self._deadline
        if not (over or truncated):
            return observation, 0.0, False, False, info
        success = verdict > 0
        earned = self._reward if success else self._penalty
        # all is given, so that nothing comes after, not even where the environment's time limit cut it off
        return observation, earned, True, truncated, info | {"is_success": success}
