"""All windows and durations of a box at once are the same as one after the other."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, box_node, every_node, every_time
from tests.inference.twins import box_prior
from tests.inference.worlds import grid_prior
from tests.strategies import random_trajectories
from tickwise.inference.gains import gain_bound
from tickwise.inference.kernels import Shape, satisfied
from tickwise.inference.levels import Levels, code
from tickwise.inference.prior import BoxPrior
from tickwise.inference.scan import Worth, bound, bound_all, candidates, tabulate
from tickwise.inference.signals import signature, weigh
from tickwise.inference.space import OPERATORS
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import Operator

SIDES = (np.array([-np.inf, 0.0, 0.5, 2.0, 3.0, np.inf]), np.array([-1.0, 1.0, 1.5, 4.0, 6.0]))
"""Levels that the values of the data, which are on half steps, often meet."""

LEVELS = Levels(("x", "y"), SIDES, True, np.array([0.5, 0.5]))


@st.composite
def data_sets(draw, longest=9, shortest=2, most=8):
    """Ragged trajectories, and weights whose sums are exact."""
    ticks, count = draw(st.integers(shortest, longest)), draw(st.integers(1, most))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    values = random_trajectories(seed, count, ticks, 2)
    lengths = rng.integers(1, ticks + 1, count) if draw(st.booleans()) else np.full(count, ticks)
    ids = tuple(map(str, range(count)))
    data = LabelledTrajectories(values, lengths, np.where(rng.random(count) < 0.5, 1, -1), ("x", "y"), ids)
    return data, rng.choice([0.5, 1.0, 3.0], count)


@st.composite
def single_boxes(draw):
    """The level numbers of a box's sides."""
    pairs = [sorted(draw(st.permutations(range(len(sides))))[:2]) for sides in SIDES]
    return tuple(low for low, _ in pairs), tuple(high for _, high in pairs)


@st.composite
def box_ranges(draw):
    """A node with several boxes."""
    existential, complemented = draw(st.booleans()), draw(st.booleans())
    lower, upper = draw(single_boxes())
    least, greatest = draw(single_boxes())
    rows = [
        [min(pair) for pair in zip(lower, least, strict=True)], [max(pair) for pair in zip(lower, least, strict=True)],
        [min(pair) for pair in zip(upper, greatest, strict=True)],
        [max(pair) for pair in zip(upper, greatest, strict=True)],
    ]  # fmt: skip
    return np.array([existential, complemented, *itertools.chain(*rows)], dtype=np.int64)


def right(data, weights, choice):
    """The weight that a primitive classifies rightly, trajectory by trajectory."""
    lower, upper = choice.box(LEVELS)
    operator = OPERATORS.index(choice.operator)
    shape = Shape(np.array([0, 1]), np.array([operator]), np.array([choice.complemented]))
    said = satisfied(data.values, data.lengths, shape, np.array([choice.times]), lower[None], upper[None])
    return said, float(weights[said == (data.labels == 1)].sum())


def operators_of(existential):
    """◇ and ◇□, or □ and □◇."""
    return [op for op in OPERATORS if (op in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS)) == existential]


def every_window(node, gaps):
    """All primitives of a node of a single box."""
    (lower,), (upper,) = ([tuple(row)] for row in (node[2:4].tolist(), node[6:8].tolist()))
    for operator in operators_of(node[0] == 1):
        for times in every_time(gaps, operator):
            yield Choice(operator, bool(node[1]), times, lower, upper)


def check_table(data, weights, node, first, last, horizon):
    coded = code(data, weights, LEVELS, horizon)
    ticks = last - first + 1
    table = tabulate(coded, node, first, last, np.full((ticks + 1,) * 3, np.nan))
    assert table.shape == (ticks,) * 3
    for choice in every_window(node, ((first, last),)):
        start, end, duration = choice.times
        assert table[duration, start - first, end - first] == right(data, weights, choice)[1], choice


