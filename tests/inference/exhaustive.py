"""The slow twin of the exact search: every box, window and duration, one after the other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.boxes import Node
from tickwise.inference.counting import log_probability
from tickwise.inference.exact import KINDS, ExactProblem, worth_of
from tickwise.inference.kernels import Shape, satisfied
from tickwise.inference.levels import Levels, code
from tickwise.inference.objective import ClassWeight, trajectory_weights
from tickwise.inference.prior import Prior
from tickwise.inference.slot import Slot
from tickwise.inference.space import OPERATORS, Gaps, SearchSpace, to_formula
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import Operator, Primitive

TIE = 1e-12


def problem_of(
    data: LabelledTrajectories,
    prior: Prior,
    space: SearchSpace,
    *,
    gaps: Gaps | None = None,
    information_weight: float = 0.01,
    nesting_cost: float = 0.0,
    class_weight: ClassWeight = None,
    operators: Sequence[Operator] = OPERATORS,
    kinds: Sequence[tuple[bool, bool]] = KINDS,
    cap: int = 32,
    supported: bool = False,
) -> ExactProblem:
    """The search for the best primitive of all the data."""
    levels = Levels.of(space, data, cap)
    coded = code(data, trajectory_weights(data.labels, class_weight), levels, space.horizon)
    worth = worth_of(coded, information_weight, nesting_cost, operators)
    free = space.gaps() if gaps is None else gaps
    return ExactProblem(coded, levels, prior, free, worth, kinds, None, supported)


@dataclass(frozen=True)
class Choice:
    """A primitive as the kernels have it."""

    operator: Operator
    complemented: bool
    times: tuple[int, int, int]
    lower: tuple[int, ...]
    upper: tuple[int, ...]

    def key(self, levels: Levels) -> tuple[float, ...]:
        """The rule for primitives that are worth the same: the least key wins."""
        numbers = list(zip(levels.sides, self.lower, self.upper, strict=True))
        closed = sum(
            math.isfinite(sides[lower]) + math.isfinite(sides[upper])
            for sides, lower, upper in numbers
            if math.isinf(sides[0])
        )
        out = -1 if self.complemented else 1  # of a complement the largest box is the tightest
        tightest = [side for _, lower, upper in numbers for side in (-out * lower, out * upper)]
        start, end, duration = self.times
        tight = self.operator in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS)
        times = (-duration, -start, end) if tight else (duration, start, -end)
        return (closed, self.operator.nested, self.complemented, *tightest, not tight, *times)

    def box(self, levels: Levels) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Its lower and upper sides."""
        lower, upper = (
            np.array([sides[number] for sides, number in zip(levels.sides, numbers, strict=True)])
            for numbers in (self.lower, self.upper)
        )
        return lower, upper

    def primitive(self, levels: Levels) -> Primitive:
        """The same in words."""
        shape = Shape(np.array([0, 1]), np.array([OPERATORS.index(self.operator)]), np.array([self.complemented]))
        lower, upper = self.box(levels)
        formula = to_formula(levels.variables, shape, np.array([self.times]), lower[None], upper[None])
        return formula.disjuncts[0].primitives[0]


def every_box(levels: Levels) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """The level numbers of the sides of all boxes that say anything."""
    ranges = [itertools.combinations(range(len(sides)), 2) for sides in levels.sides]
    for pairs in itertools.product(*ranges):
        lower, upper = zip(*pairs, strict=True)
        ends = [
            sides[number]
            for numbers in (lower, upper)
            for sides, number in zip(levels.sides, numbers, strict=True)
        ]  # fmt: skip
        if np.isfinite(ends).any():
            yield lower, upper


def every_time(gaps: Gaps, operator: Operator) -> Iterator[tuple[int, int, int]]:
    """All windows and durations in the gaps."""
    for first, last in gaps:
        for start in range(first, last):
            for end in range(start + 1, last + 1):
                for duration in range(1, last - end + 1) if operator.nested else (0,):
                    yield start, end, duration


def every_choice(problem: ExactProblem) -> Iterator[Choice]:
    """All primitives of a problem's space."""
    operators = [
        operator for operator in OPERATORS if (problem.worth.nested if operator.nested else problem.worth.plain)
    ]
    for operator in operators:
        existential = operator in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS)
        for complemented in (False, True):
            if (existential, complemented) in problem.kinds:
                for lower, upper in every_box(problem.levels):
                    for times in every_time(problem.gaps, operator):
                        yield Choice(operator, complemented, times, lower, upper)


def worth(problem: ExactProblem, data: LabelledTrajectories, weights: NDArray[np.float64], choice: Choice) -> float:
    """J of the whole formula with a primitive in the slot, less the cost of nesting."""
    slot = problem.slot or Slot.alone(len(problem.levels.variables))
    operators, complemented = slot.shape.operators.copy(), slot.shape.complemented.copy()
    times, lower, upper = slot.times.copy(), slot.lower.copy(), slot.upper.copy()
    operators[slot.index], complemented[slot.index] = OPERATORS.index(choice.operator), choice.complemented
    times[slot.index] = choice.times
    lower[slot.index], upper[slot.index] = choice.box(problem.levels)
    formula = Shape(slot.shape.starts, operators, complemented), times, lower, upper
    right = satisfied(data.values, data.lengths, *formula) == (data.labels == 1)
    value = float(weights[right].sum() / weights.sum())
    if problem.worth.information_weight > 0:
        logarithm = log_probability(problem.prior.arrays(data.variables), *formula)
        gain = 0.0 if math.isinf(logarithm) else -logarithm / problem.prior.horizon
        value += problem.worth.information_weight * gain
    return value - problem.worth.nesting_cost * choice.operator.nested


def best_of_all(
    problem: ExactProblem, data: LabelledTrajectories, weights: NDArray[np.float64]
) -> tuple[float, Primitive]:
    """The greatest worth, and of the primitives that have it the first."""
    found = [(worth(problem, data, weights, choice), choice) for choice in every_choice(problem)]
    most = max(value for value, _ in found)
    tied = [choice for value, choice in found if value >= most - TIE]
    first = min(tied, key=lambda choice: choice.key(problem.levels))
    return most, first.primitive(problem.levels)


def every_node(node: Node) -> Iterator[Node]:
    """The single boxes of a node."""
    low_first, low_last, high_first, high_last = node[2:].reshape(4, -1)
    lowers = itertools.product(*(range(a, b + 1) for a, b in zip(low_first, low_last, strict=True)))
    for lower in lowers:
        for upper in itertools.product(*(range(a, b + 1) for a, b in zip(high_first, high_last, strict=True))):
            if all(low < high for low, high in zip(lower, upper, strict=True)):
                yield box_node(bool(node[0]), bool(node[1]), lower, upper)


def box_node(existential: bool, complemented: bool, lower: Sequence[int], upper: Sequence[int]) -> Node:
    """The node of a single box."""
    return np.array([existential, complemented, *lower, *lower, *upper, *upper], dtype=np.int64)
