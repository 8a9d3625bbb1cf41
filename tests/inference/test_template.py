import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.worlds import errand_data, grid_prior, ragged_walks, weakly
from tests.strategies import sdnfs
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.information import information_gain
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_structure, fit_transferable
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, classification_rate, infer_tree, is_satisfying
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction, to_sdnf
from tickwise.logic.structure import structurally_equivalent, structurally_transferable
from tickwise.logic.syntax import Box, Interval, Not

FAST = SwarmSettings(particles=30, iterations=40, restarts=1, stall=10)
G, Y = (1, 2, 1, 3), (4, 5, 3, 5)
SPACE, PRIOR = SearchSpace.grid(5, 20), grid_prior(5, 20)


@pytest.fixture(scope="module")
def errands():
    return errand_data(0, 5, 20, G, 4, Y, 15, 60)


def rng():
    return np.random.default_rng(0)


def test_a_joint_fit_keeps_structure_order_and_polarity(errands):
    source = to_sdnf(parse("F[0,9] G[0,4] (1 <= x <= 2 & 1 <= y <= 3) & G[15,20] !(4 <= x <= 5 & 3 <= y <= 5)"))
    fit = fit_structure(errands, PRIOR, SPACE, source, InferenceSettings(), FAST, rng())
    assert structurally_equivalent(fit.formula, source)
    assert [p.complemented for p in fit.formula.disjuncts[0].primitives] == [False, True]
    assert fit.formula.disjuncts[0].primitives[-1].end <= 20


def test_a_joint_fit_finds_the_rule(errands):
    fit = fit_structure(errands, PRIOR, SPACE, (("FG", "F"),), InferenceSettings(), FAST, rng())
    assert fit.satisfying
    assert fit.rate == classification_rate(fit.formula, errands)
    assert fit.gain == pytest.approx(information_gain(fit.formula, PRIOR), abs=1e-12)
    assert fit.objective == pytest.approx(fit.rate + 0.01 * fit.gain)
    stay, reach = fit.formula.disjuncts[0].primitives
    assert str(stay.predicate) == "1 <= x <= 2 & 1 <= y <= 3"
    assert stay.duration >= 3
    # the best single formula is at least as good as the tree's, which fixes the first primitive before the second
    tree = infer_tree(errands, PRIOR, SPACE, InferenceSettings(), FAST, rng())
    assert fit.rate >= classification_rate(tree.formula, errands) - 0.02
    assert reach.start > stay.end


QUICK = SwarmSettings(particles=8, iterations=3, restarts=1, stall=2, climbers=1)
structures = st.lists(
    st.lists(st.tuples(st.sampled_from(Operator), st.booleans()), min_size=1, max_size=3), min_size=1, max_size=3
).filter(lambda pairs: sum(map(len, pairs)) <= 4)


def any_formula(pairs):
    """A formula of a structure that is given as (operator, complemented) pairs, with numbers that do not matter."""
    disjuncts = []
    for pair in pairs:
        primitives, box = [], Box.of(x=(0, 1))
        for tick, (operator, complemented) in enumerate(pair):
            window, predicate = Interval(20 * tick, 20 * tick + 1), Not(box) if complemented else box
            primitives.append(Primitive(operator, window, int(operator.nested), predicate))
        disjuncts.append(SequentialConjunction(tuple(primitives)))
    return SDNF(tuple(disjuncts))


@settings(max_examples=25)
@given(
    pairs=structures,
    rule=st.none() | sdnfs(most=2, longest=3),
    seed=st.integers(0, 2**32 - 1),
    ticks=st.integers(9, 12),
)
def test_a_joint_fit_of_ragged_trajectories_is_valid_and_reports_what_the_semantics_says(pairs, rule, seed, ticks):
    """Any operators, negated ones too, in conjunctions of up to three and disjunctions of up to three."""
    data, space, prior = ragged_walks(seed, 3, 9, 30, rule), SearchSpace.grid(3, ticks), grid_prior(3, 9)
    chosen = InferenceSettings(rate=0.8, size=3)
    fit = fit_structure(data, prior, space, any_formula(pairs), chosen, QUICK, np.random.default_rng(seed))
    found = [[(p.operator, p.complemented) for p in disjunct.primitives] for disjunct in fit.formula.disjuncts]
    assert found == pairs
    for disjunct in fit.formula.disjuncts:  # which is sequential, or would not be there
        assert disjunct.primitives[-1].end <= ticks
        assert all(p.window.start < p.window.end for p in disjunct.primitives)
        sides = [side for p in disjunct.primitives for bound in p.box.bounds for side in (bound.lower, bound.upper)]
        assert set(sides) <= {0, 1, 2, 3}
    assert fit.rate == (weakly(fit.formula, data) == (data.labels == 1)).mean()
    assert fit.gain == pytest.approx(information_gain(fit.formula, prior), abs=1e-12)
    assert fit.objective == pytest.approx(fit.rate + 0.01 * fit.gain)
    assert fit.satisfying == is_satisfying(fit.formula, data, chosen) == (fit.rate >= 0.8 and fit.size <= 3)


@settings(max_examples=15)
@given(pairs=structures, seed=st.integers(0, 2**32 - 1))
def test_a_fit_is_no_worse_than_where_it_starts(pairs, seed):
    data, space, prior = ragged_walks(seed, 3, 9, 20), SearchSpace.grid(3, 9), grid_prior(3, 9)
    structure, chosen = any_formula(pairs), InferenceSettings()
    shape = shape_of(pairs)
    start = space.decode(np.random.default_rng(seed).uniform(*space.bounds(shape)), shape)
    gain = information_gain(start, prior)
    fit = fit_structure(data, prior, space, structure, chosen, QUICK, np.random.default_rng(seed), start=start)
    assert fit.objective >= classification_rate(start, data) + chosen.information_weight * gain - 1e-12


