"""Compiled kernels of the search: weak-view satisfaction of formulas in SDNF; `counting` has the exact probability.

A formula is plain arrays here: `Shape` holds what the search keeps fixed (operators, polarities), and three
parameter arrays hold what it changes: ``times`` (n, 3) with rows (window start, window end, duration), ``lower`` and
``upper`` (n, variables) with infinities on open sides. Primitives are numbered through all disjuncts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit

EVENTUALLY, ALWAYS, EVENTUALLY_ALWAYS, ALWAYS_EVENTUALLY = 0, 1, 2, 3


class Shape(NamedTuple):
    """The fixed part of a formula: which primitives, in which disjunct.

    Attributes:
        starts: First primitive of each disjunct and the number of primitives, shape ``(disjuncts + 1,)``.
        operators: 0, 1, 2, 3 for ◇, □, ◇□, □◇, shape ``(n,)``; int64.
        complemented: Whether the predicate is the complement of its box, shape ``(n,)``.
    """

    starts: NDArray[np.int64]
    operators: NDArray[np.int64]
    complemented: NDArray[np.bool_]


class PriorArrays(NamedTuple):
    """A prior distribution as plain arrays; see `tickwise.inference.prior`.

    Attributes:
        independent: Whether ticks are independent uniform draws from ``[low, high]``; else a chain.
        horizon: The last tick L.
        most: An upper bound on the information gain of a formula with positive probability.
        coordinates: Chain states, shape ``(states, variables)``.
        indptr: CSR row pointers of the steps.
        indices: CSR successors.
        weights: CSR weights.
        scale: Divisor of a step at each tick, shape ``(L,)``.
        backward: Weight of all continuations, shape ``(L + 1, states)``.
        forward: Weight of all beginnings, shape ``(L + 1, states)``.
        low: Lower ends of the independent draws, shape ``(variables,)``.
        high: Upper ends, shape ``(variables,)``.
    """

    independent: bool
    horizon: int
    most: float
    coordinates: NDArray[np.float64]
    indptr: NDArray[np.int64]
    indices: NDArray[np.int64]
    weights: NDArray[np.float64]
    scale: NDArray[np.float64]
    backward: NDArray[np.float64]
    forward: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@njit
def inside(row: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64]) -> bool:
    """Whether a state lies in a closed box."""
    for variable in range(len(lower)):
        if row[variable] < lower[variable] or row[variable] > upper[variable]:
            return False
    return True


@njit
def primitive_satisfied(
    states: NDArray[np.float64],
    length: int,
    operator: int,
    complemented: bool,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> bool:
    """Whether the verdict on one trajectory is not FALSE (the weak view), by one pass over the effect window."""
    first, last, duration = times[0], times[1], times[2]
    existential = operator in (EVENTUALLY, EVENTUALLY_ALWAYS)
    if existential and last >= length:
        return True  # the tick after the end is UNKNOWN, and one is enough
    # □ and □◇ look for a run of violations, ◇ and ◇□ for a run of the predicate; both runs have duration+1 ticks
    wanted = existential != complemented
    needed = duration + 1 if operator >= EVENTUALLY_ALWAYS else 1
    run = 0
    for tick in range(first, min(last + needed, length)):
        if inside(states[tick], lower, upper) == wanted:
            run += 1
            if run == needed:
                return existential
        else:
            run = 0
            if tick >= last:  # no run can start inside the window any more
                return not existential
    # the trajectory ended within a run that started in the window: UNKNOWN
    return not existential or (run > 0 and length < last + needed)


@njit
def formula_satisfied(
    states: NDArray[np.float64],
    length: int,
    shape: Shape,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> bool:
    """Whether the weak verdict of a whole SDNF on one trajectory is not FALSE."""
    for disjunct in range(len(shape.starts) - 1):
        good = True
        for j in range(shape.starts[disjunct], shape.starts[disjunct + 1]):
            if not primitive_satisfied(
                states, length, shape.operators[j], shape.complemented[j], times[j], lower[j], upper[j]
            ):
                good = False
                break
        if good:
            return True
    return False


@njit
def satisfied(
    values: NDArray[np.float64],
    lengths: NDArray[np.int64],
    shape: Shape,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Weak-view satisfaction of an SDNF by every trajectory.

    Args:
        values: States, shape ``(n, ticks, variables)``.
        lengths: Number of states, shape ``(n,)``.
        shape: The fixed part of the formula.
        times: Windows and durations, shape ``(primitives, 3)``.
        lower: Lower box sides, shape ``(primitives, variables)``.
        upper: Upper box sides, shape ``(primitives, variables)``.

    Returns:
        The signature g = 1 as booleans, shape ``(n,)``.
    """
    result = np.empty(len(values), dtype=np.bool_)
    for i in range(len(values)):
        result[i] = formula_satisfied(values[i], lengths[i], shape, times, lower, upper)
    return result
