"""Slow, obvious twins of the vectorised semantics: recursion over one trajectory in pure Python."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tickwise.logic.syntax import Always, And, Box, Constant, Eventually, Formula, Not, Or

State = dict[str, float]


def verdict_twin(node: Formula, states: Sequence[State], tick: int = 0) -> int:
    """1, 0 or -1 at a tick, by Kleene's rules; a predicate past the end is unknown."""
    match node:
        case Constant(value):
            return 1 if value else -1
        case Box(bounds):
            if tick >= len(states):
                return 0
            for bound in bounds:
                value = states[tick][bound.variable]
                above = value > bound.lower or (value == bound.lower and not bound.lower_strict)
                below = value < bound.upper or (value == bound.upper and not bound.upper_strict)
                if not (above and below):
                    return -1
            return 1
        case Not(operand):
            return -verdict_twin(operand, states, tick)
        case And(operands):
            return min(verdict_twin(child, states, tick) for child in operands)
        case Or(operands):
            return max(verdict_twin(child, states, tick) for child in operands)
        case Eventually(interval, operand):
            ticks = range(tick + interval.start, tick + interval.end + 1)
            return max(verdict_twin(operand, states, later) for later in ticks)
        case Always(interval, operand):
            ticks = range(tick + interval.start, tick + interval.end + 1)
            return min(verdict_twin(operand, states, later) for later in ticks)
    raise AssertionError(node)


def robustness_twin(node: Formula, states: Sequence[State], tick: int = 0) -> tuple[float, float]:
    """The lower and the upper end of the robustness at a tick."""
    match node:
        case Constant(value):
            return (math.inf, math.inf) if value else (-math.inf, -math.inf)
        case Box(bounds):
            if tick >= len(states):
                return -math.inf, math.inf
            distance = math.inf
            for bound in bounds:
                value = states[tick][bound.variable]
                distance = min(distance, value - bound.lower, bound.upper - value)
            return distance, distance
        case Not(operand):
            lower, upper = robustness_twin(operand, states, tick)
            return -upper, -lower
        case And(operands):
            pairs = [robustness_twin(child, states, tick) for child in operands]
            return min(pair[0] for pair in pairs), min(pair[1] for pair in pairs)
        case Or(operands):
            pairs = [robustness_twin(child, states, tick) for child in operands]
            return max(pair[0] for pair in pairs), max(pair[1] for pair in pairs)
        case Eventually(interval, operand) | Always(interval, operand):
            ticks = range(tick + interval.start, tick + interval.end + 1)
            pairs = [robustness_twin(operand, states, later) for later in ticks]
            pick = max if isinstance(node, Eventually) else min
            return pick(pair[0] for pair in pairs), pick(pair[1] for pair in pairs)
    raise AssertionError(node)


def signal_twin(node: Formula, states: NDArray[np.float64]) -> tuple[int, float, float]:
    """The verdict and both ends of the robustness at tick 0 of one trajectory over x, y and z, tick by tick.

    The same as the two above, with the answers of all ticks of a subformula kept, so that long windows can be tried.
    """
    rows = [dict(zip("xyz", row, strict=True)) for row in states.tolist()]

    def answers(node: Formula, count: int) -> list[tuple[int, float, float]]:
        match node:
            case Not(operand):
                return [(-v, -high, -low) for v, low, high in answers(operand, count)]
            case And(operands) | Or(operands):
                pick = min if isinstance(node, And) else max
                signals = zip(*(answers(child, count) for child in operands), strict=True)
                return [tuple(map(pick, *at_tick)) for at_tick in signals]  # type: ignore[misc]
            case Eventually(interval, operand) | Always(interval, operand):
                pick = min if isinstance(node, Always) else max
                signal = answers(operand, count + interval.end)
                windows = [signal[tick + interval.start : tick + interval.end + 1] for tick in range(count)]
                return [tuple(map(pick, zip(*window, strict=True))) for window in windows]  # type: ignore[misc]
        return [(verdict_twin(node, rows, tick), *robustness_twin(node, rows, tick)) for tick in range(count)]

    return answers(node, 1)[0]
