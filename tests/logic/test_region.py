from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from tests.strategies import boxes
from tickwise.logic.region import complement, intersect
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Bound, Box, Not

VARIABLES = ("x", "y")
# every corner, side and inner point of the grid that the boxes' bounds lie on
GRID = np.stack(np.meshgrid(np.arange(-4, 15) / 2, np.arange(-4, 15) / 2), axis=-1).reshape(-1, 2)


@settings(max_examples=300)
@given(boxes(), boxes())
def test_intersection_is_what_both_hold(first: Box, second: Box) -> None:
    both = holds(first, GRID, VARIABLES) & holds(second, GRID, VARIABLES)
    region = intersect(first, second)
    if region is None:
        assert not both.any()
    else:
        assert np.array_equal(holds(region, GRID, VARIABLES), both)


@given(boxes())
def test_complement_is_the_rest(box: Box) -> None:
    rest = complement(box)
    if rest is not None:
        assert np.array_equal(holds(rest, GRID, VARIABLES), holds(Not(box), GRID, VARIABLES))
        assert complement(rest) == box


def test_only_half_spaces_have_a_complement() -> None:
    assert complement(Box.of(x=(3, 4))) is None
    assert complement(Box((Bound("x", lower=3.0), Bound("y", lower=3.0)))) is None
    assert complement(Box((Bound("x", lower=3.0),))) == Box((Bound("x", upper=3.0, upper_strict=True),))


def test_intersections_that_touch() -> None:
    left, right = Box((Bound("x", upper=3.0),)), Box((Bound("x", lower=3.0),))
    open_right = Box((Bound("x", lower=3.0, lower_strict=True),))
    assert intersect(left, right) == Box.of(x=(3, 3))
    assert intersect(left, open_right) is None
    assert intersect(right, open_right) == open_right
