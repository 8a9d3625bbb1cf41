"""Short numbers between two others."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tickwise.inference.decimals import shortest_between

tenths = st.integers(0, 4).flatmap(lambda places: st.integers(-(10**6), 10**6).map(lambda whole: whole / 10**places))
numbers = st.one_of(st.floats(-1e6, 1e6, allow_subnormal=False), tenths)


def decimals_of(number: float) -> int:
    return max(-Decimal(repr(number)).normalize().as_tuple().exponent, 0)


@settings(max_examples=500)
@given(numbers, numbers)
def test_it_lies_strictly_between_and_is_short(one, other):
    assume(one != other)
    low, high = sorted((one, other))
    found = shortest_between(low, high)
    if math.nextafter(low, high) == high:
        assert found == high
        return
    assert low < found < high
    assume(high - low > 1e-9)
    decimals = decimals_of(found)
    if decimals > 0:  # there is none with one decimal less
        unit = 10 ** (decimals - 1)
        for whole in range(math.floor(low * unit) - 1, math.ceil(high * unit) + 2):
            assert not low < whole / unit < high
    middle = low / 2 + high / 2
    other_ones = (round(found * 10**decimals) + step for step in (-1, 1))
    if decimals > 0:  # of these it is the nearest to the middle
        assert all(abs(found - middle) <= abs(one / 10**decimals - middle) + 1e-12 for one in other_ones)


@given(st.integers(-50, 50), st.integers(1, 60))
def test_of_whole_numbers_one_near_the_middle(low, width):
    found = shortest_between(float(low), float(low + width))
    assert abs(found - (low + width / 2)) <= max(width / 4, 0.5)


@pytest.mark.parametrize(
    ("low", "high", "found"),
    [
        (0.0, 1.0, 0.5), (1.0, 2.0, 1.5), (0.12, 0.19, 0.15), (0.1234, 0.1239, 0.1236), (3.0, 3.5, 3.2),
        (14.0, 27.0, 20.0), (180.0, 420.0, 300.0), (-0.3, 0.4, 0.0), (-27.0, -14.0, -20.0), (0.0, 3.0, 2.0),
        (-math.inf, math.inf, 0.0), (-math.inf, 8.0, 4.0), (8.0, math.inf, 10.0), (-math.inf, 0.0, -0.5),
        (1.0, math.nextafter(1.0, 2.0), math.nextafter(1.0, 2.0)), (0.0, 5e-324, 5e-324),
    ],
)  # fmt: skip
def test_by_hand(low, high, found):
    assert shortest_between(low, high) == found
