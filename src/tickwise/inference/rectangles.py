"""Hyper-rectangles of the parameters of a whole formula, and compiled bounds on what their formulas are worth.

A rectangle has a range for every integer parameter of every primitive: the levels of its lower and of its upper sides,
window start, window end and duration. It is an array of shape ``(primitives, 2 * variables + 3, 2)``, the least value
of each parameter and then the greatest.

The bound takes each trajectory by itself: a positive one is rightly called if any parameters of the rectangle let each
primitive of some disjunct be satisfied, a negative one if any let some primitive of each disjunct be violated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.inference.counting import log_probability
from tickwise.inference.gains import SIDES, GainBound, least_measure, never_begun, run_begun
from tickwise.inference.kernels import EVENTUALLY, EVENTUALLY_ALWAYS, PriorArrays, Shape
from tickwise.inference.levels import WORD, Coded, Levels
from tickwise.inference.signals import next_bit, run_begins, signal

LEAST, GREATEST = 0, 1

Rectangle = NDArray[np.int64]


class Formulas(NamedTuple):
    """What rectangles are bounded against.

    Attributes:
        coded: The trajectories.
        shape: Operators and polarities.
        sides: The levels, padded with NaN, shape ``(variables, levels)``.
        horizon: The last tick of windows and durations.
        prior: The prior's arrays.
        limits: What bounds the information gain of one primitive under the prior.
        information_weight: λ.
    """

    coded: Coded
    shape: Shape
    sides: NDArray[np.float64]
    horizon: int
    prior: PriorArrays
    limits: GainBound
    information_weight: float


def everything(levels: Levels, shape: Shape, horizon: int) -> Rectangle:
    """All parameters of a formula, valid or not."""
    primitives, last = len(shape.operators), [len(sides) - 1 for sides in levels.sides]
    rows = [[0, end - 1] for end in last] + [[1, end] for end in last] + [[0, horizon], [0, horizon], [1, horizon]]
    rectangle = np.tile(np.array(rows, dtype=np.int64), (primitives, 1, 1))
    rectangle[shape.operators < EVENTUALLY_ALWAYS, -1] = 0
    return rectangle


@njit
def existential(operator: int) -> bool:
    """Whether the operator is ◇ or ◇□."""
    return operator in (EVENTUALLY, EVENTUALLY_ALWAYS)


@njit
def is_single(rectangle: Rectangle) -> bool:
    """Whether it is one formula only."""
    return bool(np.all(rectangle[:, :, LEAST] == rectangle[:, :, GREATEST]))


@njit
def tighten(rectangle: Rectangle, formulas: Formulas) -> bool:
    """Leave out values that no valid formula of a rectangle has, in place; whether there may be one at all.

    Lower sides are below upper sides, windows have two ticks or more, primitives of a disjunct follow one another up
    to the horizon, and a box has a closed side.
    """
    width = (rectangle.shape[1] - 3) // 2
    start, end, duration = 2 * width, 2 * width + 1, 2 * width + 2
    starts = formulas.shape.starts
    for i in range(len(starts) - 1):
        first = 0
        for j in range(starts[i], starts[i + 1]):
            low, high = rectangle[j, :, LEAST], rectangle[j, :, GREATEST]
            for v in range(width):
                low[width + v] = max(low[width + v], low[v] + 1)
                high[v] = min(high[v], high[width + v] - 1)
            low[start] = max(low[start], first)
            low[end] = max(low[end], low[start] + 1)
            first = low[end] + low[duration] + 1
        last = formulas.horizon
        for j in range(starts[i + 1] - 1, starts[i] - 1, -1):
            low, high = rectangle[j, :, LEAST], rectangle[j, :, GREATEST]
            high[end] = min(high[end], last - low[duration])
            high[duration] = min(high[duration], last - low[end])
            high[start] = min(high[start], high[end] - 1)
            last = high[start] - 1
    for j in range(len(rectangle)):
        if np.any(rectangle[j, :, LEAST] > rectangle[j, :, GREATEST]):
            return False
        closed = False
        for v in range(width):
            lower, upper = rectangle[j, v, GREATEST], rectangle[j, width + v, LEAST]
            closed = closed or np.isfinite(formulas.sides[v, lower]) or np.isfinite(formulas.sides[v, upper])
        if not closed:
            return False
    return True


@njit
def corner(rectangle: Rectangle, j: int, outer: bool, sides: NDArray[np.int64]) -> None:
    """The outermost or the innermost box of a primitive; the innermost may be reversed, which is no box."""
    width = len(sides) // 2
    for v in range(width):
        sides[v] = rectangle[j, v, LEAST if outer else GREATEST]
        sides[width + v] = rectangle[j, width + v, GREATEST if outer else LEAST]


@njit
def may_be_free(row: NDArray[np.uint64], start: Rectangle, end: Rectangle, duration: int) -> bool:
    """Whether some window has no tick at which a run of duration + 1 set bits begins.

    Args:
        row: The bits.
        start: The least and the greatest start of the windows.
        end: Their least and greatest end, each greater than that of the start.
        duration: The ticks that a run goes on after its first.
    """
    if start[GREATEST] < end[LEAST]:  # a window that all others contain
        return not run_begins(row, np.array([start[GREATEST], end[LEAST], duration]))
    last = start[GREATEST] + 1
    free = tick = max(start[LEAST], end[LEAST] - 1)  # ticks from `free` on up to `tick` begin no run
    while free < last:
        first = next_bit(row, tick, np.uint64(0))
        after = first if first == len(row) * WORD else next_bit(row, first, ~np.uint64(0))
        if after - first > duration:
            if first - free >= 2:
                return True
            free = after - duration
        tick = after
        if free < last and after - free >= 2:
            return True
    return False


@njit
def _may(
    formulas: Formulas,
    rectangle: Rectangle,
    j: int,
    i: int,
    satisfied: bool,
    row: NDArray[np.uint64],
    sides: NDArray[np.int64],
) -> bool:
    """Whether some parameters let trajectory i satisfy (or violate) primitive j."""
    some, complemented = existential(formulas.shape.operators[j]), formulas.shape.complemented[j]
    corner(rectangle, j, satisfied != complemented, sides)
    coded = formulas.coded
    signal(coded.at_least, coded.at_most, coded.alive, i, some, complemented, sides, row)
    start, end, duration = rectangle[j, -3], rectangle[j, -2], rectangle[j, -1]
    if satisfied == some:
        return run_begins(row, np.array([start[LEAST], end[GREATEST], duration[LEAST]]))
    return may_be_free(row, start, end, duration[GREATEST])


@njit
def rate_bound(formulas: Formulas, rectangle: Rectangle, least: float) -> float:
    """The greatest classification rate of a rectangle's formulas, or more; any number where it is below ``least``."""
    coded, starts = formulas.coded, formulas.shape.starts
    row, sides = np.empty(coded.alive.shape[1], np.uint64), np.empty(rectangle.shape[1] - 3, np.int64)
    total = coded.weights.sum()
    right = total
    for i in range(len(coded.positive)):
        positive = coded.positive[i]
        called = False
        for d in range(len(starts) - 1):
            broken = False  # by a primitive that no positive trajectory may satisfy, or that this negative may violate
            for j in range(starts[d], starts[d + 1]):
                if _may(formulas, rectangle, j, i, positive, row, sides) != positive:
                    broken = True
                    break
            if not broken:
                called = True
                break
        if called != positive:
            right -= coded.weights[i]
            if right < least * total:
                break
    return float(right / total)


