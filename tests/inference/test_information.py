import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.twins import box_paths, box_prior, chain_priors, enumerated, graph_paths
from tests.strategies import primitives, sdnfs
from tickwise.errors import FormulaError, UnknownVariableError
from tickwise.inference.counting import log_probability as fast_log_probability
from tickwise.inference.information import information_gain, log_probability, probability
from tickwise.inference.prior import BoxPrior, PathPrior
from tickwise.inference.space import to_arrays
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, SequentialConjunction, to_sdnf
from tickwise.logic.syntax import Constant

TOLERANCE = {"rel": 1e-12, "abs": 1e-12}
small = sdnfs(most=3, disjuncts=3, longest=3)


def fast(formula, prior, variables=("x", "y")):
    return math.exp(fast_log_probability(prior.arrays(variables), *to_arrays(formula, variables)))


@settings(max_examples=300)
@given(formula=small, drawn=chain_priors())
def test_probability_equals_enumeration_of_all_paths(formula, drawn):
    """Up to three disjuncts, whose windows may reach beyond the horizon: what is undecided there counts."""
    prior, initial, step = drawn
    paths = graph_paths(initial, step, prior.coordinates, prior.horizon)
    expected = pytest.approx(enumerated(formula, paths), **TOLERANCE)
    assert probability(formula, prior) == expected
    assert fast(formula, prior) == expected


@given(formula=sdnfs(("x",), most=2, disjuncts=3, longest=2), horizon=st.integers(1, 3))
def test_probability_of_independent_draws_equals_enumeration_of_all_cells(formula, horizon):
    prior = box_prior(horizon)
    expected = pytest.approx(enumerated(formula, box_paths(formula, 0.0, 4.0, horizon), ("x",)), **TOLERANCE)
    assert probability(formula, prior) == expected
    assert fast(formula, prior, ("x",)) == expected


@given(formula=sdnfs(most=3, disjuncts=3, longest=5), drawn=chain_priors(25))
def test_fast_kernel_equals_the_tick_tables(formula, drawn):
    assert fast(formula, drawn[0]) == pytest.approx(probability(formula, drawn[0]), **TOLERANCE)


@settings(max_examples=150)
@given(formula=sdnfs(most=2, disjuncts=3, longest=4), drawn=chain_priors(8))
def test_a_disjunction_says_no_more_than_each_of_its_disjuncts(formula, drawn):
    prior = drawn[0]
    whole = probability(formula, prior)
    parts = [probability(SDNF((disjunct,)), prior) for disjunct in formula.disjuncts]
    assert max(parts) - 1e-12 <= whole <= sum(parts) + 1e-12
    assert whole == pytest.approx(probability(SDNF(formula.disjuncts[::-1]), prior), **TOLERANCE)
    expected = 0.0 if whole == 0 else -math.log(whole) / prior.horizon
    assert information_gain(formula, prior) == pytest.approx(expected, **TOLERANCE)


@settings(max_examples=150)
@given(primitive=primitives(longest=3), drawn=chain_priors(8))
def test_a_primitive_and_its_negation_share_what_is_undecided_only(primitive, drawn):
    prior = drawn[0]
    either = sum(probability(SDNF((SequentialConjunction((one,)),)), prior) for one in (primitive, primitive.negation))
    if primitive.end <= prior.horizon:
        assert either == pytest.approx(1)
    else:
        assert 1 - 1e-12 <= either <= 2 + 1e-12
    if primitive.start > prior.horizon:
        assert either == pytest.approx(2)


@pytest.mark.parametrize("operator", ["F[2,20]", "G[3,5] !", "F[2,20] G[0,3]", "G[0,20] F[0,4]"])
def test_many_disjuncts_of_long_windows(operator):
    """Nine copies over two different places: far more joint clock valuations than are ever in use."""
    places = [f"({x} <= x <= {x + 1})" for x in (0, 2)]
    street = PathPrior(np.tri(4, k=1) - np.tri(4, k=-2), [[0.5], [1.5], [2.5], [3.5]], ("x",), 24)
    few, many = (
        to_sdnf(parse(" | ".join(f"({operator} {places[copy % 2]})" for copy in range(copies)))) for copies in (2, 9)
    )
    assert fast(many, street, ("x",)) == pytest.approx(probability(few, street), **TOLERANCE)


def test_probabilities_by_hand():
    # two states, all steps possible: every path of 3 states has probability 1/8
    prior = PathPrior(np.ones((2, 2)), [[0.5], [1.5]], ("x",), 2)
    assert probability(parse("F[0,2] (x > 1)"), prior) == pytest.approx(7 / 8)
    assert probability(parse("G[0,2] (x > 1)"), prior) == pytest.approx(1 / 8)
    assert probability(parse("F[0,1] G[0,1] (x > 1)"), prior) == pytest.approx(3 / 8)  # 110, 011, 111
    assert information_gain(parse("G[0,2] (x > 1)"), prior) == pytest.approx(3 * math.log(2) / 2)
    # one-way street 0 -> 1 with loops: paths 00, 01, 11
    street = PathPrior([[1, 1], [0, 1]], [[0.5], [1.5]], ("x",), 1)
    assert probability(parse("F[1,1] (x > 1)"), street) == pytest.approx(2 / 3)
    assert probability(parse("F[1,2] (x > 1)"), street) == 1  # the weak view: tick 2 is beyond the horizon


def test_tautologies_and_contradictions_tell_nothing():
    prior = BoxPrior({"x": (0, 1)}, 5)
    for formula in (Constant(True), Constant(False), parse("F[0,5] (x > 2)"), parse("G[0,5] (x < 2)")):
        assert information_gain(formula, prior) == 0
    assert probability(Constant(False), prior) == 0
    assert probability(Constant(True), prior) == 1


def test_long_horizons_neither_overflow_nor_underflow():
    always = to_sdnf(parse("G[0,4000] (x <= 1)"))
    prior = BoxPrior({"x": (0, 4)}, 4000)
    assert log_probability(always, prior) == pytest.approx(4001 * math.log(0.25))
    assert fast_log_probability(prior.arrays(("x",)), *to_arrays(always, ("x",))) == pytest.approx(
        4001 * math.log(0.25)
    )
    ring = PathPrior(np.ones((3, 3)), [[0.5], [1.5], [2.5]], ("x",), 4000)
    assert information_gain(always, ring) == pytest.approx(4001 * math.log(3) / 4000)


def test_variables_that_the_prior_lacks():
    with pytest.raises(UnknownVariableError, match="'z'"):
        probability(parse("F[0,1] (z > 0)"), BoxPrior({"x": (0, 1)}, 3))


def test_formulas_without_a_normal_form():
    with pytest.raises(FormulaError):
        probability(parse("F[0,3] (x > 0) & F[1,4] (x < 0)"), BoxPrior({"x": (-1, 1)}, 5))
