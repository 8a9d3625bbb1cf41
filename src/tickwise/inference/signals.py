"""Compiled kernels of the exact search: the ticks at which a predicate of coded trajectories holds, as bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit, trailing_zeros
from tickwise.inference.levels import WORD, Coded


@njit
def next_tick(row: NDArray[np.uint64], tick: int, flip: np.uint64) -> int:
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
    coded: Coded, i: int, existential: bool, complemented: bool, sides: NDArray[np.int64], row: NDArray[np.uint64]
) -> None:
    """The ticks of a trajectory at which a predicate holds, or for □ and □◇ is violated.

    What comes after its last tick is UNKNOWN: there ◇ may still be satisfied, and □ is not violated (the weak view).

    Args:
        coded: The trajectories.
        i: Which one.
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
            bits = coded.alive[i, word]
            for variable in range(width):
                bits &= coded.at_least[variable, sides[variable], i, word]
                bits &= coded.at_most[variable, sides[width + variable], i, word]
        if existential == complemented:
            bits = ~bits if existential else coded.alive[i, word] & ~bits
        elif existential:
            bits |= ~coded.alive[i, word]
        row[word] = bits


@njit
def signature(
    coded: Coded, existential: bool, complemented: bool, sides: NDArray[np.int64], times: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each trajectory satisfies a primitive, by the weak view, shape ``(n,)``."""
    row = np.empty(coded.alive.shape[1], dtype=np.uint64)
    result = np.empty(len(coded.positive), dtype=np.bool_)
    for i in range(len(result)):
        signal(coded, i, existential, complemented, sides, row)
        result[i] = _begins(row, times) == existential
    return result


@njit
def weigh(
    coded: Coded, existential: bool, complemented: bool, sides: NDArray[np.int64], times: NDArray[np.int64]
) -> float:
    """The weight of the trajectories that a primitive classifies rightly."""
    row = np.empty(coded.alive.shape[1], dtype=np.uint64)
    right = 0.0
    for i in range(len(coded.positive)):
        signal(coded, i, existential, complemented, sides, row)
        if (_begins(row, times) == existential) == coded.positive[i]:
            right += coded.weights[i]
    return right


@njit
def _begins(row: NDArray[np.uint64], times: NDArray[np.int64]) -> bool:
    """Whether a run of duration + 1 ticks begins in the window; the row has bits for all its ticks."""
    tick, last, duration = times[0], times[1], times[2]
    while tick <= last:
        tick = next_tick(row, tick, np.uint64(0))
        if tick > last:
            return False
        end = next_tick(row, tick, ~np.uint64(0))
        if end - tick > duration:
            return True
        tick = end + 1
    return False
