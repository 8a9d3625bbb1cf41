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

from tickwise._jit import njit
from tickwise.inference.gains import COMPLEMENTED, EXISTENTIAL, SIDES, GainBound, gain_bounds
from tickwise.inference.levels import Coded
from tickwise.inference.signals import next_bit, signal

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
        A view of the table: the weight for a duration of c ticks and a window from ``first + a`` to ``first + b`` at
        ``[c, a, b]``, for ``a < b`` and ``b + c <= last - first``.
    """
    ticks = last - first + 1
    view = table[:ticks, :ticks, :ticks]
    for duration in range(ticks):
        for tick in range(duration, ticks):
            for end in range(tick, ticks):
                view[duration, tick, end] = 0.0
    gaps = _Gaps(view, np.zeros((ticks + 1, ticks)), np.zeros((ticks + 1, ticks)), np.zeros(ticks + 1))
    row = np.empty(coded.alive.shape[1], dtype=np.uint64)
    ends, lengths = np.empty(ticks // 2 + 1, dtype=np.int64), np.empty(ticks // 2 + 1, dtype=np.int64)
    corners = np.empty((2, (len(node) - SIDES) // 2), dtype=np.int64)
    _corner(node, OUTER, corners[0])
    _corner(node, INNER, corners[1])
    existential, complemented = node[EXISTENTIAL] == 1, node[COMPLEMENTED] == 1
    # a violation is rightly called, and so is a satisfaction: the sign turns the one count into the other
    at_least, at_most, alive, labels, weights = coded
    right = 0.0
    for i in range(len(labels)):
        positive, weight = labels[i], weights[i]
        right += weight * (positive == existential)
        sides = corners[int(positive == complemented)]
        signal(at_least, at_most, alive, i, existential, complemented, sides, row)
        _add_gaps(row, first, last, weight * (1.0 - 2.0 * (positive == existential)), gaps, ends, lengths)
    _sum_up(gaps, right)
    return view


class _Gaps(NamedTuple):
    """Weights of maximal windows in which no run of c + 1 ticks begins, as steps over the duration c.

    Such a window ends before a run that is long enough and begins where too little is left of the one before. The last
    tick of the latter thus says where, for all c at once.

    Attributes:
        between: Of windows between two runs, at ``[c, tick after the first run, last tick before the second]``.
        before: Of windows before the first such run, at ``[c, last tick]``.
        after: Of windows after the last such run, at ``[c, tick after the run]``.
        never: Of all windows, where no run is longer than c ticks, at ``[c]``.
    """

    between: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    never: NDArray[np.float64]


@njit
def _add_gaps(
    row: NDArray[np.uint64],
    first: int,
    last: int,
    weight: float,
    gaps: _Gaps,
    ends: NDArray[np.int64],
    lengths: NDArray[np.int64],
) -> None:
    """Add a trajectory's weight; ``ends`` and ``lengths`` are room for a stack of runs, the longest at the bottom."""
    top, tick = 0, first
    while tick <= last:
        tick = next_bit(row, tick, np.uint64(0))
        if tick > last:
            break
        end = min(next_bit(row, tick, ~np.uint64(0)) - 1, last)
        begin, length, hidden = tick - first, end - tick + 1, 0
        while top > 0:  # the runs that this one sees over those between, which are at most `hidden` long
            shorter = min(lengths[top - 1], length)
            if shorter > hidden:
                gaps.between[hidden, ends[top - 1] + 1, begin - 1] += weight
                gaps.between[shorter, ends[top - 1] + 1, begin - 1] -= weight
            if lengths[top - 1] > length:
                break
            hidden = lengths[top - 1]
            top -= 1
        if top == 0 and length > hidden and begin > 0:
            gaps.before[hidden, begin - 1] += weight
            gaps.before[length, begin - 1] -= weight
        ends[top], lengths[top] = end - first, length
        top += 1
        tick = end + 2
    gaps.never[lengths[0] if top > 0 else 0] += weight
    hidden = 0
    while top > 0:
        top -= 1
        if lengths[top] > hidden and ends[top] < last - first:
            gaps.after[hidden, ends[top] + 1] += weight
            gaps.after[lengths[top], ends[top] + 1] -= weight
        hidden = lengths[top]


@njit
def _sum_up(gaps: _Gaps, right: float) -> None:
    """Turn weights of maximal windows into sums over all windows that they contain, in the place of ``between``."""
    view = gaps.between
    ticks = len(view)
    between, before, after = np.zeros((ticks, ticks)), np.zeros(ticks), np.zeros(ticks)
    for duration in range(ticks - 1):
        right += gaps.never[duration]
        before += gaps.before[duration]
        after += gaps.after[duration]
        for tick in range(duration, ticks):
            for b in range(tick, ticks):
                between[tick, b] += view[duration, tick, b]
        ended, size = before.copy(), ticks - duration
        reached = right
        for a in range(size - 1):
            for b in range(a + duration, size):
                ended[b] += between[a + duration, b]  # weight of the windows that begin by a and end at b
            reached += after[a + duration]
            total = reached
            for b in range(size - 1, a, -1):
                total += ended[b]
                view[duration, a, b] = total


@njit
def _gains(node: NDArray[np.int64], prior: GainBound, worth: Worth, ticks: int) -> NDArray[np.float64]:
    """What the information gain of a node's primitives is worth at most; 0 where it does not count."""
    if worth.information_weight == 0:
        return np.zeros((ticks, ticks))
    return worth.information_weight * gain_bounds(node, prior, ticks)


@njit
def _durations(worth: Worth, ticks: int) -> range:
    """The durations that are allowed in a gap of so many ticks; 0 stands for ◇ and □."""
    return range(0 if worth.plain else 1, ticks - 1 if worth.nested else 1)


@njit
def _value(view: NDArray[np.float64], gains: NDArray[np.float64], worth: Worth, duration: int, a: int, b: int) -> float:
    """What the primitive of an entry of the table is worth at most."""
    value = float((worth.base + view[duration, a, b]) / worth.total + gains[b - a, duration])
    return value - worth.nesting_cost if duration else value


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
        for duration in _durations(worth, len(view)):
            for a in range(len(view) - duration):
                for b in range(a + 1, len(view) - duration):
                    value = _value(view, gains, worth, duration, a, b)
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
        for duration in _durations(worth, len(view)):
            for a in range(len(view) - duration):
                for b in range(a + 1, len(view) - duration):
                    value = _value(view, gains, worth, duration, a, b)
                    if value < enough or _dominated(view, a, b, duration, node[EXISTENTIAL] == 1, floor):
                        continue
                    times.append((first + a, first + b, duration))
                    weights.append(view[duration, a, b])
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
            most = max(view[duration, a + 1, b], view[duration, a, b - 1])
        if duration > 0 and b + duration + 1 < ticks:
            most = max(most, view[duration + 1, a, b])
        if duration > 0 and a + 1 < b:
            most = max(most, view[duration + 1, a, b - 1])
    else:
        if a > 0:
            most = view[duration, a - 1, b]
        if b + 1 + duration < ticks:
            most = max(most, view[duration, a, b + 1])
        if duration >= 2:
            most = max(most, view[duration - 1, a, b], view[duration - 1, a, b + 1])
    return most >= view[duration, a, b] and most > floor
