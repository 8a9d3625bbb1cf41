"""The place of a primitive in a formula whose other primitives are held."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.counting import log_probability
from tickwise.inference.kernels import PriorArrays, Shape


@dataclass(frozen=True, slots=True, eq=False)
class Slot:
    """The place of the searched primitive in a formula whose other primitives are held.

    Attributes:
        shape: Operators and polarities of the whole formula.
        times: Windows and durations, shape ``(primitives, 3)``.
        lower: Lower box sides, shape ``(primitives, variables)``.
        upper: Upper box sides, shape ``(primitives, variables)``.
        index: The number of the searched primitive; what the arrays say of it is not read.
    """

    shape: Shape
    times: NDArray[np.int64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    index: int

    @classmethod
    def alone(cls, variables: int) -> Slot:
        """A formula of the one primitive."""
        shape = Shape(np.array([0, 1]), np.zeros(1, np.int64), np.zeros(1, np.bool_))
        return cls(shape, np.zeros((1, 3), np.int64), np.zeros((1, variables)), np.zeros((1, variables)), 0)

    def log_probability(
        self,
        prior: PriorArrays,
        operator: int,
        complemented: bool,
        times: NDArray[np.int64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
    ) -> float:
        """Log P of the whole formula with a primitive in the slot; -inf where P is 0.

        Args:
            prior: The prior's arrays.
            operator: 0, 1, 2, 3 for ◇, □, ◇□, □◇.
            complemented: Whether the predicate is the complement of the box.
            times: Window start, window end and duration.
            lower: Lower box sides, shape ``(variables,)``.
            upper: Upper box sides, shape ``(variables,)``.

        Returns:
            The natural logarithm of the probability.
        """
        shape = Shape(self.shape.starts, self.shape.operators.copy(), self.shape.complemented.copy())
        shape.operators[self.index], shape.complemented[self.index] = operator, complemented
        whole = self.times.copy(), self.lower.copy(), self.upper.copy()
        for array, row in zip(whole, (times, lower, upper), strict=True):
            array[self.index] = row
        return float(log_probability(prior, shape, *whole))

    def held_gains(self, prior: PriorArrays) -> tuple[float, float]:
        """The information gain of what is held in the disjunct of the searched primitive, and of the other disjuncts.

        Args:
            prior: The prior's arrays.

        Returns:
            Two gains. That of the other disjuncts is infinite where there is none or they are impossible. The other one
            is 0 where there is nothing else in the disjunct, or where the whole formula is impossible.
        """
        starts = self.shape.starts
        own = int(np.searchsorted(starts, self.index, side="right")) - 1
        within = np.arange(starts[own], starts[own + 1])
        others = np.delete(np.arange(starts[-1]), within)
        lengths = np.delete(np.diff(starts), own)
        held = self._gain(prior, within[within != self.index], np.array([len(within) - 1]))
        beside = self._gain(prior, others, lengths) if len(others) else math.inf
        return (0.0 if math.isinf(held) and math.isinf(beside) else held), beside

    def _gain(self, prior: PriorArrays, rows: NDArray[np.int64], lengths: NDArray[np.int64]) -> float:
        """The gain of disjuncts made of some of the primitives; infinite where they are impossible, 0 of none."""
        if not len(rows):
            return 0.0
        starts = np.concatenate([np.zeros(1, np.int64), np.cumsum(lengths)])
        shape = Shape(starts, self.shape.operators[rows], self.shape.complemented[rows])
        return (
            -float(log_probability(prior, shape, self.times[rows], self.lower[rows], self.upper[rows])) / prior.horizon
        )
