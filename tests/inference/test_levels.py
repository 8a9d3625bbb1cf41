"""Coded trajectories say what plain comparisons say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_scan import LEVELS, data_sets
from tickwise.errors import ConfigurationError
from tickwise.inference.levels import WORD, Coded, Levels, code, code_parts
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories


def bit(words, tick):
    return bool(int(words[tick // WORD]) >> tick % WORD & 1)


@settings(max_examples=60)
@given(data=st.one_of(data_sets(), data_sets(shortest=62, longest=135, most=3)), more=st.integers(-3, 70))
def test_bits_are_comparisons(data, more):
    states, weights = data
    horizon = max(states.values.shape[1] - 1 + more, 1)  # it may end before the data, or long after it
    coded = code(states, weights, LEVELS, horizon)
    assert coded.alive.shape == (len(states), horizon // WORD + 1)
    np.testing.assert_array_equal(coded.positive, states.labels == 1)
    np.testing.assert_array_equal(coded.weights, weights)
    for i in range(len(states)):
        for tick in range(coded.alive.shape[1] * WORD):
            alive = tick < states.lengths[i] and tick <= horizon
            assert bit(coded.alive[i], tick) == alive
            for column, sides in enumerate(LEVELS.sides):
                for number, side in enumerate(sides):
                    value = states.values[i, tick, column] if alive else math.nan
                    assert bit(coded.at_least[column, number, i], tick) == (value >= side)
                    assert bit(coded.at_most[column, number, i], tick) == (value <= side)


def same(one: Coded, other: Coded) -> bool:
    return all(a.dtype == b.dtype and np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@settings(max_examples=40)
@given(data=data_sets(longest=80), cuts=st.data())
def test_parts_make_the_whole(data, cuts):
    states, weights = data
    where = sorted(cuts.draw(st.sets(st.integers(1, len(states) - 1)))) if len(states) > 1 else []
    rows = np.split(np.arange(len(states)), where)
    parts = (states.select(part) for part in rows)  # one at a time
    assert same(code_parts(parts, LEVELS, 70), code(states, np.ones(len(states)), LEVELS, 70))
    whole = code(states, weights, LEVELS, 70)
    mask = np.arange(len(states)) % 2 == 0
    assert same(whole.select(mask), code(states.select(mask), weights[mask], LEVELS, 70))
    # another layout would be compiled for once more
    assert all(array.flags.c_contiguous for array in whole.select(mask))


def numbers(rows, names=("x",)):
    values = np.array(rows, dtype=float)
    labels = np.resize([1, -1], len(values))
    return LabelledTrajectories.from_arrays(values.reshape(len(values), -1, len(names)), labels, names)


def test_edges_are_levels_as_they_are():
    space = SearchSpace.grid(3, 4, ("x",))
    levels = Levels.of(space, numbers([[0.5, 1.5], [0.5, 2.5]]), 1)
    assert [sides.tolist() for sides in levels.sides] == [[0, 1, 2, 3]]
    assert (levels.complete, levels.resolution.tolist()) == (True, [1.0])


@settings(max_examples=100)
@given(seed=st.integers(0, 2**32 - 1), cap=st.integers(1, 40), kinds=st.integers(1, 60))
def test_continuous_levels_lie_between_neighbouring_values(seed, cap, kinds):
    rng = np.random.default_rng(seed)
    choices = rng.normal(size=kinds) * 10.0 ** rng.integers(-3, 4)
    data = numbers(rng.choice(choices, (9, 8)))
    levels = Levels.of(SearchSpace.from_data(data), data, cap)
    values = np.unique(data.values)
    (sides,) = levels.sides
    assert (sides[0], sides[-1]) == (-math.inf, math.inf)
    cuts = sides[1:-1]
    assert (np.diff(cuts) > 0).all()
    assert levels.complete == (len(values) - 1 <= len(cuts) and len(values) > 0)
    if len(values) == 1:
        assert len(cuts) == 2  # the range of the space, so that there is a box
        return
    assert 1 <= len(cuts) <= max(cap, 1)
    assert levels.complete or len(cuts) < len(values) - 1
    places = np.searchsorted(values, cuts)
    assert len(set(places)) == len(cuts)
    assert ((values[places - 1] < cuts) & (cuts < values[places])).all()
    assert levels.resolution[0] == np.diff(values).min()


def test_padding():
    levels = Levels(("x", "y"), (np.array([0.0, 1.0]), np.array([0.0, 1.0, 2.0])), True, np.ones(2))
    padded, counts = levels.arrays()
    np.testing.assert_array_equal(padded, [[0, 1, np.nan], [0, 1, 2]])
    assert counts.tolist() == [2, 3]


def test_no_levels_at_all():
    data = numbers([[0.5, 1.5], [0.5, 2.5]])
    with pytest.raises(ConfigurationError, match="a cap of 0 levels leaves no threshold; use 1 or more"):
        Levels.of(SearchSpace.from_data(data), data, 0)
