"""A formula as a short program over signals, for the kernels in `bits` and `extrema`.

Negations are pushed down to the boxes, which Kleene's rules and robustness both allow. What is left are minima and
maxima, so that each end of what is unknown can be followed by itself: a formula is certainly true where the program
gives true with all unknown predicates false, and possibly true where it does with all of them true. Likewise the
ends of the robustness come from -inf and inf.

The program runs on a stack of signals. A signal is made for the ticks that are asked of it only: tick 0 at the root,
and ``begin + start`` to ``last + end`` below an operator over [start, end]. So a signal's first number is that of
its first tick asked for, and windows start there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.logic.syntax import Always, And, Box, Constant, Eventually, Formula, Not, Or

INSIDE, OUTSIDE, CONSTANT, BOTH, EITHER, EVERY, SOME = range(7)
"""Push a box or its complement (box, first tick); push true or false (value, -); replace the two topmost signals by
their minimum or maximum (-, -); replace the topmost by the minima or maxima of its windows (width, -)."""

ROUND = 8
"""Comparisons go on to a multiple of this number where the data does: vectors are of that many values."""

FAR = 2**62
"""A horizon beyond all data, however far a formula's own may be."""


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """A formula over trajectories of a certain number of ticks.

    Attributes:
        variables: The names of the data's columns.
        boxes: The distinct boxes of the formula.
        ticks: How many of the first ticks of the data matter.
        horizon: The formula's end-effect time, at most `FAR`: a trajectory with that tick leaves nothing unknown.
        code: An instruction a row: operation, two operands, and the ticks of the resulting signal; int64.
        spans: The first tick of the data at which each box is asked for, and how many ticks, shape (boxes, 2).
        depth: The most signals on the stack.
        reach: The most ticks of a signal.
        pattern: The signal that is true at every tick, as words with a bit for each variable, of which the first of
            each tick is set; long enough for every signal.
        lower: The least number inside of each box for each value of the ticks asked for, shape (boxes, values), -inf
            on open sides; strict sides are moved to the next number.
        upper: The greatest ones.
        sides: Rows (box, column, bound, sign); the distance to a side is sign * (value - bound).
    """

    variables: tuple[str, ...]
    boxes: tuple[Box, ...]
    ticks: int
    horizon: int
    code: NDArray[np.int64]
    spans: NDArray[np.int64]
    depth: int
    reach: int
    pattern: NDArray[np.uint64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    sides: NDArray[np.float64]

    @property
    def stride(self) -> int:
        """The bits that a tick takes."""
        return max(1, len(self.variables))

    @property
    def for_verdicts(self) -> tuple[Any, ...]:
        """What `bits.verdicts` takes of it."""
        return (self.stride, self.horizon, self.code, self.pattern, self.spans, self.lower, self.upper, self.depth)

    @property
    def for_robustness(self) -> tuple[Any, ...]:
        """What `extrema.robustness` takes of it."""
        return (self.stride, self.horizon, self.ticks, self.code, self.sides, self.depth, self.reach)


@lru_cache(maxsize=256)
def variables_of(formula: Formula) -> tuple[str, ...]:
    """A formula's variables, collected once."""
    return formula.variables


@lru_cache(maxsize=256)
def program(formula: Formula, ticks: int) -> Program:
    """Compile a formula for trajectories of at most so many ticks.

    Args:
        formula: An MITL_f formula.
        ticks: The most ticks of a trajectory, at least 1; those past the formula's horizon change nothing.

    Raises:
        TypeError: If a node is none of this library's.
    """
    horizon, variables = formula.end_effect, formula.variables
    writer = _Writer(min(ticks, horizon + 1))
    writer.write(formula, 0, 1, complemented=False)
    boxes, stride = tuple(writer.boxes), max(1, len(variables))
    spans = np.array([(first, end - first) for first, end in writer.boxes.values()], dtype=np.int64).reshape(-1, 2)
    reach = max(count for *_, count in writer.code)
    values = -(-int(spans[:, 1].max(initial=0)) * stride // ROUND) * ROUND
    lower, upper = (np.tile(ends, -(-values // stride))[:, :values].copy() for ends in _closed(boxes, variables))
    return Program(
        variables=variables,
        boxes=boxes,
        ticks=writer.ticks,
        horizon=min(horizon, FAR),
        code=np.array(writer.code, dtype=np.int64),
        spans=spans,
        depth=writer.depth,
        reach=reach,
        pattern=_pattern(reach, stride),
        lower=lower,
        upper=upper,
        sides=_sides(boxes, variables),
    )


class _Writer:
    """Writes the instructions of a formula, operands first."""

    def __init__(self, ticks: int) -> None:
        self.code: list[tuple[int, int, int, int]] = []
        self.boxes: dict[Box, tuple[int, int]] = {}  # with the ticks asked for: the first and the one after the last
        self.depth = 0
        self.ticks = ticks
        self._height = 0

    def write(self, node: Formula, begin: int, count: int, *, complemented: bool) -> None:
        """Push a formula's signal, or that of its negation, at ticks begin to begin + count - 1."""
        match node:
            case Box():
                self._box(node, begin, count, complemented=complemented)
            case Constant(value):
                self._push(CONSTANT, int(value != complemented), 0, count)
            case Not(operand):
                self.write(operand, begin, count, complemented=not complemented)
            case And(operands) | Or(operands):
                operation = BOTH if isinstance(node, And) != complemented else EITHER
                for i, operand in enumerate(operands):
                    self.write(operand, begin, count, complemented=complemented)
                    if i > 0:
                        self._height -= 1
                        self.code.append((operation, 0, 0, count))
            case Eventually(interval, operand) | Always(interval, operand):
                # all ticks past the data are alike, so that windows may be cut there
                start, end = min(interval.start, self.ticks), min(interval.end, self.ticks)
                self.write(operand, min(begin + start, self.ticks), count + end - start, complemented=complemented)
                operation = EVERY if isinstance(node, Always) != complemented else SOME
                if end > start:
                    self.code.append((operation, end - start + 1, 0, count))
            case _:
                raise TypeError(f"{type(node).__name__} is not a formula node of this library")

    def _box(self, box: Box, begin: int, count: int, *, complemented: bool) -> None:
        first, end = self.boxes.get(box, (begin, begin))
        self.boxes[box] = min(first, begin), max(end, min(begin + count, self.ticks))
        which = list(self.boxes).index(box)
        self._push(OUTSIDE if complemented else INSIDE, which, begin, count)

    def _push(self, operation: int, first: int, second: int, count: int) -> None:
        self._height += 1
        self.depth = max(self.depth, self._height)
        self.code.append((operation, first, second, count))


def _pattern(ticks: int, stride: int) -> NDArray[np.uint64]:
    """The first bit of every tick, in whole words."""
    bits = np.zeros(-(-ticks * stride // 64) * 64, dtype=np.bool_)
    bits[: ticks * stride : stride] = True
    return np.packbits(bits, bitorder="little").view("<u8").astype(np.uint64)


def _closed(boxes: tuple[Box, ...], variables: tuple[str, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The ends of equal closed boxes, each of shape (boxes, variables)."""
    lower = np.full((len(boxes), len(variables)), -math.inf)
    upper = -lower
    for row, box in enumerate(boxes):
        for bound in box.bounds:
            column = variables.index(bound.variable)
            lower[row, column] = math.nextafter(bound.lower, math.inf) if bound.lower_strict else bound.lower
            upper[row, column] = math.nextafter(bound.upper, -math.inf) if bound.upper_strict else bound.upper
    return lower, upper


def _sides(boxes: tuple[Box, ...], variables: tuple[str, ...]) -> NDArray[np.float64]:
    """The closed sides of all boxes, box by box."""
    rows = [
        (row, variables.index(bound.variable), number, sign)
        for row, box in enumerate(boxes)
        for bound in box.bounds
        for number, sign in ((bound.lower, 1), (bound.upper, -1))
        if not math.isinf(number)
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)
