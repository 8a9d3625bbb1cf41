"""Named features of any environment's observations: what the predicates of formulas speak of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, SupportsFloat, TypeAlias

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError, DataError

FEATURES = "features"
"""The key in ``info`` under which a tick's features are found."""

FeatureMap: TypeAlias = Mapping[str, Callable[[Any], SupportsFloat]] | Sequence[str]


class Features:
    """A map from observations to named features.

    Args:
        given: For each name a function of the observation; or names alone, for the entries of an observation that
            is a vector or one number.
        space: The space of the observations.

    Attributes:
        names: The names, in order.
        by_entry: Whether features are the entries of the observation.

    Raises:
        ConfigurationError: If there is no feature, a name occurs twice, or names do not fit the observation.
    """

    def __init__(self, given: FeatureMap, space: gymnasium.Space[Any]) -> None:
        self.names = tuple(given)
        if not self.names or isinstance(given, str):
            raise ConfigurationError(f"features are {given!r}; give a list of names, or a function for each name")
        if len(set(self.names)) < len(self.names):
            raise ConfigurationError(f"a feature's name occurs twice in {', '.join(self.names)}; make them unique")
        for name in self.names:
            if not isinstance(name, str) or not name:
                raise ConfigurationError(f"a feature's name is {name!r}; use text")
        self._functions = list(given.values()) if isinstance(given, Mapping) else None
        self.by_entry = self._functions is None
        if self._functions is None:
            _check_entries(self.names, space)
        elif not all(callable(function) for function in self._functions):
            raise ConfigurationError("a feature is no function; give each name a function of the observation")

    def __call__(self, observation: Any) -> NDArray[np.float64]:
        """The features of one observation, shape ``(features,)``.

        Raises:
            DataError: If a feature is NaN or no number, or the observation has another number of entries than names.
        """
        if self._functions is None:
            values = np.atleast_1d(np.asarray(observation, dtype=np.float64))
            if values.shape != (len(self.names),):
                raise DataError(f"an observation of shape {values.shape} has no entries {', '.join(self.names)}")
        else:
            given = [function(observation) for function in self._functions]
            values = np.array([_number(name, value) for name, value in zip(self.names, given, strict=True)])
        if np.isnan(values).any():
            name = self.names[int(np.argmax(np.isnan(values)))]
            raise DataError(f"the feature {name!r} is NaN; a predicate needs a number at every tick")
        return values


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise DataError(f"the feature {name!r} is {value!r}; let its function give one number") from None


def _check_entries(names: Sequence[str], space: gymnasium.Space[Any]) -> None:
    if isinstance(space, spaces.Discrete):
        entries = 1
    elif isinstance(space, (spaces.Box, spaces.MultiDiscrete, spaces.MultiBinary)) and len(space.shape) == 1:
        entries = space.shape[0]
    else:
        raise ConfigurationError(
            f"an observation in {space} is no vector, so its entries have no names; give features as functions of it, "
            "such as {'x': lambda observation: ...}"
        )
    if entries != len(names):
        raise ConfigurationError(
            f"there are {len(names)} names ({', '.join(names)}) for {entries} entries of the observation; name each"
        )


class Labelled(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Put named features of the observation into ``info["features"]``, at every tick.

    Predicates are read on these features (the labelling function of Section II-A): the wrappers `ExtendedState`,
    `TimedTask` and `CollectTrajectories` stand on this one. The observation stays what it is.

    ```python
    env = gymnasium.make("FrozenLake-v1")
    env = Labelled(env, {"row": lambda s: s // 4, "column": lambda s: s % 4})
    ```

    Args:
        env: Any environment.
        features: For each feature's name a function of the observation; or names alone, for the entries of an
            observation that is a vector or one number.

    Attributes:
        feature_names: The names, in the order of the columns of ``info["features"]``, float64, shape ``(features,)``.

    Raises:
        ConfigurationError: If there is no feature, a name occurs twice, or names do not fit the observation.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], features: FeatureMap) -> None:
        RecordConstructorArgs.__init__(self, features=features)
        super().__init__(env)
        self.features_of = Features(features, env.observation_space)
        self.feature_names, self.by_entry = self.features_of.names, self.features_of.by_entry

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see the wrapped environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, info | {FEATURES: self.features_of(observation)}

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick; see the wrapped environment."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, info | {FEATURES: self.features_of(observation)}


def feature_names(env: Any, wrapper: str) -> tuple[str, ...]:
    """The names of the features that an environment tells of.

    Args:
        env: An environment, or a vector of environments.
        wrapper: Which wrapper asks.

    Returns:
        The names.

    Raises:
        ConfigurationError: If the environment is not labelled.
    """
    below = env
    while below is not None:
        found = getattr(below, "feature_names", None)
        if found is None and isinstance(below, VectorEnv):
            found = _names_within(below)
        if found is not None:
            return tuple(found)
        below = getattr(below, "env", None)
    raise ConfigurationError(f"{wrapper} needs named features; wrap the environment in Labelled(env, features) first")


def _names_within(env: Any) -> tuple[str, ...] | None:
    """The names that the environments of a vector tell, if they can be asked."""
    # a process of its own ends with the first question that it cannot answer, so whether it can is asked before
    if hasattr(env, "call") and all(env.call("has_wrapper_attr", "feature_names")):
        return tuple(env.call("feature_names")[0])
    return None
