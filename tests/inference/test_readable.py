"""Readable numbers: shorter, and no verdict is another."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_classifier import dips
from tests.inference.worlds import verdicts
from tests.strategies import sdnfs
from tickwise.errors import ConfigurationError
from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.exact import ExactSettings
from tickwise.inference.readable import readable
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, SequentialConjunction, to_sdnf


def ragged(seed: int, ticks: int, count: int, decimals: int) -> LabelledTrajectories:
    """Trajectories of two variables that end at any tick."""
    rng = np.random.default_rng(seed)
    values = rng.uniform(-2, 7, (count, ticks, 2)).round(decimals)
    lengths = rng.integers(1, ticks + 1, count)
    lengths[0] = ticks
    return LabelledTrajectories.from_arrays(
        [row[:length] for row, length in zip(values, lengths, strict=True)], np.resize([1, -1], count), ("x", "y")
    )


def primitives_of(formula: SDNF):
    return [primitive for disjunct in formula.disjuncts for primitive in disjunct.primitives]


def bounds_of(formula: SDNF):
    return [bound for primitive in primitives_of(formula) for bound in primitive.box.bounds]


def check(formula: SDNF, data: LabelledTrajectories, space: SearchSpace) -> SDNF:
    """No primitive's verdict on any trajectory changes, nor what is no side of a continuous variable."""
    found = readable(formula, data, space)
    for old, new in zip(primitives_of(formula), primitives_of(found), strict=True):
        assert (new.operator, new.window, new.duration, new.complemented) == (
            old.operator, old.window, old.duration, old.complemented,
        )  # fmt: skip
        one, two = (SDNF((SequentialConjunction((primitive,)),)) for primitive in (old, new))
        np.testing.assert_array_equal(verdicts(one, data), verdicts(two, data))
    continuous = dict(zip(space.variables, space.continuous, strict=True))
    for old, new in zip(bounds_of(formula), bounds_of(found), strict=True):
        assert old.variable == new.variable
        assert continuous[old.variable] or old == new
        assert math.isinf(old.lower) == math.isinf(new.lower)
        assert math.isinf(old.upper) == math.isinf(new.upper)
    return found


@settings(max_examples=60)
@given(
    formula=sdnfs(most=2, disjuncts=2, longest=3),
    seed=st.integers(0, 2**32 - 1),
    ticks=st.integers(2, 12),
    count=st.integers(2, 12),
    decimals=st.integers(0, 4),
    flags=st.tuples(st.booleans(), st.booleans()),
)
def test_no_verdict_changes(formula, seed, ticks, count, decimals, flags):
    data = ragged(seed, ticks, count, decimals)
    edges = tuple((-2.0, 7.0) if continuous else (-2.0, 0.0, 3.5, 7.0) for continuous in flags)
    space = SearchSpace(("x", "y"), edges, ticks, flags)
    once = check(formula, data, space)
    if not any(flags):
        assert once == formula
    twice = check(once, data, space)
    assert digits(twice) <= digits(once)


def digits(formula: SDNF) -> int:
    """The decimals of all closed sides."""
    sides = [side for bound in bounds_of(formula) for side in (bound.lower, bound.upper) if math.isfinite(side)]
    return sum(decimals(side) for side in sides)


def decimals(number: float) -> int:
    return next(count for count in itertools.count() if round(number, count) == number)


def test_a_side_is_the_shortest_decimal_that_changes_nothing():
    rows = [[[1.234], [1.234]], [[3.456], [0.0]], [[3.512], [0.0]], [[9.0], [9.0]]]
    data = LabelledTrajectories.from_arrays(rows, [1, 1, -1, -1], ("x",))
    space = SearchSpace(("x",), ((0.0, 9.0),), 1, (True,))
    for text, wanted in {
        "F[0,0] (x <= 3.48213)": "F[0,0] (x <= 3.5)",
        "F[0,0] (x <= 2.71828)": "F[0,0] (x <= 2)",
        "G[0,0] !(x <= 2.71828)": "G[0,0] !(x <= 2)",
        "F[0,0] (x >= 3.48213)": "F[0,0] (x >= 3.5)",
        "F[0,0] (1.23 < x < 3.512)": "F[0,0] (1 <= x <= 3.5)",
    }.items():
        assert str(readable(to_sdnf(parse(text)), data, space)) == str(to_sdnf(parse(wanted)))


def test_ranges_end_where_the_space_does():
    data = LabelledTrajectories.from_arrays([[[4.0], [4.0]], [[5.0], [5.0]]], [1, -1], ("x",))
    space = SearchSpace(("x",), ((3.9, 5.1),), 1, (True,))
    found = readable(to_sdnf(parse("F[0,1] (3.91 <= x <= 5.09)")), data, space)
    (bound,) = bounds_of(found)
    assert 3.9 <= bound.lower <= 4
    assert 5 <= bound.upper <= 5.1


@pytest.mark.parametrize("search", ["exact", "joint", "swarm"])
def test_a_classifier_gives_readable_numbers(search):
    X, y = dips()
    swarm = SwarmSettings(particles=30, iterations=40, restarts=1, stall=10)
    model = MITLClassifier(variables=("x", "y"), swarm=swarm, depth=1, search=search, limits=ExactSettings(levels=8))
    model.fit(X, y)
    assert model.score(X, y) >= 0.95
    assert model.satisfying_
    assert (model.tree_ is None) == (search == "joint")
    assert all(len(f"{side:g}") <= 5 for b in bounds_of(model.formula_) for side in (b.lower, b.upper))
    assert max(decimals(side) for b in bounds_of(model.formula_) for side in (b.lower, b.upper) if side < math.inf) <= 2


@pytest.mark.parametrize("search", ["Exact", "", None, 3])
def test_a_search_that_is_unknown(search):
    X, y = dips(n=8)
    with pytest.raises(ConfigurationError, match=r"^search is [^\n]+; use 'exact', 'joint', 'swarm'$"):
        MITLClassifier(search=search).fit(X, y)
