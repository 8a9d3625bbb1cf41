import subprocess
import sys

import numpy as np
import pytest

from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.prior import BoxPrior
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories

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


# ---------------------------------------------------------------- scikit-learn's conventions, and other forms of data


def model(**parameters):
    return MITLClassifier(**{"depth": 1, "swarm": FAST, "search": "swarm", "variables": ("x", "y"), **parameters})


def long_frame(X, label=None, ids=None):
    pandas = pytest.importorskip("pandas")
    n, ticks, _ = X.shape
    frame = pandas.DataFrame(X.reshape(n * ticks, 2), columns=["x", "y"])
    frame.insert(0, "tick", np.tile(np.arange(ticks), n))
    frame.insert(0, "trajectory", np.repeat(np.arange(n) if ids is None else ids, ticks))
    if label is not None:
        frame["label"] = np.repeat(label, ticks)
    return frame


@pytest.mark.parametrize(
    ("negative", "positive"), [(0, 1), ("faulty", "ok"), (False, True), (3.0, 7.5)], ids=["01", "text", "bool", "float"]
)
def test_any_two_labels(negative, positive):
    X, y = dips()
    labels = np.where(y == 1, positive, negative)
    fitted = model().fit(X, labels)
    assert fitted.formula_ == model().fit(X, y).formula_
    assert fitted.classes_.tolist() == [negative, positive]
    assert fitted.positive_ == positive
    assert set(fitted.predict(X).tolist()) == {negative, positive}
    assert fitted.score(X, labels) == model().fit(X, y).score(X, y)


def test_the_formula_can_describe_either_label():
    X, y = dips()
    labels = np.where(y == 1, "normal", "broken")
    other = model(positive="broken").fit(X, labels)
    assert other.formula_ == model().fit(X, -y).formula_
    assert other.classes_.tolist() == ["broken", "normal"]
    assert other.score(X, labels) == model().fit(X, -y).score(X, -y)
    with pytest.raises(ConfigurationError, match="positive is 'ok', which no trajectory has"):
        model(positive="ok").fit(X, labels)


def test_class_weights_by_the_labels_given():
    X, y = dips()
    by_name = model(class_weight={"a": 3.0, "b": 1.0}).fit(X, np.where(y == 1, "b", "a"))
    assert by_name.formula_ == model(class_weight={-1: 3.0, 1: 1.0}).fit(X, y).formula_
    with pytest.raises(ConfigurationError, match="class_weight has label 'c'; use 'a' and 'b'"):
        model(class_weight={"c": 2.0}).fit(X, np.where(y == 1, "b", "a"))


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (["a"] * 4, "there is only one label, 'a'"),
        ([1] * 4, "no trajectory has label -1"),
        ([1, 2, 3, 1], "there are 3 different labels, 1, 2, 3; use two"),
        ([1.0, np.nan, 1.0, 0.0], "a label is NaN"),
        ([1, 0, 1], r"labels have shape \(3,\) for 4 trajectories"),
        (np.array([1, "a", 1, "a"], dtype=object), "the labels are of several types"),
        (None, "there are no labels; give y"),
    ],
)
def test_wrong_labels(labels, message):
    with pytest.raises(DataError, match=message):
        model().fit(np.zeros((4, 3, 2)), labels)


def test_a_long_data_frame_gives_what_the_array_gives():
    X, y = dips()
    names = np.where(y == 1, "ok", "bad")
    frame = long_frame(X, names)
    fitted = model().fit(frame)
    assert fitted.formula_ == model().fit(X, y).formula_
    np.testing.assert_array_equal(fitted.predict(frame), fitted.predict(X))
    assert fitted.score(frame) == fitted.score(X, names)
    bare = frame.drop(columns="label")
    assert model().fit(bare, names).formula_ == fitted.formula_
    # the columns of new data may stand in another order
    swapped = bare[["trajectory", "y", "tick", "x"]]
    np.testing.assert_array_equal(fitted.predict(swapped), fitted.predict(X))
    with pytest.raises(DataError, match="no column 'y'; it has x"):
        fitted.predict(bare.drop(columns="y"))
    with pytest.raises(DataError, match="or a data frame with a column 'label'"):
        model().fit(bare)


def test_a_wrong_data_frame_is_named_to_the_row():
    X, y = dips(n=4)
    frame = long_frame(X, y)
    frame.loc[3, "label"] = -frame.loc[3, "label"]
    with pytest.raises(DataError, match="the data frame, row 3, column 'label'"):
        model().fit(frame)
    frame = long_frame(X, y)
    frame.loc[2, "y"] = np.nan
    with pytest.raises(DataError, match="the data frame, row 2, column 'y': nan is not finite"):
        model().fit(frame)
    with pytest.raises(DataError, match="has no column 'tick'"):
        model().fit(frame.drop(columns="tick"))


def test_trajectories_from_a_data_frame():
    X, y = dips(n=6)
    data = LabelledTrajectories.from_frame(long_frame(X, y, ids=list("abcdef")))
    np.testing.assert_array_equal(data.values, X)
    np.testing.assert_array_equal(data.labels, y)
    assert data.variables == ("x", "y")
    assert data.ids == tuple("abcdef")
    with pytest.raises(DataError, match="no column 'label'"):
        LabelledTrajectories.from_frame(long_frame(X))
    with pytest.raises(DataError, match="label"):
        LabelledTrajectories.from_frame(long_frame(X, np.where(y == 1, "ok", "bad")))


def test_cross_validation_of_scikit_learn():
    selection = pytest.importorskip("sklearn.model_selection")
    X, y = dips()
    scores = selection.cross_val_score(model(), X, np.where(y == 1, "ok", "bad"), cv=3)
    assert scores.shape == (3,)
    assert scores.mean() > 0.7
    predicted = selection.cross_val_predict(model(), X, y, cv=3)
    assert np.mean(predicted == y) > 0.7


def test_a_pipeline_and_a_search_in_it():
    pipeline = pytest.importorskip("sklearn.pipeline")
    preprocessing = pytest.importorskip("sklearn.preprocessing")
    selection = pytest.importorskip("sklearn.model_selection")
    X, y = dips()
    # the first steps take three dimensions and give them
    chain = pipeline.Pipeline([("scale", preprocessing.FunctionTransformer(lambda X: X * 0.1)), ("infer", model())])
    assert chain.fit(X, y).score(X, y) >= 0.9
    assert chain.predict(X).shape == (40,)
    assert chain.classes_.tolist() == [-1, 1]
    search = selection.GridSearchCV(chain, {"infer__depth": [1, 2]}, cv=2).fit(X, y)
    assert set(search.best_params_) == {"infer__depth"}
    assert search.best_estimator_.named_steps["infer"].formula_ is not None


def test_what_scikit_learn_asks_of_a_fitted_estimator():
    validation = pytest.importorskip("sklearn.utils.validation")
    exceptions = pytest.importorskip("sklearn.exceptions")
    X, y = dips()
    with pytest.raises(exceptions.NotFittedError):
        validation.check_is_fitted(model())
    fitted = model().fit(X, y)
    validation.check_is_fitted(fitted)
    assert fitted.n_features_in_ == 2
    heavy = np.where(fitted.predict(X) == y, 2.0, 1.0)
    right = np.count_nonzero(fitted.predict(X) == y)
    assert fitted.score(X, y, sample_weight=heavy) == pytest.approx(2 * right / (2 * right + 40 - right))


def test_the_representation_has_what_was_set():
    assert repr(MITLClassifier()) == "MITLClassifier()"
    assert repr(MITLClassifier(size=2, search="joint")) == "MITLClassifier(size=2, search='joint')"
