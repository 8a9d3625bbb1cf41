"""Bounds on the information gain are not below it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, every_node, every_time
from tests.inference.test_scan import LEVELS, box_ranges, operators_of, single_boxes
from tests.inference.twins import chain_priors
from tickwise.inference.counting import log_probability
from tickwise.inference.gains import gain_bound, gain_bounds
from tickwise.inference.kernels import Shape
from tickwise.inference.levels import Levels
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import OPERATORS


def gain(prior, choice, levels=LEVELS):
    lower, upper = choice.box(levels)
    shape = Shape(np.array([0, 1]), np.array([OPERATORS.index(choice.operator)]), np.array([choice.complemented]))
    arrays = prior.arrays(levels.variables)
    logarithm = log_probability(arrays, shape, np.array([choice.times]), lower[None], upper[None])
    return 0.0 if math.isinf(logarithm) else -logarithm / arrays.horizon


def check(prior, node, ticks):
    """The bounds of a node, at all windows and durations of all of its boxes."""
    bounds = gain_bounds(node, gain_bound(prior.arrays(LEVELS.variables), LEVELS), ticks)
    for box in every_node(node):
        lower, upper = tuple(box[2:4].tolist()), tuple(box[6:8].tolist())
        for operator in operators_of(node[0] == 1):
            for start, end, duration in every_time(((0, ticks - 1),), operator):
                found = gain(prior, Choice(operator, bool(node[1]), (start, end, duration), lower, upper))
                assert bounds[end - start, duration] >= found - 1e-12


ranges = st.tuples(
    st.sampled_from((-1.0, -0.5, 0.0, 0.75)), st.sampled_from((1.25, 2.0, 3.5, 7.0))
)  # a range may leave levels out, and end at a level


@settings(max_examples=25)
@given(x=ranges, y=ranges, box=single_boxes(), pair=st.tuples(st.booleans(), st.booleans()), horizon=st.integers(3, 9))
def test_independent_ticks(x, y, box, pair, horizon):
    node = np.array([*pair, *box[0], *box[0], *box[1], *box[1]], dtype=np.int64)
    check(BoxPrior({"y": y, "x": x}, horizon), node, min(horizon, 7) + 1)


@settings(max_examples=15)
@given(x=ranges, y=ranges, node=box_ranges(), horizon=st.integers(2, 4))
def test_independent_ticks_and_a_range_of_boxes(x, y, node, horizon):
    check(BoxPrior({"y": y, "x": x}, horizon), node, 4)  # windows may reach beyond the prior's horizon


@settings(max_examples=25)
@given(prior=chain_priors(), box=single_boxes(), pair=st.tuples(st.booleans(), st.booleans()))
def test_paths(prior, box, pair):
    node = np.array([*pair, *box[0], *box[0], *box[1], *box[1]], dtype=np.int64)
    check(prior[0], node, prior[0].horizon + 1)


@pytest.mark.parametrize("existential", [True, False])
def test_the_bound_of_a_single_box_is_close_to_its_gain(existential):
    """◇ and a □ of a power of two of ticks are exact: P = 1 - (1 - p)^n and P = p^n."""
    prior, levels = BoxPrior({"x": (0.0, 4.0)}, 10), Levels(("x",), (np.array([0.0, 1.0, 4.0]),), True, np.ones(1))
    node = np.array([existential, False, 0, 0, 1, 1])
    bounds = gain_bounds(node, gain_bound(prior.arrays(("x",)), levels), 8)
    p = 0.25**4 if not existential else 1 - 0.75**4
    assert bounds[3, 0] == pytest.approx(-math.log(p) / 10)
    assert bounds[3, 0] == pytest.approx(
        gain(prior, Choice(operators_of(existential)[0], False, (0, 3, 0), (0,), (1,)), levels)
    )
