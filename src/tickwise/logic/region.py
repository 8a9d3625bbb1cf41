"""Set operations on boxes that give boxes: intersection, and the complement of a half-space."""

from __future__ import annotations

import math

from tickwise.logic.syntax import Bound, Box


def intersect(first: Box, second: Box) -> Box | None:
    """The intersection of two boxes.

    Args:
        first: A box; its variables come first in the result.
        second: Another box, over the same or other variables.

    Returns:
        The box of the points in both, or None where there are none.
    """
    bounds = {bound.variable: bound for bound in first.bounds}
    for bound in second.bounds:
        known = bounds.get(bound.variable)
        merged = bound if known is None else _intersect_ranges(known, bound)
        if merged is None:
            return None
        bounds[bound.variable] = merged
    return Box(tuple(bounds.values()))


def _intersect_ranges(first: Bound, second: Bound) -> Bound | None:
    # at equal numbers the strict side is the narrower one: (number, strict) orders lower sides, and
    # (-number, strict) orders upper sides
    lower, lower_strict = max((first.lower, first.lower_strict), (second.lower, second.lower_strict))
    negated, upper_strict = max((-first.upper, first.upper_strict), (-second.upper, second.upper_strict))
    upper = -negated
    if lower > upper or (lower == upper and (lower_strict or upper_strict)):
        return None
    return Bound(first.variable, lower, upper, lower_strict, upper_strict)


def complement(box: Box) -> Box | None:
    """The complement of a half-space, such as x < 3 for x >= 3.

    Returns:
        The complement, or None where the box has more than one side, so that its complement is no box.
    """
    if len(box.bounds) > 1:
        return None
    bound = box.bounds[0]
    if math.isinf(bound.upper):
        return Box((Bound(bound.variable, upper=bound.lower, upper_strict=not bound.lower_strict),))
    if math.isinf(bound.lower):
        return Box((Bound(bound.variable, lower=bound.upper, lower_strict=not bound.upper_strict),))
    return None
