"""Kernels for verdicts: signals as bits, many ticks of one trajectory in a word, and many trajectories in a row.

Each value of a trajectory, in the order of memory, is compared with its side of a box and gives one bit, so a tick
takes as many bits as there are variables (the stride) and its first one says whether all of them are inside. Bits
between those of the ticks, and past those asked for, mean nothing. Windows grow by doubling: O(log width) shifts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.logic.program import BOTH, CONSTANT, EITHER, EVERY, LITERAL, SOME

Words = NDArray[np.uint64]
U = np.uint64
NONE, ALL = U(0), U(0xFFFF_FFFF_FFFF_FFFF)
LANES = 256  # trajectories at a time: the signals of a block stay in the processor's cache
WORDS = 4096
MOVE = -1


@njit
def words_of(bits: int) -> int:
    """How many words hold so many bits."""
    return (bits + 63) // 64


@njit
def has_nan(rows: NDArray[np.float64], row: int, count: int) -> bool:
    """Whether one of the first values of a row is NaN."""
    bad = False
    i = U(row)  # an unsigned index is not checked for being negative, so that the loop becomes vector code
    for k in range(count):
        bad |= rows[i, k] != rows[i, k]
    return bad


@njit
def encode(
    rows: NDArray[np.float64],
    first: int,
    count: int,
    stride: int,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    codes: Words,
) -> None:
    """Say for each tick of some trajectories which boxes the state is in.

    Args:
        rows: The values of each trajectory in a row, shape (n, at least ticks * stride).
        first: The first trajectory.
        count: The number of trajectories.
        stride: The number of variables, the bits of a tick.
        lower: The least values inside, shape (boxes, ticks * stride).
        upper: The greatest values inside.
        codes: Takes the answers, shape (boxes, words, at least count).
    """
    boxes, values = lower.shape
    words = words_of(values)
    for lane in range(count):
        row = U(first + lane)
        for box in range(boxes):
            for w in range(words):
                word = NONE
                for k in range(min(64, values - 64 * w)):
                    value = rows[row, 64 * w + k]
                    word |= U((value >= lower[box, 64 * w + k]) & (value <= upper[box, 64 * w + k])) << U(k)
                codes[box, w, lane] = word
    for box in range(boxes):
        grow(codes, box, EVERY, stride, 1, words, count)


@njit
def shift(signals: Words, slot: int, how: int, bits: int, words: int, count: int) -> None:
    """Combine a signal with itself some bits later: by minimum (EVERY), by maximum (SOME), or by replacement."""
    far, near = bits // 64, U(bits % 64)
    for w in range(words - far):
        source = w + far
        alone = near == NONE or source + 1 == words
        after, keep = (source, NONE) if alone else (source + 1, ALL)
        rest = U(63) & (U(64) - near)
        for lane in range(count):
            later = (signals[slot, source, lane] >> near) | ((signals[slot, after, lane] << rest) & keep)
            if how == EVERY:
                signals[slot, w, lane] &= later
            elif how == SOME:
                signals[slot, w, lane] |= later
            else:
                signals[slot, w, lane] = later


@njit
def grow(signals: Words, slot: int, how: int, width: int, stride: int, words: int, count: int) -> None:
    """Replace a signal by the minima or maxima of the windows of so many ticks that start at each tick."""
    covered = 1
    while 2 * covered <= width:
        shift(signals, slot, how, covered * stride, words, count)
        covered *= 2
    if covered < width:
        shift(signals, slot, how, (width - covered) * stride, words, count)


@njit
def below(bits: int) -> np.uint64:
    """The word whose first so many bits are set."""
    return ALL if bits >= 64 else (U(1) << U(max(bits, 0))) - U(1)


@njit
def one_window(
    signals: Words, slot: int, how: int, start: int, width: int, stride: int, pattern: Words, count: int
) -> None:
    """Replace a signal by the minimum or maximum of one window, as the first bit of its first word."""
    begin, end = start * stride, (start + width - 1) * stride + 1
    low = begin // 64
    flip = ALL if how == EVERY else NONE
    for w in range(low, words_of(end)):
        mask = pattern[w] & below(end - 64 * w) & ~below(begin - 64 * w)
        so_far = ALL if w > low else NONE
        for lane in range(count):
            found = (signals[slot, w, lane] ^ flip) & mask
            signals[slot, 0, lane] = found | (signals[slot, 0, lane] & so_far)
    for lane in range(count):
        signals[slot, 0, lane] = U((signals[slot, 0, lane] != NONE) != (how == EVERY))


@njit
def load(
    signals: Words,
    slot: int,
    codes: Words,
    box: int,
    complemented: bool,
    words: int,
    valid: NDArray[np.int64],
    fill: np.uint64,
    whole: bool,
    count: int,
) -> None:
    """Push the signal of a box or its complement, with the filling where a trajectory has ended."""
    flip = ALL if complemented else NONE
    known = min(words, codes.shape[1])
    for w in range(known):
        if whole:
            for lane in range(count):
                signals[slot, w, lane] = codes[box, w, lane] ^ flip
        else:
            for lane in range(count):
                mask = below(valid[lane] - 64 * w)
                signals[slot, w, lane] = ((codes[box, w, lane] ^ flip) & mask) | (fill & ~mask)
    for w in range(known, words):
        signals[slot, w, :count] = fill


@njit
def evaluate(
    code: NDArray[np.int64],
    stride: int,
    pattern: Words,
    codes: Words,
    valid: NDArray[np.int64],
    fill: np.uint64,
    whole: bool,
    signals: Words,
    count: int,
) -> None:
    """Run a program on encoded trajectories; the first bit of ``signals[0, 0]`` is the answer.

    Args:
        code: The program.
        stride: The bits of a tick.
        pattern: The first bit of every tick, shape (words,).
        codes: From `encode`, shape (boxes, words, at least count).
        valid: The bits that come from data, shape (at least count,).
        fill: What unknown predicates are taken for: no bits or all.
        whole: Whether no trajectory ends within the horizon.
        signals: The stack, shape (depth, words, at least count).
        count: The number of trajectories.
    """
    top = -1
    for i in range(len(code)):
        operation, first, second, ticks = code[i]
        words = words_of(ticks * stride)
        if operation == LITERAL:
            top += 1
            load(signals, top, codes, first, second == 1, words, valid, fill, whole, count)
        elif operation == CONSTANT:
            top += 1
            signals[top, :words, :count] = ALL if first else NONE
        elif operation in (BOTH, EITHER):
            top -= 1
            for w in range(words):
                for lane in range(count):
                    if operation == BOTH:
                        signals[top, w, lane] &= signals[top + 1, w, lane]
                    else:
                        signals[top, w, lane] |= signals[top + 1, w, lane]
        elif ticks == 1:
            one_window(signals, top, operation, first, second, stride, pattern, count)
        else:
            words = words_of((ticks + first + second - 1) * stride)
            if first > 0:
                shift(signals, top, MOVE, first * stride, words, count)
                words = words_of((ticks + second - 1) * stride)
            grow(signals, top, operation, second, stride, words, count)


@njit
def verdicts(
    rows: NDArray[np.float64],
    lengths: NDArray[np.int64],
    stride: int,
    horizon: int,
    code: NDArray[np.int64],
    pattern: Words,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    depth: int,
    answers: NDArray[np.int8],
) -> int:
    """The verdicts of a program on trajectories, a block at a time.

    Args:
        rows: The values of each trajectory in a row, shape (n, ticks * variables).
        lengths: The number of states of each trajectory, shape (n,).
        stride: The number of variables, at least 1.
        horizon: The formula's end-effect time.
        code: The program.
        pattern: The first bit of every tick, shape (words,).
        lower: The least values inside each box, shape (boxes, values).
        upper: The greatest ones.
        depth: The most signals on the stack.
        answers: Takes 1, 0 or -1 for each trajectory, shape (n,).

    Returns:
        A trajectory that has NaN within its length, where the work stopped; or -1.
    """
    lanes = max(8, min(LANES, WORDS // len(pattern), len(rows)))
    codes = np.empty((len(lower), words_of(lower.shape[1]), lanes), dtype=np.uint64)
    signals = np.empty((depth, len(pattern), lanes), dtype=np.uint64)
    valid = np.empty(lanes, dtype=np.int64)
    for first in range(0, len(rows), lanes):
        count = min(lanes, len(rows) - first)
        shortest = horizon + 1
        for lane in range(count):
            length = lengths[first + lane]
            if has_nan(rows, first + lane, min(length * stride, rows.shape[1])):
                return first + lane
            shortest = min(shortest, length)
            valid[lane] = length * stride
        encode(rows, first, count, stride, lower, upper, codes)
        whole = shortest > horizon
        evaluate(code, stride, pattern, codes, valid, NONE, whole, signals, count)
        for lane in range(count):
            answers[first + lane] = 2 * np.int8(signals[0, 0, lane] & U(1)) - 1
        if not whole:
            evaluate(code, stride, pattern, codes, valid, ALL, whole, signals, count)
            for lane in range(count):
                possible = np.int8(signals[0, 0, lane] & U(1))
                answers[first + lane] = (answers[first + lane] + 1) // 2 + possible - 1
    return -1
