"""Kernels for verdicts: signals as bits, many ticks of one trajectory in a word, and many trajectories in a row.

Each value of a trajectory, in the order of memory, is compared with its side of a box and gives one bit, so a tick
takes as many bits as there are variables (the stride) and its first one says whether all of them are inside. Bits
between those of the ticks, and past those asked for, mean nothing. Windows grow by doubling: O(log width) shifts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.logic.program import BOTH, CONSTANT, EITHER, EVERY, INSIDE, OUTSIDE, ROUND

Words = NDArray[np.uint64]
U = np.uint64
NONE, ALL = U(0), U(0xFFFF_FFFF_FFFF_FFFF)
BITS = U(1) << np.arange(64, dtype=np.uint64)
LANES = 256
"""The most trajectories of a block."""

WORDS = 4096
"""The most words of a block's signal, so that all of its signals stay in the processor's cache."""


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
    spans: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    codes: Words,
) -> None:
    """Say for each tick of some trajectories which boxes the state is in.

    Args:
        rows: The values of each trajectory in a row, shape (n, ticks * stride).
        first: The first trajectory.
        count: The number of trajectories.
        stride: The number of variables, the bits of a tick.
        spans: The first tick of each box and how many, shape (boxes, 2).
        lower: The least values inside, shape (boxes, values).
        upper: The greatest values inside.
        codes: Takes the answers, shape (boxes, words, at least count); the first bit is that of a span's first tick.
    """
    for box in range(len(spans)):
        begin = spans[box, 0] * stride
        values = spans[box, 1] * stride
        values = min((values + ROUND - 1) // ROUND * ROUND, rows.shape[1] - begin)
        for lane in range(count):
            row = U(first + lane)
            for w in range(words_of(values)):
                column, word = U(begin + 64 * w), NONE
                for k in range(min(64, values - 64 * w)):
                    value = rows[row, column + U(k)]
                    within = (value >= lower[box, 64 * w + k]) & (value <= upper[box, 64 * w + k])
                    word |= BITS[k] if within else NONE
                codes[box, w, lane] = word
        grow(codes, box, EVERY, stride, 1, words_of(values), count)


@njit
def next_word(w: int, near: np.uint64, words: int) -> tuple[int, np.uint64]:
    """Where the bits that a shift moves into a word come from, and a mask of none where there are none."""
    if near == NONE or w + 1 == words:
        return w, NONE
    return w + 1, ALL


@njit
def shift(signals: Words, slot: int, how: int, bits: int, words: int, count: int) -> None:
    """Replace a signal by the minimum or maximum of it and itself some bits later."""
    far, near = bits // 64, U(bits % 64)
    for w in range(words - far):
        source = w + far
        after, keep = next_word(source, near, words)
        rest = U(63) & (U(64) - near)
        for lane in range(count):
            later = (signals[slot, source, lane] >> near) | ((signals[slot, after, lane] << rest) & keep)
            if how == EVERY:
                signals[slot, w, lane] &= later
            else:
                signals[slot, w, lane] |= later


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
def one_window(signals: Words, slot: int, how: int, width: int, stride: int, pattern: Words, count: int) -> None:
    """Replace a signal by the minimum or maximum of one window, as the first bit of its first word."""
    end = (width - 1) * stride + 1
    flip = ALL if how == EVERY else NONE
    for w in range(words_of(end)):
        mask = pattern[w] & below(end - 64 * w)
        so_far = ALL if w > 0 else NONE
        for lane in range(count):
            found = (signals[slot, w, lane] ^ flip) & mask
            signals[slot, 0, lane] = found | (signals[slot, 0, lane] & so_far)
    for lane in range(count):
        signals[slot, 0, lane] = U((signals[slot, 0, lane] != NONE) != (how == EVERY))


@njit
def load(signals: Words, slot: int, codes: Words, box: int, bits: int, flip: np.uint64, words: int, count: int) -> None:
    """Push the signal of a box from a bit of its codes on, flipped or not; what lies past the codes means nothing."""
    far, near = bits // 64, U(bits % 64)
    have = codes.shape[1]
    for w in range(min(words, have - far)):
        source = w + far
        after, keep = next_word(source, near, have)
        rest = U(63) & (U(64) - near)
        for lane in range(count):
            later = (codes[box, source, lane] >> near) | ((codes[box, after, lane] << rest) & keep)
            signals[slot, w, lane] = later ^ flip


@njit
def cut(
    signals: Words, slot: int, ends: NDArray[np.int64], begin: int, fill: np.uint64, words: int, count: int
) -> None:
    """Put the filling where a trajectory has ended; `ends` and `begin` are in bits."""
    for w in range(words):
        for lane in range(count):
            mask = below(ends[lane] - begin - 64 * w)
            signals[slot, w, lane] = (signals[slot, w, lane] & mask) | (fill & ~mask)


@njit
def evaluate(
    code: NDArray[np.int64],
    stride: int,
    pattern: Words,
    spans: NDArray[np.int64],
    codes: Words,
    ends: NDArray[np.int64],
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
        spans: The first tick of each box in the codes, and how many, shape (boxes, 2).
        codes: From `encode`, shape (boxes, words, at least count).
        ends: The bits of each trajectory, shape (at least count,).
        fill: What unknown predicates are taken for: no bits or all.
        whole: Whether no trajectory ends within the horizon.
        signals: The stack, shape (depth, words, at least count).
        count: The number of trajectories.
    """
    top = -1
    for i in range(len(code)):
        operation, first, second, ticks = code[i]
        words = words_of(ticks * stride)
        if operation in (INSIDE, OUTSIDE):
            top += 1
            later = (second - spans[first, 0]) * stride
            load(signals, top, codes, first, later, ALL if operation == OUTSIDE else NONE, words, count)
            if not whole:
                cut(signals, top, ends, second * stride, fill, words, count)
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
            one_window(signals, top, operation, first, stride, pattern, count)
        else:
            grow(signals, top, operation, first, stride, words_of((ticks + first - 1) * stride), count)


