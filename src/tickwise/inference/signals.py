"""Compiled kernels of the exact search: the ticks at which a predicate of coded trajectories holds, as bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit, trailing_zeros
from tickwise.inference.levels import WORD, Coded


@njit
def next_bit(row: NDArray[np.uint64], tick: int, flip: np.uint64) -> int:
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
def signal(
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
def signature(
    coded: Coded, existential: bool, complemented: bool, sides: NDArray[np.int64], times: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each trajectory satisfies a primitive, by the weak view, shape ``(n,)``."""
    at_least, at_most, alive, labels, _ = coded
    row = np.empty(alive.shape[1], dtype=np.uint64)
    result = np.empty(len(labels), dtype=np.bool_)
    for i in range(len(result)):
        signal(at_least, at_most, alive, i, existential, complemented, sides, row)
        result[i] = run_begins(row, times) == existential
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
        signal(at_least, at_most, alive, i, existential, complemented, sides, row)
        if (run_begins(row, times) == existential) == labels[i]:
            right += weights[i]
    return right


@njit
def run_begins(row: NDArray[np.uint64], times: NDArray[np.int64]) -> bool:
    """Whether a run of duration + 1 ticks begins in the window; the row has bits for all its ticks."""
    tick, last, duration = times[0], times[1], times[2]
    while tick <= last:
        tick = next_bit(row, tick, np.uint64(0))
        if tick > last:
            return False
        end = next_bit(row, tick, ~np.uint64(0))
        if end - tick > duration:
            return True
        tick = end + 1
    return False
