"""Named features and extended states for environments that run side by side."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space, iterate
from numpy.typing import NDArray

from tickwise.automata.monitor import Monitor
from tickwise.envs.wrappers.extended import report
from tickwise.envs.wrappers.forms import Places, make_form
from tickwise.envs.wrappers.labelled import FEATURES, FeatureMap, Features, feature_names
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Formula

_LAST_OBSERVATION, _LAST_INFO = "final_obs", "final_info"


class VectorLabelled(VectorWrapper):
    """What `Labelled` is, for a vector of environments.

    ``info["features"]`` has shape ``(environments, features)``. Where environments are reset in the step that ends an
    episode, ``info["final_info"]["features"]`` has those of the last tick.

    Args:
        env: A vector of environments.
        features: As for `Labelled`; functions take the observation of one environment.

    Attributes:
        feature_names: The names, in the order of the columns.

    Raises:
        ConfigurationError: As for `Labelled`.
    """

    def __init__(self, env: VectorEnv, features: FeatureMap) -> None:
        super().__init__(env)
        self._features = Features(features, env.single_observation_space)
        self.feature_names = self._features.names

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin episodes; see the wrapped environments."""
        observations, infos = self.env.reset(seed=seed, options=options)
        return observations, infos | {FEATURES: self._of(observations)}

    def step(self, actions: Any) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Go to the next tick; see the wrapped environments."""
        observations, rewards, terminations, truncations, infos = self.env.step(actions)
        infos = infos | {FEATURES: self._of(observations)}
        if _LAST_OBSERVATION in infos:
            last = np.zeros((self.num_envs, len(self.feature_names)))
            for row in np.flatnonzero(np.asarray(terminations) | np.asarray(truncations)):
                last[row] = self._features(infos[_LAST_OBSERVATION][row])
            infos[_LAST_INFO] = infos.get(_LAST_INFO, {}) | {FEATURES: last}
        return observations, rewards, terminations, truncations, infos

    def _of(self, observations: Any) -> NDArray[np.float64]:
        return np.array([self._features(each) for each in iterate(self.observation_space, observations)])


class VectorExtendedState(VectorWrapper):
    """What `ExtendedState` is, for a vector of environments in any autoreset mode.

    All environments' automata are advanced together. Where environments are reset in the step that ends an episode,
    ``info["final_obs"]`` holds extended observations, and ``info["final_info"]`` what `ExtendedState` tells, of the
    last tick; where they are reset in the step after it, that step begins the automaton anew.

    Args:
        env: A vector of environments with named features: wrap it in `VectorLabelled`, or each environment in
            `Labelled`.
        formula: As for `ExtendedState`.
        form: As for `ExtendedState`.
        reduce: As for `ExtendedState`.

    Attributes:
        monitor: The formula's automata.

    Raises:
        ConfigurationError: As for `ExtendedState`.
        FormulaError: As for `ExtendedState`.
        UnknownVariableError: As for `ExtendedState`.
    """

    def __init__(
        self, env: VectorEnv, formula: str | Formula | SDNF, form: str = "dict", *, reduce: bool = True
    ) -> None:
        super().__init__(env)
        self.monitor = Monitor.of(formula, feature_names(env, "VectorExtendedState"), reduce=reduce)
        self._places = Places.of(self.monitor)
        self._form = make_form(form, env.single_observation_space, self._places)
        self.single_observation_space = self._form.space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._mode = AutoresetMode(env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP))
        self._states = np.zeros((self.num_envs, len(self.monitor.tables)), dtype=np.int64)
        self._disjunct = np.zeros(self.num_envs, dtype=np.int64)
        self._ended = np.zeros(self.num_envs, dtype=np.bool_)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin episodes, in the environments of ``options["reset_mask"]`` or in all."""
        mask = (options or {}).get("reset_mask")
        fresh = np.ones(self.num_envs, dtype=np.bool_) if mask is None else np.array(mask, dtype=np.bool_)
        observations, infos = self.env.reset(seed=seed, options=options)
        self._restart(fresh, infos[FEATURES])
        self._ended &= ~fresh
        return self._extended(observations), infos | self._report()

    def step(self, actions: Any) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Go to the next tick; the automata read its letters."""
        observations, rewards, terminations, truncations, infos = self.env.step(actions)
        over = np.asarray(terminations) | np.asarray(truncations)
        features = infos[FEATURES]
        if self._mode == AutoresetMode.SAME_STEP:
            last = features.copy()
            if over.any():
                last[over] = infos[_LAST_INFO][FEATURES][over]
            self._states = self.monitor.advance(self._states, last)
            if over.any():
                infos = self._with_last(infos, over)
            self._restart(over, features)
        else:
            self._states = self.monitor.advance(self._states, features)
            self._restart(self._ended, features)
            self._ended = over
        return self._extended(observations), rewards, terminations, truncations, infos | self._report()

    def _restart(self, fresh: NDArray[np.bool_], features: NDArray[np.float64]) -> None:
        if fresh.any():
            self._disjunct[fresh] = self.monitor.choose(features[fresh])
            self._states[fresh] = self.monitor.start(features[fresh])

    def _with_last(self, infos: dict[str, Any], over: NDArray[np.bool_]) -> dict[str, Any]:
        """Extend the last observations and information of the episodes that are over."""
        last, numbers = infos[_LAST_OBSERVATION].copy(), self._numbers()
        for row in np.flatnonzero(over):
            last[row] = self._form.extend(last[row], numbers[row])
        return infos | {_LAST_OBSERVATION: last, _LAST_INFO: infos[_LAST_INFO] | self._report()}

    def _extended(self, observations: Any) -> Any:
        return self._form.extend(observations, self._numbers())

    def _numbers(self) -> NDArray[np.int64]:
        return self._places.number(self._disjunct, self._states[np.arange(self.num_envs), self._disjunct])

    def _report(self) -> dict[str, Any]:
        return report(self.monitor, self._places, self._disjunct, self._states)