@njit
def verdicts(
    rows: NDArray[np.float64],
    lengths: NDArray[np.int64],
    answers: NDArray[np.int8],
    stride: int,
    horizon: int,
    code: NDArray[np.int64],
    pattern: Words,
    spans: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    depth: int,
) -> int:
    """The verdicts of a program on trajectories, a block at a time.

    Args:
        rows: The values of each trajectory in a row, shape (n, ticks * variables).
        lengths: The number of states of each trajectory, shape (n,).
        answers: Takes 1, 0 or -1 for each trajectory, shape (n,).
        stride: The number of variables, at least 1.
        horizon: The formula's end-effect time.
        code: The program.
        pattern: The first bit of every tick, shape (words,).
        spans: The first tick of each box, and how many, shape (boxes, 2).
        lower: The least values inside each box, shape (boxes, values).
        upper: The greatest ones.
        depth: The most signals on the stack.

    Returns:
        A trajectory that has NaN within its length, where the work stopped; or -1.
    """
    lanes = max(8, min(LANES, WORDS // len(pattern), len(rows)))
    codes = np.empty((len(lower), words_of(lower.shape[1]), lanes), dtype=np.uint64)
    signals = np.empty((depth, len(pattern), lanes), dtype=np.uint64)
    ends = np.empty(lanes, dtype=np.int64)
    for first in range(0, len(rows), lanes):
        count = min(lanes, len(rows) - first)
        shortest = horizon + 1
        for lane in range(count):
            length = lengths[first + lane]
            if has_nan(rows, first + lane, min(length * stride, rows.shape[1])):
                return first + lane
            shortest = min(shortest, length)
            ends[lane] = length * stride
        encode(rows, first, count, stride, spans, lower, upper, codes)
        whole = shortest > horizon
        evaluate(code, stride, pattern, spans, codes, ends, NONE, whole, signals, count)
        for lane in range(count):
            answers[first + lane] = 2 * np.int8(signals[0, 0, lane] & U(1)) - 1
        if not whole:
            evaluate(code, stride, pattern, spans, codes, ends, ALL, whole, signals, count)
            for lane in range(count):
                possible = np.int8(signals[0, 0, lane] & U(1))
                answers[first + lane] = (answers[first + lane] + 1) // 2 + possible - 1
    return -1
