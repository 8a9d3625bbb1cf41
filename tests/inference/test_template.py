import numpy as np
import pytest

from tests.inference.worlds import errand_data, grid_prior
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.information import information_gain
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_structure, fit_transferable
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, classification_rate, infer_tree
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.structure import structurally_equivalent, structurally_transferable

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
    settings = InferenceSettings()
    with pytest.raises(ConfigurationError, match="do not fit into 3 ticks"):
        fit_structure(errands, PRIOR, SearchSpace.grid(5, 3), (("FG", "FG"),), settings, FAST, rng())
    with pytest.raises(ConfigurationError, match="unknown operator"):
        fit_structure(errands, PRIOR, SPACE, (("U",),), settings, FAST, rng())
    with pytest.raises(ConfigurationError, match="no primitive"):
        fit_structure(errands, PRIOR, SPACE, ((),), settings, FAST, rng())
    with pytest.raises(DataError, match="no trajectory has label -1"):
        fit_structure(errands.select(errands.labels == 1), PRIOR, SPACE, (("F",),), settings, FAST, rng())
