from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from hypothesis import given

from tests.strategies import formulas
from tickwise.errors import FormulaError
from tickwise.logic.syntax import (
    Always,
    And,
    Bound,
    Box,
    Constant,
    Eventually,
    Formula,
    Interval,
    Not,
    Or,
    Verdict,
)

IN_X = Box.of(x=(3, 4))
IN_Y = Box.of(y=(3, 5))


def test_verdicts_are_kleene_numbers() -> None:
    assert [int(verdict) for verdict in (Verdict.FALSE, Verdict.UNKNOWN, Verdict.TRUE)] == [-1, 0, 1]


@pytest.mark.parametrize(
    ("start", "end", "message"),
    [
        (-1, 3, "interval [-1,3] starts before tick 0; use a start of 0 or more"),
        (9, 3, "interval [9,3] is reversed; write [3,9]"),
        (0.5, 3, "interval bound 0.5 is not a whole number of ticks; round it"),
        (0, True, "interval bound True is not a whole number of ticks; round it"),
    ],
)
def test_bad_interval(start: int, end: int, message: str) -> None:
    with pytest.raises(FormulaError) as caught:
        Interval(start, end)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("bound", "message"),
    [
        (("x", math.nan, 1.0), "a bound of 'x' is NaN; use a number"),
        (("x", 2.0, 1.0), "the range of 'x' is empty: 2 > 1; swap the bounds"),
        (("x", 1.0, 1.0, True, False), "the range of 'x' is empty: both bounds are 1; use <= or >="),
        (("x",), "the range of 'x' has no bound; leave the variable out"),
    ],
)
def test_bad_bound(bound: tuple[str, float, float], message: str) -> None:
    with pytest.raises(FormulaError) as caught:
        Bound(*bound)
    assert str(caught.value) == message


def test_an_infinite_side_has_one_form() -> None:
    assert Bound("x", lower=3.0, upper_strict=True) == Bound("x", lower=3.0)


def test_bad_box_and_bad_connectives() -> None:
    with pytest.raises(FormulaError, match="a box needs at least one bounded variable"):
        Box(())
    with pytest.raises(FormulaError, match="a box bounds a variable twice: x, x"):
        Box((Bound("x", lower=1.0), Bound("x", upper=2.0)))
    for connective in (And, Or):
        with pytest.raises(FormulaError, match="at least two operands"):
            connective((IN_X,))


def test_operators_build_nodes() -> None:
    assert And((IN_X, IN_Y)) == (IN_X & IN_Y)
    assert Or((IN_X, IN_Y)) == (IN_X | IN_Y)
    assert Not(IN_X) == ~IN_X
    assert ~~IN_X == IN_X


def test_variables_are_in_order_of_appearance() -> None:
    phi = Always(Interval(0, 1), Box.of(z=(0, 1), x=(0, 1))) & Not(Box.of(y=(0, 1), z=(1, 2)))
    assert phi.variables == ("z", "x", "y")
    assert Constant(True).variables == ()


def test_effect_times_follow_definition_4() -> None:
    reach = Eventually(Interval(1, 15), Always(Interval(0, 4), IN_X))
    then = Eventually(Interval(21, 39), IN_Y)
    assert (reach.start_effect, reach.end_effect) == (1, 19)
    assert ((reach & then).start_effect, (reach & then).end_effect) == (1, 39)
    assert (Not(then).start_effect, Not(then).end_effect) == (21, 39)
    assert (IN_X.start_effect, IN_X.end_effect) == (0, 0)


def test_centroid_closes_open_sides_with_the_limits() -> None:
    box = Box((Bound("x", lower=3.0), Bound("y", 1.0, 2.0)))
    centre = box.centroid(("y", "x", "z"), ((0, 9), (0, 9), (4, 6)))
    assert np.array_equal(centre, [1.5, 6.0, 5.0])


@given(formulas())
def test_nodes_are_values(phi: Formula) -> None:
    twin = copy.deepcopy(phi)
    assert twin == phi
    assert hash(twin) == hash(phi)
