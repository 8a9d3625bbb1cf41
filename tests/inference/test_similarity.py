import pytest
from hypothesis import given, settings

from tests.inference.twins import chain_priors, graph_paths, weak
from tests.strategies import sdnfs
from tickwise.errors import FormulaError, UnknownVariableError
from tickwise.inference.information import probability
from tickwise.inference.prior import BoxPrior
from tickwise.inference.similarity import aligned_dissimilarity, disagreement, dissimilarity
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF

TOLERANCE = {"rel": 1e-9, "abs": 1e-12}
small = sdnfs(most=2, disjuncts=2, longest=3)


@settings(max_examples=150)
@given(phi=small, psi=small, drawn=chain_priors())
def test_it_equals_counting_all_paths(phi: SDNF, psi: SDNF, drawn):
    prior, initial, step = drawn
    paths, weights = graph_paths(initial, step, prior.coordinates, prior.horizon)
    first, second = (weak(formula, paths, ("x", "y")) for formula in (phi, psi))
    apart, either = (float(weights[which].sum()) for which in (first != second, first | second))
    assert disagreement(phi, psi, prior) == pytest.approx(apart, **TOLERANCE)
    assert dissimilarity(phi, psi, prior) == pytest.approx(apart / either if either > 0 else 0.0, **TOLERANCE)


@given(phi=small, psi=small, chi=small, drawn=chain_priors(6))
@pytest.mark.parametrize("distance", [disagreement, dissimilarity])
def test_it_is_a_metric(distance, phi: SDNF, psi: SDNF, chi: SDNF, drawn):
    prior = drawn[0]
    assert distance(phi, phi, prior) == 0
    there = distance(phi, psi, prior)
    assert 0 <= there <= 1
    assert distance(psi, phi, prior) == pytest.approx(there, **TOLERANCE)
    assert there <= distance(phi, chi, prior) + distance(chi, psi, prior) + 1e-9


@given(phi=small, psi=small, drawn=chain_priors(6))
def test_what_one_says_and_the_other_does_not_is_the_disagreement(phi: SDNF, psi: SDNF, drawn):
    prior = drawn[0]
    either = probability(SDNF((*phi.disjuncts, *psi.disjuncts)), prior)
    difference = 2 * either - probability(phi, prior) - probability(psi, prior)
    assert disagreement(phi, psi, prior) == pytest.approx(difference, rel=1e-9, abs=1e-12)


def test_independent_draws_by_hand():
    prior = BoxPrior({"x": (0.0, 4.0)}, horizon=1)
    first, second = parse("F[0,1] (x >= 3)"), parse("F[0,1] (x >= 2)")
    # the first holds with 1 - (3/4)^2 = 7/16, the second with 1 - (1/2)^2 = 12/16, and whenever the first does
    assert disagreement(first, second, prior) == pytest.approx(5 / 16)
    assert dissimilarity(first, second, prior) == pytest.approx(5 / 12)
    # to be above 3 throughout, and never above 2, exclude each other
    assert dissimilarity(parse("G[0,1] (x >= 3)"), parse("G[0,1] (x <= 2)"), prior) == 1
    # neither can be: the prior ends at 4
    assert dissimilarity(parse("F[0,1] (x >= 5)"), parse("F[0,1] (x >= 6)"), prior) == 0


def test_what_remains_after_alignment_by_hand():
    prior = BoxPrior({"x": (0.0, 4.0)}, horizon=1)
    source, target = parse("F[0,0] (0 <= x <= 1)"), parse("F[1,1] (2 <= x <= 4)")
    # moved by 2 and a tick it is to be in [2,3] at tick 1: a half of what satisfies the target
    assert aligned_dissimilarity(source, target, prior) == pytest.approx(1 / 2)
    assert dissimilarity(source, target, prior) > 0.7
    assert aligned_dissimilarity(parse("F[0,0] (1 <= x <= 3)"), target, prior) == 0


def test_what_cannot_be_compared_is_refused():
    prior = BoxPrior({"x": (0.0, 4.0)}, horizon=1)
    with pytest.raises(UnknownVariableError, match="'y'"):
        disagreement(parse("F[0,1] (x >= 3)"), parse("F[0,1] (y >= 3)"), prior)
    with pytest.raises(FormulaError):
        disagreement(parse("F[0,1] (x >= 3)"), parse("G[0,1] F[0,1] G[0,1] (x >= 3)"), prior)
