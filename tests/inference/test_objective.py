import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.worlds import errand_data, grid_prior
from tickwise.errors import ConfigurationError
from tickwise.inference.information import information_gain
from tickwise.inference.objective import Objective, trajectory_weights
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.tree import STRUCTURES, classification_rate

DATA = errand_data(3, 4, 10, (0, 1, 0, 2), 2, (2, 4, 2, 4), 8, 20)
SPACE = SearchSpace.grid(4, 10)
PRIORS = (grid_prior(4, 10), BoxPrior({"y": (0, 4), "x": (0, 4)}, 10))
structures = st.lists(st.lists(st.sampled_from(STRUCTURES), min_size=1, max_size=2), min_size=1, max_size=2)


@settings(max_examples=60)
@given(
    structure=structures,
    prior=st.sampled_from(PRIORS),
    weight=st.sampled_from((0.0, 0.01, 1.0)),
    class_weight=st.sampled_from((None, "balanced", {1: 3.0, -1: 0.5})),
    seed=st.integers(0, 1000),
)
def test_the_objective_is_rate_plus_weighted_gain_and_prunes_only_what_cannot_win(
    structure, prior, weight, class_weight, seed
):
    shape = shape_of(structure)
    weights = trajectory_weights(DATA.labels, class_weight)
    objective = Objective(DATA, weights, prior, SPACE, shape, SPACE.gaps(), weight)
    positions = np.random.default_rng(seed).uniform(*SPACE.bounds(shape), (6, len(SPACE.units(shape))))
    expected = []
    for position in positions:
        formula = objective.formula(position)
        rate, gain = classification_rate(formula, DATA, class_weight), information_gain(formula, prior)
        assert objective.parts(formula) == pytest.approx((rate, gain), abs=1e-12)
        expected.append(rate + weight * gain)
    values = objective(positions, np.full(6, -np.inf))
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(objective(positions, np.full(6, -np.inf)), values)  # now from memory
    incumbents = values[::-1].copy()
    pruned = objective(positions, incumbents)
    assert (pruned[values > incumbents] == values[values > incumbents]).all()
    assert ((pruned == values) | (pruned == -np.inf)).all()


def test_balanced_weights_give_both_labels_the_same_say():
    weights = trajectory_weights(DATA.labels, "balanced")
    assert weights[DATA.labels == 1].sum() == pytest.approx(weights[DATA.labels == -1].sum())
    assert weights.sum() == pytest.approx(len(DATA))
    assert classification_rate(None, DATA, "balanced") == pytest.approx(0.5)


@pytest.mark.parametrize("class_weight", ["even", {0: 1.0}, {1: 0.0}])
def test_wrong_class_weights(class_weight):
    with pytest.raises(ConfigurationError, match="class_weight"):
        trajectory_weights(DATA.labels, class_weight)


@pytest.mark.parametrize(("pair", "disjuncts"), [(STRUCTURES[2], 12), (STRUCTURES[0], 13)])
def test_too_many_clock_valuations_are_refused(pair, disjuncts):
    shape = shape_of([[pair]] * disjuncts)
    space = SearchSpace.grid(4, 40)
    with pytest.raises(ConfigurationError, match=f"{disjuncts} disjuncts over 40 ticks"):
        Objective(DATA, np.ones(len(DATA)), PRIORS[0], space, shape, space.gaps(), 0.01)
