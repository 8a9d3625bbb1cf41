"""Kernels for robustness: signals as numbers, one row a tick, with the trajectories of a block side by side.

Windows are swept by the algorithm of van Herk and of Gil and Werman: running extrema forwards and backwards within
stretches of the window's width, of which each window takes two. That is three comparisons a tick, whatever the width.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.logic.bits import U, has_nan
from tickwise.logic.program import BOTH, CONSTANT, EITHER, EVERY, INSIDE, OUTSIDE

Signals = NDArray[np.float64]
LANES = 64
"""The most trajectories of a block."""

NUMBERS = 16384
"""The most numbers of a block's signal, so that all of its signals stay in the processor's cache."""


@njit
def pick(least: bool, a: float, b: float) -> float:
    """The less or the greater of two numbers."""
    return (a if a < b else b) if least else (a if a > b else b)


@njit
def sweep(signals: Signals, slot: int, scratch: int, least: bool, width: int, ticks: int) -> None:
    """Replace a signal by the extrema of the windows that begin at so many ticks."""
    lanes = signals.shape[2]
    last = ticks + width - 1
    for t in range(last):
        for lane in range(lanes):
            value = signals[slot, t, lane]
            if t % width == 0:
                signals[scratch, t, lane] = value
            else:
                signals[scratch, t, lane] = pick(least, signals[scratch, t - 1, lane], value)
    for t in range(last - 2, -1, -1):
        if (t + 1) % width > 0:
            for lane in range(lanes):
                signals[slot, t, lane] = pick(least, signals[slot, t, lane], signals[slot, t + 1, lane])
    for t in range(ticks):
        end = t + width - 1
        for lane in range(lanes):
            signals[slot, t, lane] = pick(least, signals[slot, t, lane], signals[scratch, end, lane])


@njit
def one_window(signals: Signals, slot: int, least: bool, width: int) -> None:
    """Replace a signal by the extremum of one window."""
    lanes = signals.shape[2]
    for t in range(1, width):
        for lane in range(lanes):
            signals[slot, 0, lane] = pick(least, signals[slot, 0, lane], signals[slot, t, lane])


@njit
def load(
    signals: Signals,
    slot: int,
    columns: Signals,
    sides: NDArray[np.float64],
    box: int,
    begin: int,
    complemented: bool,
    stride: int,
    ticks: int,
) -> None:
    """Push the distance to the sides of a box, or to those of its complement, at some ticks of the data."""
    lanes = signals.shape[2]
    signals[slot, :ticks] = -np.inf if complemented else np.inf
    for side in range(len(sides)):
        if int(sides[side, 0]) != box:
            continue
        column = U(sides[side, 1])
        sign = -sides[side, 3] if complemented else sides[side, 3]
        offset = sign * sides[side, 2]  # so a distance of 0 has no minus sign
        for t in range(ticks):
            row = U((begin + t) * stride) + column
            for lane in range(lanes):
                distance = sign * columns[row, lane] - offset
                signals[slot, t, lane] = pick(not complemented, signals[slot, t, lane], distance)


@njit
def cut(
    signals: Signals, slot: int, lengths: NDArray[np.int64], begin: int, fill: float, known: int, ticks: int
) -> None:
    """Put the filling where a trajectory has ended."""
    for t in range(ticks):
        for lane in range(signals.shape[2]):
            if t >= known or begin + t >= lengths[lane]:
                signals[slot, t, lane] = fill


@njit
def evaluate(
    code: NDArray[np.int64],
    stride: int,
    sides: NDArray[np.float64],
    columns: Signals,
    lengths: NDArray[np.int64],
    fill: float,
    whole: bool,
    signals: Signals,
) -> None:
    """Run a program on a block of trajectories; ``signals[0, 0]`` is the answer.

    Args:
        code: The program.
        stride: The number of variables.
        sides: The sides of the boxes.
        columns: The values, a row for each variable of each tick, shape (ticks * stride, lanes).
        lengths: The number of states of each trajectory, shape (lanes,).
        fill: What the robustness of unknown predicates is taken for: -inf or inf.
        whole: Whether no trajectory ends within the horizon.
        signals: The stack and a signal beside it, shape (depth + 1, ticks of the longest, lanes).
    """
    lanes, scratch = signals.shape[2], len(signals) - 1
    top = -1
    for i in range(len(code)):
        operation, first, second, ticks = code[i]
        if operation in (INSIDE, OUTSIDE):
            top += 1
            known = min(ticks, len(columns) // stride - second)
            load(signals, top, columns, sides, first, second, operation == OUTSIDE, stride, known)
            if not whole:
                cut(signals, top, lengths, second, fill, known, ticks)
        elif operation == CONSTANT:
            top += 1
            signals[top, :ticks] = np.inf if first else -np.inf
        elif operation in (BOTH, EITHER):
            top -= 1
            for t in range(ticks):
                for lane in range(lanes):
                    signals[top, t, lane] = pick(operation == BOTH, signals[top, t, lane], signals[top + 1, t, lane])
        elif ticks == 1:
            one_window(signals, top, operation == EVERY, first)
        else:
            sweep(signals, top, scratch, operation == EVERY, first, ticks)


@njit
def robustness(
    rows: NDArray[np.float64],
    lengths: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    stride: int,
    horizon: int,
    ticks: int,
    code: NDArray[np.int64],
    sides: NDArray[np.float64],
    depth: int,
    reach: int,
) -> int:
    """Both ends of the robustness of a program on trajectories, a block at a time.

    Args:
        rows: The values of each trajectory in a row, shape (n, ticks * variables).
        lengths: The number of states of each trajectory, shape (n,).
        lower: Takes the lower ends, shape (n,).
        upper: Takes the upper ends, shape (n,).
        stride: The number of variables, at least 1.
        horizon: The formula's end-effect time.
        ticks: How many of the first ticks matter.
        code: The program.
        sides: The sides of the boxes.
        depth: The most signals on the stack.
        reach: The most ticks of a signal.

    Returns:
        A trajectory that has NaN within its length, where the work stopped; or -1.
    """
    lanes = max(8, min(LANES, NUMBERS // reach, len(rows)))
    values = min(ticks * stride, rows.shape[1])
    columns = np.zeros((values, lanes))
    signals = np.empty((depth + 1, reach, lanes))
    ends = np.zeros(lanes, dtype=np.int64)
    for first in range(0, len(rows), lanes):
        count = min(lanes, len(rows) - first)
        shortest = horizon + 1
        for lane in range(count):
            row, length = U(first + lane), lengths[first + lane]
            if has_nan(rows, first + lane, min(length * stride, rows.shape[1])):
                return first + lane
            shortest = min(shortest, length)
            ends[lane] = length
            for k in range(values):
                columns[k, lane] = rows[row, k]
        whole = shortest > horizon
        evaluate(code, stride, sides, columns, ends, -np.inf, whole, signals)
        lower[first : first + count] = signals[0, 0, :count]
        if not whole:
            evaluate(code, stride, sides, columns, ends, np.inf, whole, signals)
        upper[first : first + count] = signals[0, 0, :count]
    return -1
