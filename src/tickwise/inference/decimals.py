"""Numbers that people like to read: the shortest decimal between two others."""

from __future__ import annotations

import math
from decimal import Decimal

_MOST_DIGITS = 17  # of a float64, all of which round trip


def shortest_between(low: float, high: float) -> float:
    """The number with the fewest decimals strictly between two numbers, of those the one nearest to their middle.

    A whole number is rounded further, to tens and so on, only where it stays in the middle half.

    Args:
        low: The lower number.
        high: The upper number, greater than ``low``; either may be infinite.

    Returns:
        Such a number; the midpoint (or ``high`` where not even that lies between) if the two are neighbours at any
        number of decimals.
    """
    if math.isinf(low) and math.isinf(high):
        return 0.0
    if math.isinf(low):
        return shortest_between(high - max(abs(high), 1.0), high)
    if math.isinf(high):
        return shortest_between(low, low + max(abs(low), 1.0))
    middle = low / 2 + high / 2
    first = -math.ceil(math.log10(high - low)) if high - low > 0 else 0
    for decimals in range(first - 1, first + _MOST_DIGITS + 1):
        nearest = round(middle, decimals)
        if decimals < 0 and abs(nearest - middle) > (high - low) / 4:
            continue
        if low < nearest < high:
            return nearest + 0.0
    return middle if low < middle < high else high


def decimals(number: float) -> int:
    """How many decimals a finite number is printed with."""
    exponent = Decimal(repr(float(number))).normalize().as_tuple().exponent
    return max(-int(exponent), 0)