@settings(max_examples=10)
@given(pairs=structures.filter(lambda pairs: len(pairs) < 3), size=st.integers(1, 5), seed=st.integers(0, 2**32 - 1))
def test_copies_grow_until_the_size_constraint_and_the_reason_says_so(pairs, size, seed):
    """Labels in turn have no rule of the rate of 1 that is asked for, or one that the last copy found."""
    data, prior = ragged_walks(seed, 3, 9, 30), grid_prior(3, 9)
    source, chosen = any_formula(pairs), InferenceSettings(rate=1.0, size=size, information_weight=0.0)
    result = fit_transferable(data, prior, SearchSpace.grid(3, 9), source, chosen, QUICK, np.random.default_rng(seed))
    assert [attempt.size for attempt in result.attempts] == [
        source.size * copies for copies in range(1, len(result.attempts) + 1)
    ]
    for attempt in result.attempts:
        assert structurally_transferable(attempt.formula, source)
        polarities = [p.complemented for disjunct in attempt.formula.disjuncts for p in disjunct.primitives]
        assert polarities == [flag for pair in pairs for _, flag in pair] * (attempt.size // source.size)
    assert [attempt.satisfying for attempt in result.attempts[:-1]] == [False] * (len(result.attempts) - 1)
    if result.transferable:
        assert result.attempts[-1].rate == 1
    elif source.size > size:
        assert result.attempts == ()
        assert f"size {source.size}, more than the {size}" in result.reason
    else:
        assert len(result.attempts) == size // source.size
        assert f"one more copy would exceed size {size}" in result.reason


def two_places(seed):
    """x stays near 1 all the time, or near 4 all the time; bad ones go between them."""
    noise = np.random.default_rng(seed)
    good = [np.clip(centre + noise.uniform(-0.4, 0.4, (8, 1)), 0, 5) for centre in (1, 4) * 10]
    bad = [noise.permutation([[0.6], [1.0], [1.4], [2.5], [3.6], [4.0], [4.4], [2.2]]) for _ in range(30)]
    return LabelledTrajectories.from_arrays([*good, *bad], [1] * 20 + [-1] * 30, ("x",))


LINE = SearchSpace(("x",), (tuple(np.arange(0, 5.5, 0.5)),), 7, (False,))


def test_copies_are_added_until_the_formula_satisfies():
    data, prior = two_places(0), BoxPrior({"x": (0, 5)}, 7)
    source = to_sdnf(parse("G[0,7] (2 <= x <= 3)"))
    result = fit_transferable(data, prior, LINE, source, InferenceSettings(), FAST, rng())
    assert result.transferable
    assert [attempt.size for attempt in result.attempts] == [1, 2]
    assert [attempt.satisfying for attempt in result.attempts] == [False, True]
    assert structurally_transferable(result.formula, source)
    assert result.attempts[1].rate == 1
    assert result.attempts[1].objective >= result.attempts[0].objective
    assert "disjunction of 2 formulas" in result.reason


def test_step_two_refuses_within_the_size_constraint():
    data, prior = two_places(0), BoxPrior({"x": (0, 5)}, 7)
    source = to_sdnf(parse("G[0,7] (2 <= x <= 3)"))
    result = fit_transferable(data, prior, LINE, source, InferenceSettings(size=1), FAST, rng())
    assert not result.transferable
    assert result.formula is None
    assert len(result.attempts) == 1
    assert "not identified" in result.reason
    assert "exceed size 1" in result.reason


def test_step_two_refuses_labels_without_a_rule():
    noise = np.random.default_rng(1)
    data = LabelledTrajectories.from_arrays(noise.uniform(0, 5, (60, 8, 1)), [1, -1] * 30, ("x",))
    source = to_sdnf(parse("F[0,3] (2 <= x <= 3) & F[5,7] (1 <= x <= 2)"))
    result = fit_transferable(data, BoxPrior({"x": (0, 5)}, 7), LINE, source, InferenceSettings(), FAST, rng())
    assert not result.transferable
    assert [attempt.size for attempt in result.attempts] == [2, 4]


def test_a_source_that_is_too_large_is_refused_at_once():
    source = to_sdnf(parse("F[0,1] (x > 1) & F[3,4] (x > 1)"))
    data = two_places(0)
    result = fit_transferable(data, BoxPrior({"x": (0, 5)}, 7), LINE, source, InferenceSettings(size=1), FAST, rng())
    assert (result.attempts, result.transferable) == ((), False)
    assert "size 2, more than the 1" in result.reason


def test_structures_that_do_not_fit(errands):
    chosen = InferenceSettings()
    with pytest.raises(ConfigurationError, match="do not fit into 3 ticks"):
        fit_structure(errands, PRIOR, SearchSpace.grid(5, 3), (("FG", "FG"),), chosen, FAST, rng())
    with pytest.raises(ConfigurationError, match="unknown operator"):
        fit_structure(errands, PRIOR, SPACE, (("U",),), chosen, FAST, rng())
    with pytest.raises(ConfigurationError, match="no primitive"):
        fit_structure(errands, PRIOR, SPACE, ((),), chosen, FAST, rng())
    with pytest.raises(DataError, match="no trajectory has label -1"):
        fit_structure(errands.select(errands.labels == 1), PRIOR, SPACE, (("F",),), chosen, FAST, rng())
