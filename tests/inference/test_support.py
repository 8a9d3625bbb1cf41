"""A predicate that can hold for ever makes all of its primitives possible."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, every_time
from tests.inference.test_gains import ranges
from tests.inference.test_scan import LEVELS, single_boxes
from tests.inference.twins import chain_priors
from tickwise.inference.counting import log_probability
from tickwise.inference.kernels import Shape
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import OPERATORS
from tickwise.inference.support import lasting


def possible(prior, choice):
    lower, upper = choice.box(LEVELS)
    shape = Shape(np.array([0, 1]), np.array([OPERATORS.index(choice.operator)]), np.array([choice.complemented]))
    return np.isfinite(log_probability(prior, shape, np.array([choice.times]), lower[None], upper[None]))


@settings(max_examples=60)
@given(prior=chain_priors(), box=single_boxes(), complemented=st.booleans())
def test_paths(prior, box, complemented):
    found, initial, step = prior
    arrays = found.arrays(("x", "y"))
    lower, upper = Choice(OPERATORS[0], complemented, (0, 1, 0), *box).box(LEVELS)
    good = ((arrays.coordinates >= lower) & (arrays.coordinates <= upper)).all(axis=1) != complemented
    # as many steps as there are states come back to one of them
    reached = good & (initial > 0)
    for _ in range(len(step)):
        reached = good & (reached @ (step > 0) > 0)
    assert lasting(arrays, lower, upper, complemented) == reached.any()
    if reached.any():
        for operator in OPERATORS:
            for times in every_time(((0, found.horizon),), operator):
                assert possible(arrays, Choice(operator, complemented, times, *box))


@settings(max_examples=60)
@given(x=ranges, y=ranges, box=single_boxes(), complemented=st.booleans())
def test_independent_ticks(x, y, box, complemented):
    prior = BoxPrior({"x": x, "y": y}, 3).arrays(("x", "y"))
    lower, upper = Choice(OPERATORS[0], complemented, (0, 1, 0), *box).box(LEVELS)
    cells = [
        sorted({*ends, *(side for side in sides if ends[0] < side < ends[1])})
        for ends, sides in zip((x, y), LEVELS.sides, strict=True)
    ]
    centres = itertools.product(*([(a + b) / 2 for a, b in itertools.pairwise(cuts)] for cuts in cells))
    holds = [bool(((point >= lower) & (point <= upper)).all()) != complemented for point in centres]
    assert lasting(prior, lower, upper, complemented) == any(holds)
