"""Environments as arrays: the exact model that compiled kernels, planning and the Gymnasium class share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import frozen_array
from tickwise.errors import DataError

_TOLERANCE = 1e-9


def cumulative(probability: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cumulative probabilities for sampling by inverse CDF, exactly 1 from the last possible outcome on.

    One rule draws everywhere, in the environments and in compiled kernels: given a uniform ``u`` in [0, 1),
    the outcome is the number of entries of the row that are at most ``u``. The ones at the end make sure
    that rounding never yields an outcome of probability zero.

    Args:
        probability: Probabilities that sum to 1 along the last axis, shape ``(..., outcomes)``.

    Returns:
        The thresholds, of the same shape.
    """
    outcomes = probability.shape[-1]
    last = outcomes - 1 - np.argmax(probability[..., ::-1] > 0, axis=-1)
    summed = np.cumsum(probability, axis=-1)
    return np.where(np.arange(outcomes) >= last[..., None], 1.0, summed)


def draw(thresholds: NDArray[np.float64], uniform: float) -> int:
    """The outcome that a uniform number in [0, 1) selects from one row of `cumulative`."""
    return int(np.searchsorted(thresholds, uniform, side="right"))


@dataclass(frozen=True, slots=True, eq=False)
class TabularMDP:
    """A finite Markov decision process without rewards, whose states lie in numbered cells of a world.

    Rewards belong to the task (see `tickwise.envs.tasks.TaskTable`), so that one world serves many tasks.
    The arrays are copied and cannot be written to.

    Attributes:
        successor: Next state of each outcome, int32, shape ``(states, actions, outcomes)``; rows with fewer
            outcomes are padded with probability 0.
        probability: Probability of each outcome, float64, same shape; each row sums to 1.
        initial: Probability of each state at tick 0, float64, shape ``(states,)``.
        cell: The cell of each state, int32, shape ``(states,)``.
        cell_coordinates: Centre of each cell in world units, float64, shape ``(cells, variables)``.
        variables: Names of the coordinates.
        limits: The world's range of each coordinate, in world units.

    Raises:
        DataError: If a shape does not fit, a number is out of range or a row is not a distribution.
    """

    successor: NDArray[np.int32]
    probability: NDArray[np.float64]
    initial: NDArray[np.float64]
    cell: NDArray[np.int32]
    cell_coordinates: NDArray[np.float64]
    variables: tuple[str, ...]
    limits: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        for name, dtype in (
            ("successor", np.int32), ("probability", np.float64), ("initial", np.float64),
            ("cell", np.int32), ("cell_coordinates", np.float64),
        ):  # fmt: skip
            object.__setattr__(self, name, frozen_array(getattr(self, name), dtype))
        self._check_shapes()
        self._check_numbers()

    def _check_shapes(self) -> None:
        if self.successor.ndim != 3 or not self.successor.size:
            raise DataError(f"successor has shape {self.successor.shape}; use (states, actions, outcomes), none zero")
        wanted = {
            "probability": self.successor.shape,
            "initial": self.successor.shape[:1],
            "cell": self.successor.shape[:1],
            "cell_coordinates": (len(self.cell_coordinates), len(self.variables)),
        }
        for name, shape in wanted.items():
            if getattr(self, name).shape != shape:
                raise DataError(f"{name} has shape {getattr(self, name).shape}; use {shape}")
        if len(self.limits) != len(self.variables):
            raise DataError(f"there are {len(self.limits)} limits for {len(self.variables)} variables; give one each")

    def _check_numbers(self) -> None:
        for name, array, count in (
            ("successor", self.successor, self.n_states),
            ("cell", self.cell, self.n_cells),
        ):
            if array.min() < 0 or array.max() >= count:
                raise DataError(f"{name} has a number outside 0..{count - 1}")
        for name, rows in (("probability", self.probability), ("initial", self.initial)):
            # written so that NaN fails too
            if not ((rows >= 0).all() and (abs(rows.sum(axis=-1) - 1) <= _TOLERANCE).all()):
                raise DataError(f"a row of {name} is not a distribution; use numbers of 0 or more that sum to 1")
        if not np.isfinite(self.cell_coordinates).all():
            raise DataError("cell_coordinates has a number that is not finite")

    @property
    def n_states(self) -> int:
        """The number of states."""
        return int(self.successor.shape[0])

    @property
    def n_actions(self) -> int:
        """The number of actions."""
        return int(self.successor.shape[1])

    @property
    def n_cells(self) -> int:
        """The number of cells."""
        return len(self.cell_coordinates)

    @property
    def coordinates(self) -> NDArray[np.float64]:
        """Coordinates of each state, the centre of its cell in world units, shape ``(states, variables)``."""
        return self.cell_coordinates[self.cell]

    def support_graph(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Which states can follow which within one tick, under some action.

        It is the graph whose paths the uniform prior counts: the trajectories that the MDP can generate
        (Definition 2's G_L as the case studies choose it).

        Returns:
            CSR row pointers, shape ``(states + 1,)``, and successor states, ascending within a row.
        """
        states, actions, outcomes = np.nonzero(self.probability)
        following = self.successor[states, actions, outcomes].astype(np.int64)
        pairs = np.unique(states * self.n_states + following)
        indptr = np.searchsorted(pairs, np.arange(self.n_states + 1) * self.n_states)
        return indptr.astype(np.int64), pairs % self.n_states