@njit
def _tightest(
    formulas: Formulas,
    rectangle: Rectangle,
    j: int,
    first: int,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> bool:
    """Fill the primitive that implies all of a place's; whether there is one that starts at a tick or after it."""
    some, complemented = existential(formulas.shape.operators[j]), formulas.shape.complemented[j]
    start, end, duration = rectangle[j, -3], rectangle[j, -2], rectangle[j, -1]
    times[0] = start[GREATEST] if some else start[LEAST]
    times[1] = end[LEAST] if some else end[GREATEST]
    times[2] = duration[GREATEST] if some else duration[LEAST]
    sides = np.empty(rectangle.shape[1] - 3, np.int64)
    corner(rectangle, j, complemented, sides)
    width = len(sides) // 2
    for v in range(width):
        lower[v], upper[v] = formulas.sides[v, sides[v]], formulas.sides[v, sides[width + v]]
    return bool(times[0] <= times[1] and times[0] >= first and np.all(lower <= upper))


@njit
def gain_of_tightest(formulas: Formulas, rectangle: Rectangle) -> float:
    """The information gain of a formula that implies all of a rectangle's; infinite where none is known or P is 0."""
    starts, primitives = formulas.shape.starts, len(rectangle)
    times, kept = np.empty((primitives, 3), np.int64), np.empty(primitives, np.bool_)
    lower, upper = np.empty((2, primitives, len(formulas.sides)))
    lengths = [0]
    for d in range(len(starts) - 1):
        good, first = True, 0
        for j in range(starts[d], starts[d + 1]):
            good = good and _tightest(formulas, rectangle, j, first, times[j], lower[j], upper[j])
            first = times[j, 1] + times[j, 2] + 1
        kept[starts[d] : starts[d + 1]] = good
        if good:  # what is left of a disjunction is less probable
            lengths.append(lengths[-1] + starts[d + 1] - starts[d])
    if len(lengths) == 1:
        return np.inf
    shape = Shape(np.array(lengths), formulas.shape.operators[kept], formulas.shape.complemented[kept])
    return float(
        -log_probability(formulas.prior, shape, times[kept], lower[kept], upper[kept]) / formulas.prior.horizon
    )


@njit
def _gain_of_draws(formulas: Formulas, rectangle: Rectangle) -> float:
    """A bound on the information gain where ticks are independent draws: primitives of a disjunct add up."""
    limits, shape, size = formulas.limits, formulas.shape, rectangle.shape[1] - 3
    possible, most = np.inf, 0.0
    for d in range(len(shape.starts) - 1):
        gain, impossible = 0.0, False
        for j in range(shape.starts[d], shape.starts[d + 1]):
            some = existential(shape.operators[j])
            node = np.empty(SIDES + 2 * size, np.int64)
            node[0], node[1] = some, shape.complemented[j]
            node[SIDES : SIDES + size // 2] = rectangle[j, : size // 2, LEAST]
            node[SIDES + size // 2 : SIDES + size] = rectangle[j, : size // 2, GREATEST]
            node[SIDES + size : SIDES + 3 * size // 2] = rectangle[j, size // 2 : size, LEAST]
            node[SIDES + 3 * size // 2 :] = rectangle[j, size // 2 : size, GREATEST]
            holds, empty = least_measure(node, limits)
            impossible = impossible or empty
            start, end, duration = rectangle[j, -3], rectangle[j, -2], rectangle[j, -1]
            if some:
                span = max(end[LEAST] - start[GREATEST], 1)
                gain -= np.log(run_begun(holds, duration[GREATEST], span + 1)[span])
            else:
                gain += never_begun(holds, end[GREATEST] - start[LEAST], duration[LEAST])
        most = max(most, gain)
        if not impossible:
            possible = min(possible, gain)
    return min(possible, most) / limits.horizon


@njit
def bound(formulas: Formulas, rectangle: Rectangle, least: float) -> float:
    """An upper bound on J of a rectangle's formulas; of a single one J itself.

    Args:
        formulas: What they are bounded against.
        rectangle: The rectangle, tightened.
        least: What is below it need not be exact.
    """
    weight = formulas.information_weight
    if weight == 0:
        return rate_bound(formulas, rectangle, least)
    gain = _gain_of_draws(formulas, rectangle) if formulas.prior.independent else formulas.prior.most
    rate = rate_bound(formulas, rectangle, least - weight * gain)
    if rate + weight * gain < least:
        return rate + weight * gain
    exact = gain_of_tightest(formulas, rectangle)
    if is_single(rectangle):
        return rate + (0.0 if np.isinf(exact) else weight * exact)
    return rate + weight * min(gain, exact)


@njit
def expand(formulas: Formulas, rectangles: Rectangle, least: float) -> tuple[Rectangle, NDArray[np.float64]]:
    """Halves of the widest range of each rectangle, and their bounds: -inf where no formula is left."""
    shape = rectangles.shape
    halves, bounds = np.empty((2 * shape[0], shape[1], shape[2], 2), np.int64), np.empty(2 * len(rectangles))
    for k in range(len(bounds)):
        half = halves[k]
        half[:] = rectangles[k // 2]
        widest = int(np.argmax(half[:, :, GREATEST] - half[:, :, LEAST]))
        sides = half[widest // shape[2], widest % shape[2]]
        middle = (sides[LEAST] + sides[GREATEST]) // 2
        if k % 2 == 0:
            sides[GREATEST] = middle
        else:
            sides[LEAST] = middle + 1
        bounds[k] = bound(formulas, half, least) if tighten(half, formulas) else -np.inf
    return halves, bounds
