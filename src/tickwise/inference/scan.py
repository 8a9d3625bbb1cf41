"""Compiled kernels of the exact search: the classification of all windows and durations at once, over coded boxes.

A ◇ or ◇□ primitive is satisfied iff in its window there begins a run of c + 1 ticks (c the duration, 0 for ◇) at which
its predicate holds; a □ or □◇ primitive iff there begins no such run of violations. So a trajectory counts for the
windows without such a beginning, and the maximal ones say it all: the weight of each goes into one cell of a table
over (start, end, duration), and the sum over all maximal windows that contain a window is a running sum in both its
ends. One pass over the trajectories thus gives every window and duration of a box.

A node of the search is a range of boxes. Trajectories with label 1 are judged by the loosest of its predicates, others
by the tightest; this bounds the classification rate of each of its boxes from above; of a single box it is the
rate itself. A node is ``[existential, complemented, lo_min…, lo_max…, hi_min…, hi_max…]`` with the number of a level
for every variable.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit, trailing_zeros
from tickwise.inference.gains import COMPLEMENTED, EXISTENTIAL, SIDES, GainBound, gain_bounds
from tickwise.inference.levels import WORD, Coded

OUTER, INNER = 0, 1


class Worth(NamedTuple):
    """What a primitive is worth beside the trajectories that it classifies.

    Attributes:
        base: The weight of trajectories that are right whatever the primitive.
        total: The weight of all trajectories.
        plain: Whether ◇ and □ are allowed.
        nested: Whether ◇□ and □◇ are.
        nesting_cost: What ◇□ and □◇ cost, in units of J.
        information_weight: λ.
    """

    base: float
    total: float
    plain: bool
    nested: bool
    nesting_cost: float
    information_weight: float


@njit
def _next(row: NDArray[np.uint64], tick: int, flip: np.uint64) -> int:
    """The first tick from ``tick`` on whose bit is set (or clear, where all bits are flipped); the end if none is."""
    word = tick // WORD
    bits = (row[word] ^ flip) >> np.uint64(tick % WORD)
    if bits != 0:
        return tick + int(trailing_zeros(bits))
    for later in range(word + 1, len(row)):
        bits = row[later] ^ flip
        if bits != 0:
            return later * WORD + int(trailing_zeros(bits))
    return len(row) * WORD


@njit
def _signal(
    at_least: NDArray[np.uint64],
    at_most: NDArray[np.uint64],
    alive: NDArray[np.uint64],
    i: int,
    existential: bool,
    complemented: bool,
    sides: NDArray[np.int64],
    row: NDArray[np.uint64],
) -> None:
    """The ticks of a trajectory at which a predicate holds, or for □ and □◇ is violated.

    What comes after its last tick is UNKNOWN: there ◇ may still be satisfied, and □ is not violated (the weak view).

    Args:
        at_least: As in `Coded`, which would cost more to hand over than what is done here.
        at_most: Likewise.
        alive: Likewise.
        i: Which trajectory.
        existential: Whether the operator is ◇ or ◇□.
        complemented: Whether the predicate is the complement of the box.
        sides: The level of each lower side, then of each upper side, shape ``(2 * variables,)``.
        row: Filled with the bits, shape ``(words,)``.
    """
    width = len(sides) // 2
    empty = False
    for variable in range(width):
        empty = empty or sides[variable] >= sides[width + variable]
    for word in range(len(row)):
        bits = np.uint64(0)
        if not empty:
            bits = alive[i, word]
            for variable in range(width):
                bits &= at_least[variable, sides[variable], i, word]
                bits &= at_most[variable, sides[width + variable], i, word]
        if existential == complemented:
            bits = ~bits if existential else alive[i, word] & ~bits
        elif existential:
            bits |= ~alive[i, word]
        row[word] = bits


@njit
def _corner(node: NDArray[np.int64], corner: int, sides: NDArray[np.int64]) -> None:
    """The outermost or the innermost box of a node."""
    width = (len(node) - SIDES) // 4
    for variable in range(width):
        sides[variable] = node[SIDES + corner * width + variable]
        sides[width + variable] = node[SIDES + (3 - corner) * width + variable]


@njit
def tabulate(
    coded: Coded, node: NDArray[np.int64], first: int, last: int, table: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Fill a table with the weight that a node's primitives classify rightly, for windows and durations in a gap.

    Args:
        coded: The trajectories.
        node: The node.
        first: The gap's first tick.
        last: The gap's last tick; windows and durations end by then.
        table: Working space, shape ``(ticks, ticks, ticks)`` with ``ticks >= last - first + 1``.

    Returns:
        A view of the table: the weight for a window from ``first + a`` to ``first + b`` and a duration of c ticks
        at ``[a, b, c]``, for ``a < b`` and ``b + c <= last - first``.
    """
    ticks = last - first + 1
    view = table[:ticks, :ticks, :ticks]
    view[:] = 0.0
    never = np.zeros(ticks + 1)  # weight of the trajectories whose longest run has so many ticks
    row = np.empty(coded.alive.shape[1], dtype=np.uint64)
    begins, ends = np.empty(ticks // 2 + 1, dtype=np.int64), np.empty(ticks // 2 + 1, dtype=np.int64)
    outer, inner = np.empty((len(node) - SIDES) // 2, np.int64), np.empty((len(node) - SIDES) // 2, np.int64)
    _corner(node, OUTER, outer)
    _corner(node, INNER, inner)
    existential, complemented = node[EXISTENTIAL] == 1, node[COMPLEMENTED] == 1
    # a violation is rightly called, and so is a satisfaction: `sign` turns the one count into the other
    right, sign = 0.0, -1.0 if existential else 1.0
    at_least, at_most, alive, labels, weights = coded
    for i in range(len(labels)):
        positive = labels[i]
        weight = weights[i] if positive else -weights[i]
        if positive == existential:
            right += weights[i]
        _signal(
            at_least, at_most, alive, i, existential, complemented, outer if positive != complemented else inner, row
        )
        _add_gaps(row, first, last, sign * weight, begins, ends, view, never)
    _sum_up(view, right, never)
    return view


@njit
def _add_gaps(
    row: NDArray[np.uint64],
    first: int,
    last: int,
    weight: float,
    begins: NDArray[np.int64],
    ends: NDArray[np.int64],
    view: NDArray[np.float64],
    never: NDArray[np.float64],
) -> None:
    """Add a trajectory's weight at its maximal windows in which no run of c + 1 ticks begins, for every c."""
    runs, longest, tick = 0, 0, first
    while tick <= last:
        tick = _next(row, tick, np.uint64(0))
        if tick > last:
            break
        end = min(_next(row, tick, ~np.uint64(0)) - 1, last)
        begins[runs], ends[runs] = tick - first, end - first
        longest = max(longest, end - tick + 1)
        runs += 1
        tick = end + 2
    for duration in range(longest):
        start, kept = 0, 0
        for run in range(runs):
            if ends[run] - begins[run] >= duration:
                if begins[run] - 1 > start:
                    view[start, begins[run] - 1, duration] += weight
                start = ends[run] - duration + 1
                begins[kept], ends[kept] = begins[run], ends[run]
                kept += 1
        runs = kept
        end = last - first - duration
        if end > start:
            view[start, end, duration] += weight
    never[longest] += weight


@njit
def _sum_up(view: NDArray[np.float64], right: float, never: NDArray[np.float64]) -> None:
    """Turn weights at maximal windows into sums over all windows that they contain."""
    ticks = len(view)
    for a in range(ticks):
        for b in range(ticks - 2, a, -1):
            for duration in range(ticks - b - 1):
                view[a, b, duration] += view[a, b + 1, duration]
    for a in range(1, ticks):
        for b in range(a + 1, ticks):
            for duration in range(ticks - b):
                view[a, b, duration] += view[a - 1, b, duration]
    for duration in range(ticks):
        right += never[duration]
        for a in range(ticks - duration):
            for b in range(a + 1, ticks - duration):
                view[a, b, duration] += right


@njit
def _gains(node: NDArray[np.int64], prior: GainBound, worth: Worth, ticks: int) -> NDArray[np.float64]:
    """What the information gain of a node's primitives is worth at most; 0 where it does not count."""
    if worth.information_weight == 0:
        return np.zeros((ticks, ticks))
    return worth.information_weight * gain_bounds(node, prior, ticks)


@njit
def bound(
    coded: Coded,
    node: NDArray[np.int64],
    gaps: NDArray[np.int64],
    worth: Worth,
    prior: GainBound,
    table: NDArray[np.float64],
    times: NDArray[np.int64],
) -> float:
    """An upper bound on what any primitive of a node is worth, and the window and duration that attain it.

    Args:
        coded: The trajectories.
        node: The node.
        gaps: Free intervals of ticks, shape ``(gaps, 2)``.
        worth: What counts.
        prior: What bounds the information gain.
        table: Working space as in `tabulate`.
        times: Filled with window start, window end and duration.

    Returns:
        The bound, in units of J.
    """
    most = -np.inf
    for gap in range(len(gaps)):
        first, last = gaps[gap, 0], gaps[gap, 1]
        view = tabulate(coded, node, first, last, table)
        gains = _gains(node, prior, worth, len(view))
        for a in range(len(view)):
            for b in range(a + 1, len(view)):
                for duration in range(0 if worth.plain else 1, len(view) - b if worth.nested else 1):
                    value = (worth.base + view[a, b, duration]) / worth.total
                    value += gains[b - a, duration]
                    value -= worth.nesting_cost if duration else 0.0
                    if value > most:
                        most = value
                        times[0], times[1], times[2] = first + a, first + b, duration
    return most


@njit
def bound_all(
    coded: Coded,
    nodes: NDArray[np.int64],
    gaps: NDArray[np.int64],
    worth: Worth,
    prior: GainBound,
    ticks: int,
) -> NDArray[np.float64]:
    """`bound` of many nodes, shape ``(nodes,)``; ``ticks`` is the length of the longest gap."""
    table = np.empty((ticks, ticks, ticks))
    times = np.empty(3, dtype=np.int64)
    result = np.empty(len(nodes))
    for k in range(len(nodes)):
        result[k] = bound(coded, nodes[k], gaps, worth, prior, table, times)
    return result


@njit
def candidates(
    coded: Coded,
    node: NDArray[np.int64],
    gaps: NDArray[np.int64],
    worth: Worth,
    prior: GainBound,
    ticks: int,
    enough: float,
    floor: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """The windows and durations of one box that may be worth enough.

    Args:
        coded: The trajectories.
        node: A node of a single box.
        gaps: Free intervals of ticks, shape ``(gaps, 2)``.
        worth: What counts.
        prior: What bounds the information gain.
        ticks: The length of the longest gap.
        enough: What they have to be worth at least, as far as the bound on the information gain tells.
        floor: Those with a tighter neighbour that classifies as well are left out, since the neighbour says more. That
            is so where its probability is not 0, which has to be known of every one that classifies rightly more
            than this weight.

    Returns:
        Times, shape ``(m, 3)``; the weight that each classifies rightly; and what each is worth at most.
    """
    table = np.empty((ticks, ticks, ticks))
    times, weights, most = [], [], []
    for gap in range(len(gaps)):
        first, last = gaps[gap, 0], gaps[gap, 1]
        view = tabulate(coded, node, first, last, table)
        gains = _gains(node, prior, worth, len(view))
        for a in range(len(view)):
            for b in range(a + 1, len(view)):
                for duration in range(0 if worth.plain else 1, len(view) - b if worth.nested else 1):
                    value = (worth.base + view[a, b, duration]) / worth.total
                    value += gains[b - a, duration]
                    value -= worth.nesting_cost if duration else 0.0
                    if value < enough or _dominated(view, a, b, duration, node[EXISTENTIAL] == 1, floor):
                        continue
                    times.append((first + a, first + b, duration))
                    weights.append(view[a, b, duration])
                    most.append(value)
    found = np.empty((len(times), 3), dtype=np.int64)
    for k in range(len(times)):
        found[k, 0], found[k, 1], found[k, 2] = times[k]
    return found, np.array(weights), np.array(most)


@njit
def _dominated(view: NDArray[np.float64], a: int, b: int, duration: int, existential: bool, floor: float) -> bool:
    """Whether a neighbour in the table that implies this primitive classifies at least as well."""
    ticks, most = len(view), -np.inf
    if existential:
        if a + 1 < b:
            most = max(view[a + 1, b, duration], view[a, b - 1, duration])
        if duration > 0 and b + duration + 1 < ticks:
            most = max(most, view[a, b, duration + 1])
        if duration > 0 and a + 1 < b:
            most = max(most, view[a, b - 1, duration + 1])
    else:
        if a > 0:
            most = view[a - 1, b, duration]
        if b + 1 + duration < ticks:
            most = max(most, view[a, b + 1, duration])
        if duration >= 2:
            most = max(most, view[a, b, duration - 1], view[a, b + 1, duration - 1])
    return most >= view[a, b, duration] and most > floor


@njit
def signature(
    coded: Coded, existential: bool, complemented: bool, sides: NDArray[np.int64], times: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each trajectory satisfies a primitive, by the weak view, shape ``(n,)``."""
    at_least, at_most, alive, labels, _ = coded
    row = np.empty(alive.shape[1], dtype=np.uint64)
    result = np.empty(len(labels), dtype=np.bool_)
    for i in range(len(result)):
        _signal(at_least, at_most, alive, i, existential, complemented, sides, row)
        result[i] = _begins(row, times) == existential
    return result


@njit
def weigh(
    coded: Coded, existential: bool, complemented: bool, sides: NDArray[np.int64], times: NDArray[np.int64]
) -> float:
    """The weight of the trajectories that a primitive classifies rightly."""
    at_least, at_most, alive, labels, weights = coded
    row = np.empty(alive.shape[1], dtype=np.uint64)
    right = 0.0
    for i in range(len(labels)):
        _signal(at_least, at_most, alive, i, existential, complemented, sides, row)
        if (_begins(row, times) == existential) == labels[i]:
            right += weights[i]
    return right


@njit
def _begins(row: NDArray[np.uint64], times: NDArray[np.int64]) -> bool:
    """Whether a run of duration + 1 ticks begins in the window; the row has bits for all its ticks."""
    tick, last, duration = times[0], times[1], times[2]
    while tick <= last:
        tick = _next(row, tick, np.uint64(0))
        if tick > last:
            return False
        end = _next(row, tick, ~np.uint64(0))
        if end - tick > duration:
            return True
        tick = end + 1
    return False
