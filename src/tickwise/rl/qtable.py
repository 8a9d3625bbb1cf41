"""A table of Q-values over observations that are not known beforehand."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tickwise.errors import ConfigurationError, DataError

InitialValues = float | Callable[[Any], ArrayLike]
"""One value for all, or the values of an observation's actions, such as those transferred from a source task."""


class QTable:
    """Q-values of observations, each with a row from when it is first met.

    Observations are whole numbers, arrays, tuples, or dictionaries of these; equal ones share a row.

    Args:
        n_actions: The number of actions.
        initial: The initial value, or a function from an observation to the initial values of its actions, which is
            asked once for each observation.

    Attributes:
        n_actions: The number of actions.

    Raises:
        ConfigurationError: If there is no action, or the initial value is not finite.
    """

    def __init__(self, n_actions: int, initial: InitialValues = 0.0) -> None:
        if n_actions < 1:
            raise ConfigurationError(f"there are {n_actions} actions; a table needs at least one")
        if not callable(initial) and not np.isfinite(initial):
            raise ConfigurationError(f"the initial Q-value is {initial}; use a finite number")
        self.n_actions = int(n_actions)
        self._initial = initial
        self._rows: dict[Hashable, int] = {}
        self._values = np.empty((64, self.n_actions), dtype=np.float32)

    def __len__(self) -> int:
        """The number of observations met so far."""
        return len(self._rows)

    def __contains__(self, observation: Any) -> bool:
        """Whether an observation was met."""
        return _key(observation) in self._rows

    @property
    def values(self) -> NDArray[np.float32]:
        """The values of all observations in the order in which they were met, shape ``(observations, actions)``."""
        return self._values[: len(self)]

    def row(self, observation: Any) -> NDArray[np.float32]:
        """The values of an observation's actions; a new observation gets its initial values.

        Args:
            observation: The observation.

        Returns:
            A view, shape ``(actions,)``: what is written to it is learned. It holds until the next observation is met.

        Raises:
            DataError: If the function of initial values gives another number of values, or one is not finite.
        """
        key = _key(observation)
        number = self._rows.get(key)
        if number is None:
            number = len(self._rows)
            if number == len(self._values):
                self._values = np.concatenate([self._values, np.empty_like(self._values)])
            self._values[number] = self._first(observation)
            self._rows[key] = number
        found: NDArray[np.float32] = self._values[number]
        return found

    def look(self, observation: Any) -> NDArray[np.float32]:
        """The values of an observation's actions, without giving a new one a row, shape ``(actions,)``."""
        number = self._rows.get(_key(observation))
        return self._first(observation) if number is None else self._values[number].copy()

    def _first(self, observation: Any) -> NDArray[np.float32]:
        if not callable(self._initial):
            return np.full(self.n_actions, self._initial, dtype=np.float32)
        values = np.asarray(self._initial(observation), dtype=np.float32)
        if values.shape != (self.n_actions,) or not np.isfinite(values).all():
            raise DataError(
                f"the initial values of an observation have shape {values.shape}; give {self.n_actions} finite numbers"
            )
        return values


def _key(observation: Any) -> Hashable:
    if isinstance(observation, Mapping):
        return tuple((name, _key(observation[name])) for name in sorted(observation))
    if isinstance(observation, tuple):
        return tuple(_key(part) for part in observation)
    array = np.asarray(observation)
    return array.item() if array.ndim == 0 else (array.shape, tuple(array.ravel().tolist()))
