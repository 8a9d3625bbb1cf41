"""Readable numbers: the shortest decimals that leave every verdict on the data as it was."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.decimals import decimals, shortest_between
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF, Primitive, SequentialConjunction
from tickwise.logic.syntax import Bound, Box, Not

_OTHER = {"lower": "upper", "upper": "lower"}


def readable(formula: SDNF, data: LabelledTrajectories, space: SearchSpace) -> SDNF:
    """The formula with the shortest decimals as sides of its boxes, where they may be any number.

    One side after the other is put where no trajectory changes its verdict on the primitive: between the two values of
    the data next to which one would, or the end of the space. Of the shortest decimals there, the one nearest to the
    middle leaves other trajectories the most room.

    Args:
        formula: A formula.
        data: The trajectories whose verdicts stay.
        space: Which variables are continuous; the others keep their edges.

    Returns:
        The formula, with the same verdict of every primitive on every trajectory.
    """
    ends = zip(space.variables, space.edges, space.continuous, strict=True)
    ranges = {name: (edges[0], edges[-1]) for name, edges, continuous in ends if continuous}
    rows = [
        SequentialConjunction(tuple(_readable(primitive, data, ranges) for primitive in disjunct.primitives))
        for disjunct in formula.disjuncts
    ]
    return SDNF(tuple(rows))


def _readable(primitive: Primitive, data: LabelledTrajectories, ranges: Mapping[str, tuple[float, float]]) -> Primitive:
    verdicts = _verdicts(primitive, data)
    for bound in primitive.box.bounds:
        if bound.variable not in ranges:
            continue
        states = data.values[..., data.variables.index(bound.variable)]
        values = np.unique(states[~np.isnan(states)])
        for side, outward in (("lower", -1), ("upper", 1)):
            number = _side(primitive, bound.variable, side)
            if math.isinf(number):
                continue
            inner, outer = _room(primitive, data, verdicts, (bound.variable, side), values, number)
            low, high = (inner, outer) if outward > 0 else (outer, inner)
            other = _side(primitive, bound.variable, _OTHER[side])
            first, last = ranges[bound.variable]
            low, high = (max(low, other), min(high, last)) if outward > 0 else (max(low, first), min(high, other))
            if low >= high:
                continue
            shortest = shortest_between(low, high)
            if decimals(shortest) <= decimals(number):  # a value of the data itself may be shorter
                primitive = _with_side(primitive, bound.variable, side, shortest)
    return primitive


def _room(
    primitive: Primitive,
    data: LabelledTrajectories,
    verdicts: NDArray[np.int8],
    place: tuple[str, str],
    values: NDArray[np.float64],
    number: float,
) -> tuple[float, float]:
    """The values of the data that a side lies between as long as no verdict changes: the inner and the outer one.

    A box that grows loses no state, so verdicts change one way only, and bisection finds where.
    """
    sign = -1.0 if place[1] == "lower" else 1.0
    ordered = np.sort(sign * values)  # outward
    strict = [_strict(primitive, place[0], side) for side in (place[1], _OTHER[place[1]])]
    at = int(np.searchsorted(ordered, sign * number, side="left" if strict[0] else "right"))  # the values inside

    def same(count: int) -> bool:
        """Whether the verdicts are the same with so many of the values inside."""
        edge = ordered[count - 1] if count else np.nextafter(ordered[0], -np.inf)
        return bool((_verdicts(_with_side(primitive, *place, sign * edge), data) == verdicts).all())

    other, low = _side(primitive, place[0], _OTHER[place[1]]), 0
    if math.isfinite(other):  # beyond it the box is reversed
        low = int(np.searchsorted(ordered, sign * other, side="right" if strict[1] else "left")) + 1
    if low > at:
        return number, number
    least = _first(same, low, at)
    most = len(ordered) - _first(lambda left: same(len(ordered) - left), 0, len(ordered) - at)
    inner = ordered[least - 1] if least else -np.inf
    outer = ordered[most] if most < len(ordered) else np.inf
    return sign * inner, sign * outer


def _first(good: Callable[[int], bool], low: int, high: int) -> int:
    """The first number from low on that is good, where all after it are and high is."""
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if good(middle) else (middle + 1, high)
    return low


def _verdicts(primitive: Primitive, data: LabelledTrajectories) -> NDArray[np.int8]:
    found = primitive.formula.verdict(data.values, variables=data.variables, lengths=data.lengths)
    return np.asarray(found)


def _bound(primitive: Primitive, variable: str) -> Bound:
    return next(bound for bound in primitive.box.bounds if bound.variable == variable)


def _strict(primitive: Primitive, variable: str, side: str) -> bool:
    bound = _bound(primitive, variable)
    return bound.lower_strict if side == "lower" else bound.upper_strict


def _side(primitive: Primitive, variable: str, side: str) -> float:
    bound = _bound(primitive, variable)
    return bound.lower if side == "lower" else bound.upper


def _with_side(primitive: Primitive, variable: str, side: str, number: float) -> Primitive:
    """The primitive with one side of its box elsewhere, and closed."""
    changes: dict[str, Any] = {side: number + 0.0, f"{side}_strict": False}
    bounds = (replace(bound, **changes) if bound.variable == variable else bound for bound in primitive.box.bounds)
    box = Box(tuple(bounds))
    return replace(primitive, predicate=Not(box) if primitive.complemented else box)
