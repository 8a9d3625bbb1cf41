"""A formula as a short program over signals, for the kernels in `bits` and `extrema`.

Negations are pushed down to the boxes, which Kleene's rules and robustness both allow. What is left are minima and
maxima, so that each end of what is unknown can be followed by itself: a formula is certainly true where the program
gives true with all unknown predicates false, and possibly true where it does with all of them true. Likewise the
ends of the robustness come from -inf and inf.

The program runs on a stack of signals. A signal is made for the ticks that are asked of it only: one at the root,
and ``count + end`` below an operator over [start, end].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tickwise.logic.syntax import Always, And, Box, Constant, Eventually, Formula, Not, Or

LITERAL, CONSTANT, BOTH, EITHER, EVERY, SOME = range(6)
"""Push a box or its complement (box, complemented); push true or false (value, -); replace the two topmost signals
by their minimum or maximum (-, -); replace the topmost by the minimum or maximum of its windows (start, width)."""


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """A formula over trajectories of a certain number of ticks.

    Attributes:
        variables: The names of the data's columns.
        boxes: The distinct boxes of the formula.
        ticks: How many of the first ticks of the data matter.
        horizon: The formula's end-effect time: a trajectory with that tick leaves nothing unknown.
        code: An instruction a row: operation, two operands, and the ticks of the resulting signal; int64.
        depth: The most signals on the stack.
        reach: The most ticks of a signal.
        pattern: The signal that is true at every tick, as words with a bit for each variable, of which the first of
            each tick is set; long enough for every signal.
        lower: The least number that is inside of each box for each value of a trajectory, shape (boxes, ticks *
            variables), -inf on open sides; strict sides are moved to the next number.
        upper: The greatest ones.
        sides: Rows (box, column, bound, sign); the distance to a side is sign * (value - bound).
    """

    variables: tuple[str, ...]
    boxes: tuple[Box, ...]
    ticks: int
    horizon: int
    code: NDArray[np.int64]
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


@lru_cache(maxsize=256)
def program(formula: Formula, ticks: int) -> Program:
    """Compile a formula for trajectories of at most so many ticks.

    Args:
        formula: An MITL_f formula.
        ticks: The most ticks of a trajectory, at least 1; those past the formula's horizon change nothing.

    Raises:
        TypeError: If a node is none of this library's.
    """
    writer = _Writer(ticks)
    writer.write(formula, 1, complemented=False)
    horizon, variables, boxes = formula.end_effect, formula.variables, tuple(writer.boxes)
    ticks = min(ticks, horizon + 1)
    reach = max(count for *_, count in writer.code)
    lower, upper = (np.tile(ends, ticks) for ends in _closed(boxes, variables))
    return Program(
        variables=variables,
        boxes=boxes,
        ticks=ticks,
        horizon=horizon,
        code=np.array(writer.code, dtype=np.int64),
        depth=writer.depth,
        reach=reach,
        pattern=_pattern(reach, max(1, len(variables))),
        lower=lower,
        upper=upper,
        sides=_sides(boxes, variables),
    )


class _Writer:
    """Writes the instructions of a formula, operands first."""

    def __init__(self, ticks: int) -> None:
        self.code: list[tuple[int, int, int, int]] = []
        self.boxes: dict[Box, int] = {}
        self.depth = 0
        self._ticks = ticks
        self._height = 0

    def write(self, node: Formula, count: int, *, complemented: bool) -> None:
        """Push a formula's signal, or that of its negation, at ticks 0 to count - 1."""
        match node:
            case Box():
                self._push(LITERAL, self.boxes.setdefault(node, len(self.boxes)), complemented, count)
            case Constant(value):
                self._push(CONSTANT, value != complemented, 0, count)
            case Not(operand):
                self.write(operand, count, complemented=not complemented)
            case And(operands) | Or(operands):
                least = isinstance(node, And) != complemented
                for i, operand in enumerate(operands):
                    self.write(operand, count, complemented=complemented)
                    if i > 0:
                        self._height -= 1
                        self.code.append((BOTH if least else EITHER, 0, 0, count))
            case Eventually(interval, operand) | Always(interval, operand):
                # all ticks past the data are alike, so that windows may be cut there
                start, end = min(interval.start, self._ticks), min(interval.end, self._ticks)
                self.write(operand, count + end, complemented=complemented)
                least = isinstance(node, Always) != complemented
                if end > 0:
                    self.code.append((EVERY if least else SOME, start, end - start + 1, count))
            case _:
                raise TypeError(f"{type(node).__name__} is not a formula node of this library")

    def _push(self, operation: int, first: int, second: int, count: int) -> None:
        self._height += 1
        self.depth = max(self.depth, self._height)
        self.code.append((operation, int(first), int(second), count))


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
