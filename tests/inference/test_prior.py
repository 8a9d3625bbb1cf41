from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given

from tests.inference.twins import chain_priors, predicate_lists
from tickwise.errors import ConfigurationError, DataError, UnknownVariableError
from tickwise.inference.prior import BoxPrior, MarkovPrior, PathPrior
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Box

PLACES = [[0.5, 0.5], [1.5, 0.5]]


@given(drawn=chain_priors(30), predicates=predicate_lists())
def test_a_chain_is_normalised_at_every_tick(drawn, predicates):
    prior = drawn[0]
    chain = prior.chain(predicates)
    weights, sources = chain.initial, np.repeat(np.arange(len(chain.initial)), np.diff(chain.indptr))
    for tick in range(chain.horizon + 1):
        assert weights @ chain.backward[tick] == pytest.approx(1)
        if tick < chain.horizon:
            step = weights[sources] * chain.weights / chain.scale[tick]
            weights = np.bincount(chain.indices, weights=step, minlength=len(weights))
    for bit, predicate in enumerate(predicates):
        truth = holds(predicate, np.asarray(prior.coordinates), ("x", "y"))
        assert ((chain.letters >> bit & 1) == truth).all()


def test_csr_and_dense_adjacency_agree():
    dense = PathPrior([[1, 1], [0, 1]], PLACES, ("x", "y"), 3).chain([])
    sparse = PathPrior((np.array([0, 2, 3]), np.array([1, 0, 1])), PLACES, ("x", "y"), 3).chain([])
    for name in ("initial", "indptr", "indices", "weights", "scale", "backward"):
        np.testing.assert_array_equal(getattr(dense, name), getattr(sparse, name))


def test_uniform_over_paths_is_not_uniform_over_steps():
    # paths of 3 states of the one-way street: 000 001 011 111, so half of them are in state 0 at tick 1
    chain = PathPrior([[1, 1], [0, 1]], PLACES, ("x", "y"), 2).chain([])
    after = np.array([chain.initial[0], chain.initial.sum()]) / chain.scale[0]
    np.testing.assert_allclose(after * chain.backward[1], [0.5, 0.5])


def test_letters_of_independent_draws_have_exact_measures():
    chain = BoxPrior({"x": (0, 4), "y": (0, 2)}, 1).chain([Box.of(x=(1, 3)), Box.of(x=(2, 9), y=(0, 1))])
    assert dict(zip(chain.letters.tolist(), chain.initial.tolist(), strict=True)) == pytest.approx(
        {0: 3 / 8, 1: 3 / 8, 2: 1 / 8, 3: 1 / 8}
    )


@pytest.mark.parametrize(
    ("build", "error", "message"),
    [
        (lambda: PathPrior(np.ones((2, 3)), PLACES), DataError, "square matrix"),
        (lambda: PathPrior([[0.5, 1], [1, 1]], PLACES), DataError, "other than 0 and 1"),
        (lambda: PathPrior([[0, 1], [0, 0]], PLACES), DataError, "no path of 41 states"),
        (lambda: PathPrior(np.ones((3, 3)), PLACES), DataError, "3 states and 2 variables"),
        (lambda: PathPrior((np.array([0, 1]), np.array([1])), [[0, 0]]), DataError, "not a CSR matrix"),
        (lambda: PathPrior(np.ones((2, 2)), PLACES, horizon=0), ConfigurationError, "horizon is 0"),
        (lambda: MarkovPrior([1, 0], [[0.5, 0.6], [0, 1]], PLACES), DataError, "row 0 .* sums to 1.1"),
        (lambda: MarkovPrior([1, 1], np.eye(2), PLACES), DataError, "sum to 2"),
        (lambda: MarkovPrior([1, 0], [[2, -1], [0, 1]], PLACES), DataError, "negative"),
        (lambda: BoxPrior({}, 3), DataError, "no variable"),
        (lambda: BoxPrior({"x": (1, 1)}, 3), DataError, "lo < hi"),
        (lambda: BoxPrior({"x": (0, np.inf)}, 3), DataError, "finite"),
        (lambda: BoxPrior({"x": (0, 1)}, 0), ConfigurationError, "horizon is 0"),
        (lambda: BoxPrior({"x": (0, 1)}, 2).arrays(("y",)), UnknownVariableError, "'y'"),
    ],
)
def test_wrong_priors(build, error, message):
    with pytest.raises(error, match=message):
        build()


def test_kernels_are_compiled_once_for_all_priors():
    # a copy stands for what another process is sent, where nothing is frozen
    path = PathPrior(np.ones((3, 3)), np.arange(6.0).reshape(3, 2), horizon=4)
    chain = MarkovPrior(np.full(3, 1 / 3), np.full((3, 3), 1 / 3), np.arange(6.0).reshape(3, 2), horizon=4)
    box = BoxPrior({"x": (0.0, 1.0), "y": (0.0, 1.0)}, 4)
    for prior in (path, deepcopy(path), chain, box, deepcopy(box)):
        for array in prior.arrays(("y", "x"))[3:]:
            assert array.flags.c_contiguous
            assert not array.flags.writeable