@settings(max_examples=150)
@given(data=data_sets(), box=single_boxes(), pair=st.tuples(st.booleans(), st.booleans()), ends=st.data())
def test_a_table_has_every_window_and_duration(data, box, pair, ends):
    horizon = data[0].values.shape[1] - 1 + ends.draw(st.integers(0, 3))  # windows may reach beyond all trajectories
    first = ends.draw(st.integers(0, horizon - 1))
    last = ends.draw(st.integers(first + 1, horizon))
    check_table(*data, box_node(*pair, *box), first, last, horizon)


@settings(max_examples=25)
@given(
    data=data_sets(shortest=66, longest=140, most=4),
    box=single_boxes(),
    pair=st.tuples(st.booleans(), st.booleans()),
    ends=st.data(),
)
def test_a_table_of_more_ticks_than_a_word_has_bits(data, box, pair, ends):
    horizon = data[0].values.shape[1] - 1
    first = ends.draw(st.one_of(st.integers(50, 64), st.integers(0, horizon - 1)))
    last = min(first + ends.draw(st.integers(1, 9)), horizon)
    check_table(*data, box_node(*pair, *box), first, last, horizon)


@settings(max_examples=150)
@given(
    data=st.one_of(data_sets(), data_sets(shortest=60, longest=135, most=4)),
    box=single_boxes(),
    operator=st.sampled_from(Operator),
    complemented=st.booleans(),
    times=st.data(),
)
def test_one_primitive_alone(data, box, operator, complemented, times):
    horizon = max(data[0].values.shape[1] - 1, 3)
    start = times.draw(st.integers(0, horizon - 2))
    end = times.draw(st.integers(start + 1, horizon - 1))
    duration = times.draw(st.integers(1, horizon - end)) if operator.nested else 0
    choice = Choice(operator, complemented, (start, end, duration), *box)
    said, weight = right(*data, choice)
    coded = code(*data, LEVELS, horizon)
    existential = operator in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS)
    arguments = (coded, existential, complemented, np.array([*box[0], *box[1]]), np.array(choice.times))
    np.testing.assert_array_equal(signature(*arguments), said)
    assert weigh(*arguments) == weight


PRIORS = (grid_prior(3, 8), box_prior(8))


def scene(data, weights, information_weight, cost, plain, nested):
    """What `bound` needs beside a node, for both priors."""
    levels = LEVELS if information_weight < 0.2 else Levels(("x", "y"), SIDES, True, np.array([0.1, 0.1]))
    coded = code(data, weights, levels, 8)
    return coded, Worth(2.0, float(weights.sum()) + 2.0, plain, nested, cost, information_weight), levels


@settings(max_examples=100)
@given(
    data=data_sets(),
    node=box_ranges(),
    gaps=st.sampled_from((((0, 8),), ((0, 2), (4, 8)), ((3, 4), (6, 8)))),
    information_weight=st.sampled_from((0.0, 0.01, 0.3)),
    cost=st.sampled_from((0.0, 0.02)),
    nesting=st.sampled_from(((True, True), (True, False), (False, True))),
    independent=st.booleans(),
)
def test_the_bound_of_a_range_is_at_least_that_of_each_box(
    data, node, gaps, information_weight, cost, nesting, independent
):
    coded, worth, levels = scene(*data, information_weight, cost, *nesting)
    prior = (PRIORS[0] if not independent else two_boxes()).arrays(("x", "y"))
    limits = gain_bound(prior, levels)
    free = np.array(gaps)
    table, times = np.empty((9, 9, 9)), np.empty(3, dtype=np.int64)
    boxes = list(every_node(node))
    bounds = [bound(coded, box, free, worth, limits, table, times) for box in boxes]
    whole = bound(coded, node, free, worth, limits, table, times)
    assert whole >= max(bounds) - 1e-12
    np.testing.assert_array_equal(bound_all(coded, np.array(boxes), free, worth, limits, 9), bounds)
    if information_weight == 0:  # the bound of a single box is its best primitive
        for box, most in zip(boxes[:3], bounds[:3], strict=True):
            choices = [c for c in every_window(box, gaps) if (worth.nested if c.operator.nested else worth.plain)]
            values = [(2 + right(*data, c)[1]) / worth.total - cost * c.operator.nested for c in choices]
            assert most == pytest.approx(max(values), abs=1e-14)


