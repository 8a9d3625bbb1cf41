import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.explanation import Confusion
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.validation import (
    cross_validate,
    error_interval,
    hold_out,
    stratified_folds,
    stratified_holdout,
)

LABELS = st.lists(st.sampled_from([1, -1]), min_size=8, max_size=60).filter(lambda y: 4 <= y.count(1) <= len(y) - 4)


@given(LABELS, st.integers(2, 4), st.integers(0, 9))
def test_folds_share_out_each_label(labels, folds, seed):
    labels = np.array(labels)
    parts = stratified_folds(labels, folds, seed)
    assert sorted(np.concatenate(parts).tolist()) == list(range(len(labels)))
    for rows in (labels == 1, labels == -1, np.ones(len(labels), bool)):
        counts = [int(rows[part].sum()) for part in parts]
        assert max(counts) - min(counts) <= 1
    again = stratified_folds(labels, folds, seed)
    assert all(np.array_equal(*pair) for pair in zip(parts, again, strict=True))


@given(LABELS, st.floats(0.01, 0.99), st.integers(0, 9))
def test_a_holdout_keeps_the_proportions(labels, share, seed):
    labels = np.array(labels)
    rows = stratified_holdout(labels, share, seed)
    assert len(np.unique(rows)) == len(rows)
    for label in (1, -1):
        count, chosen = int((labels == label).sum()), int((labels[rows] == label).sum())
        assert 1 <= chosen <= count - 1
        assert abs(chosen - share * count) <= 1


def test_another_seed_holds_out_others():
    labels = np.repeat([1, -1], 50)
    assert stratified_holdout(labels, 0.2, 0).tolist() != stratified_holdout(labels, 0.2, 1).tolist()
    assert stratified_folds(labels, 5, 0)[0].tolist() != stratified_folds(labels, 5, 1)[0].tolist()


@pytest.mark.parametrize(("wrong", "count"), [(0, 10), (3, 40), (10, 10), (1, 2000)])
def test_wilsons_interval(wrong, count):
    # the two solutions p of (wrong / count - p)² = z² p (1 - p) / count
    z, share = 1.959963984540054, wrong / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    assert error_interval(wrong, count) == pytest.approx((middle - half, middle + half), abs=1e-12)


@pytest.fixture(scope="module")
def data():
    """Label 1 iff x is at least 5 at tick 2; three of forty have the other label."""
    rng = np.random.default_rng(1)
    X = rng.uniform(0, 10, (40, 4, 1))
    X[:20, 2], X[20:, 2] = rng.uniform(6, 10, (20, 1)), rng.uniform(0, 4, (20, 1))
    y = np.repeat([1, -1], 20)
    y[[0, 5, 30]] *= -1
    return LabelledTrajectories.from_arrays(X, y, ("x",))


MODEL = MITLClassifier(depth=1, variables=("x",), rate=0.9)


def test_held_out_trajectories_are_not_learned_from(data):
    fitted, judged = hold_out(MODEL, data, 0.25, seed=3)
    assert not hasattr(MODEL, "formula_")
    rows = judged.trials[0].rows
    states, labels = data.values[rows], data.labels[rows]
    assert judged.confusion == Confusion.of(labels, fitted.predict(states))
    kept = np.setdiff1d(np.arange(40), rows)
    alone = MITLClassifier(**MODEL.get_params()).fit(data.values[kept], data.labels[kept])
    assert alone.formula_ == fitted.formula_
    assert judged.sentence().startswith("held-out error ")
    assert "one held-out sample" in judged.note


def test_cross_validation_pools_the_predictions_of_all_folds(data):
    seen = []
    judged = cross_validate(MODEL, data, 4, seed=3, report=lambda number, trial: seen.append((number, trial)))
    assert [number for number, _ in seen] == [1, 2, 3, 4]
    assert tuple(trial for _, trial in seen) == judged.trials
    # the same by hand: each fold predicted by a model of the others
    predicted = np.zeros(40, dtype=int)
    for rows in stratified_folds(data.labels, 4, 3):
        kept = np.setdiff1d(np.arange(40), rows)
        fitted = MITLClassifier(**MODEL.get_params()).fit(data.values[kept], data.labels[kept])
        predicted[rows] = fitted.predict(data.values[rows])
    assert judged.confusion == Confusion.of(data.labels, predicted)
    wrong = np.flatnonzero(predicted != data.labels)
    assert {mistake.id for _, mistake in judged.mistakes()} == {str(row) for row in wrong}
    assert judged.interval == error_interval(len(wrong), 40)
    document = judged.document()
    assert document["error"] == len(wrong) / 40
    assert {entry["trial"] for entry in document["misclassified"]} <= {1, 2, 3, 4}


def test_wrong_requests():
    labels = np.array([1, 1, -1])
    with pytest.raises(ConfigurationError, match="folds is 1; use 2 or more"):
        stratified_folds(labels, 1)
    with pytest.raises(DataError, match="label -1 has 1 trajectory for 2 folds"):
        stratified_folds(labels, 2)
    with pytest.raises(DataError, match="label -1 has one trajectory alone"):
        stratified_holdout(labels, 0.5)
    for share in (0.0, 1.0, float("nan")):
        with pytest.raises(ConfigurationError, match="use a share between 0 and 1"):
            stratified_holdout(labels, share)
