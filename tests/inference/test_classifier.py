import subprocess
import sys

import numpy as np
import pytest

from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.prior import BoxPrior
from tickwise.inference.swarm import SwarmSettings

FAST = SwarmSettings(particles=30, iterations=40, restarts=1, stall=10)


def dips(seed=0, n=40):
    """Label 1 iff y never falls below 3 in ticks 2 to 6; x is noise."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(0, 10, (n, 10, 2))
    y = np.where(rng.random(n) < 0.5, 1, -1)
    X[y == 1, 2:7, 1] = rng.uniform(3.2, 10, (int((y == 1).sum()), 5))
    X[y == -1, rng.integers(2, 7), 1] = rng.uniform(0, 2.8, int((y == -1).sum()))
    return X, y


def test_it_learns_a_threshold_and_predicts():
    X, y = dips()
    model = MITLClassifier(variables=("x", "y"), swarm=FAST, depth=1)
    assert model.fit(X, y) is model
    assert model.score(X, y) >= 0.95
    assert model.satisfying_
    assert model.tree_.formula == model.formula_
    assert model.classes_.tolist() == [-1, 1]
    assert model.formula_.size == 1
    assert set(model.formula_.formula.variables) <= {"x", "y"}
    assert model.predict(X[:5]).shape == (5,)
    np.testing.assert_array_equal(model.predict(list(X)), model.predict(X))


def test_equal_seeds_give_equal_formulas():
    X, y = dips()
    first, second = (MITLClassifier(swarm=FAST, depth=1).fit(list(X), y).formula_ for _ in range(2))
    assert first == second


def test_a_prior_may_be_given():
    X, y = dips()
    prior = BoxPrior({"x": (0, 10), "y": (0, 10)}, 9)
    model = MITLClassifier(variables=("x", "y"), prior=prior, swarm=FAST, depth=1, class_weight="balanced").fit(X, y)
    assert model.score(X, y) >= 0.9


def test_no_formula_predicts_minus_one():
    X = np.zeros((4, 3, 1))
    model = MITLClassifier(swarm=FAST).fit(X, [1, -1, -1, -1])
    assert model.formula_ is None
    assert not model.satisfying_
    assert model.predict(X).tolist() == [-1] * 4


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"search": "guess"}, "search is 'guess'"),
        ({"random_state": -1}, "random_state is -1"),
        ({"random_state": None}, "random_state is None"),
        ({"depth": 0}, "depth is 0"),
        ({"class_weight": "even"}, "class_weight is 'even'"),
    ],
)
def test_parameters_are_checked_in_fit(wrong, message):
    X, y = dips(n=8)
    with pytest.raises(ConfigurationError, match=message):
        MITLClassifier(swarm=FAST, **wrong).fit(X, y)


def test_unfitted_and_unknown():
    with pytest.raises(DataError, match="call fit first"):
        MITLClassifier().predict(np.zeros((1, 2, 1)))
    with pytest.raises(ConfigurationError, match="no parameter 'deepth'"):
        MITLClassifier().set_params(deepth=3)
    assert MITLClassifier().set_params(depth=3).get_params()["depth"] == 3


def test_scikit_learn_is_never_imported():
    code = "import sys, tickwise.inference.classifier; sys.exit('sklearn' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_scikit_learn_clones_it_and_searches_with_it():
    base = pytest.importorskip("sklearn.base")
    selection = pytest.importorskip("sklearn.model_selection")
    X, y = dips()
    model = MITLClassifier(depth=1, swarm=FAST, variables=("x", "y"))
    copy = base.clone(model)
    assert copy is not model
    assert copy.get_params() == model.get_params()
    assert base.is_classifier(model)
    search = selection.GridSearchCV(model, {"information_weight": [0.0, 0.01]}, cv=2).fit(X, y)
    assert search.best_score_ > 0.7
    assert set(search.best_params_) == {"information_weight"}