def test_a_gain_without_end_that_does_not_count():
    """The probability of 36 ticks in a row in a tiny box is less than the least float64."""
    levels = Levels(("x",), (np.array([0.0, 1e-9, 1.0]),), True, np.array([1e-9]))
    values = np.zeros((36, 37, 1))
    values[range(1, 36), range(1, 36)] = 0.5  # the others leave for a tick, so that no shorter stay tells them apart
    data = LabelledTrajectories.from_arrays(values, [1] + [-1] * 35, ("x",))
    coded = code(data, np.ones(36), levels, 36)
    limits = gain_bound(BoxPrior({"x": (0.0, 1.0)}, 36).arrays(("x",)), levels)
    node, gaps = box_node(True, False, (0,), (1,)), np.array([[0, 36]])
    table, times = np.empty((37, 37, 37)), np.empty(3, dtype=np.int64)
    worth = Worth(0.0, 36.0, True, True, 0.0, 0.0)
    assert bound(coded, node, gaps, worth, limits, table, times) == 1.0
    assert times.tolist() == [0, 1, 35]
    assert candidates(coded, node, gaps, worth, limits, 37, 1.0, np.inf)[0].tolist() == [[0, 1, 35]]
    dear = worth._replace(information_weight=0.1)
    assert bound(coded, node, gaps, dear, limits, table, times) == np.inf


def two_boxes():
    return BoxPrior({"y": (-1.0, 5.0), "x": (-0.5, 3.5)}, 8)


@settings(max_examples=60)
@given(data=data_sets(longest=6), box=single_boxes(), pair=st.tuples(st.booleans(), st.booleans()))
def test_candidates_leave_out_only_what_a_tighter_one_makes_up_for(data, box, pair):
    node, gaps = box_node(*pair, *box), ((0, 5),)
    coded = code(*data, LEVELS, 5)
    worth = Worth(0.0, float(data[1].sum()), True, True, 0.0, 0.0)
    arguments = (coded, node, np.array(gaps), worth, gain_bound(PRIORS[0].arrays(("x", "y")), LEVELS), 6)
    choices = {choice.times: choice for choice in every_window(node, gaps)}
    times, weights, _ = candidates(*arguments, -np.inf, np.inf)
    assert {tuple(row): weight for row, weight in zip(times.tolist(), weights, strict=True)} == {
        key: right(*data, choice)[1] for key, choice in choices.items()
    }
    # every sequence of zeros and ones
    bits = np.array(list(itertools.product((0.0, 1.0), repeat=6)))[..., None]
    said = {key: holds(bits, choice) for key, choice in choices.items()}
    for floor in (-np.inf, 1.0):
        kept, heavy, _ = candidates(*arguments, -np.inf, floor)
        left = {tuple(row): weight for row, weight in zip(kept.tolist(), heavy, strict=True)}
        for key, choice in choices.items():
            weight = right(*data, choice)[1]
            assert key in left or any(
                other >= weight
                and other > floor
                and (near[2] > 0) == (key[2] > 0)
                and not (said[near] & ~said[key]).any()
                for near, other in left.items()
            )


def holds(bits, choice):
    """Whether each sequence of one variable satisfies the operator of "it is 1"."""
    shape = Shape(np.array([0, 1]), np.array([OPERATORS.index(choice.operator)]), np.array([False]))
    lengths = np.full(len(bits), bits.shape[1])
    return satisfied(bits, lengths, shape, np.array([choice.times]), np.ones((1, 1)), np.ones((1, 1)))
