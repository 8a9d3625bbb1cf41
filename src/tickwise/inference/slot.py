"""The place of a primitive in a formula whose other primitives are held."""

from __future__ import annotations

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
