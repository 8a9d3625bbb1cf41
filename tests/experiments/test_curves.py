"""Learning curves as numbers, for the figure and for the page."""

from __future__ import annotations

import numpy as np
import pytest

from tests.experiments import synthetic
from tickwise.experiments.curves import curve_data, evaluation_curve, interval, training_curve

SPEC = synthetic.small()


def test_curves_average_blocks_and_evaluations():
    runs = [
        {
            "blocks": np.arange(5_000, dtype=np.float32) + 10 * run,
            "evaluation_episodes": np.array([0, 100, 200, 1_000]),
            "evaluation_returns": np.array([-10.0, 1.0, 2.0, 3.0]) + run,
        }
        for run in range(2)
    ]
    episodes, returns = training_curve(runs, 10, 50_000)
    assert episodes[:2].tolist() == [250, 750]
    assert returns[:, 0].tolist() == [24.5, 34.5]  # the mean of blocks 0 to 49
    assert returns.shape == (2, 100)
    episodes, returns = evaluation_curve(runs)
    assert episodes.tolist() == [100, 200, 1_000]
    assert returns.tolist() == [[1, 2, 3], [2, 3, 4]]


def test_curves_of_few_episodes():
    runs = [{"blocks": np.array([1.0, 3.0]), "evaluation_episodes": np.array([0]), "evaluation_returns": np.ones(1)}]
    _, returns = training_curve(runs, 10, 50_000)
    assert returns.tolist() == [[2.0]]
    episodes, returns = evaluation_curve(runs)
    assert (episodes.shape, returns.shape) == ((0,), (1, 0))


def test_the_interval_holds_the_mean_and_is_a_point_for_equal_runs():
    rows = np.random.default_rng(1).normal(size=(10, 50))
    low, high = interval(rows)
    assert (low < rows.mean(axis=0)).all()
    assert (rows.mean(axis=0) < high).all()
    same = interval(np.full((4, 3), 7.0))
    assert np.allclose(same, 7.0)


def test_the_page_gets_the_figures_curves_and_closer_ones():
    results = synthetic.results(SPEC)
    data = curve_data(results, SPEC)
    assert data is not None
    assert (data["optimum"], data["worst"]) == (synthetic.V_STAR, -10.0)
    training, greedy = data["charts"]
    assert training["limits"] == [0, 50_000]
    assert greedy["limits"] == [100, 60_000]
    coarse, fine = training["levels"]
    assert list(coarse) == list(synthetic.METHODS)
    assert (len(coarse["III"]["x"]), len(fine["III"]["x"])) == (100, 500)
    episodes, rows = training_curve(results["methods"]["III"], 10, 50_000)
    low, high = interval(rows)
    for name, values in (("x", episodes), ("mean", rows.mean(axis=0)), ("low", low), ("high", high)):
        assert coarse["III"][name] == pytest.approx(values.tolist(), abs=0.051)
    # five neighbours of the closer curve have the mean of one point of the other
    assert np.reshape(fine["III"]["mean"], (100, 5)).mean(axis=1) == pytest.approx(coarse["III"]["mean"], abs=0.11)


def test_nothing_learned_gives_no_curves():
    assert curve_data(synthetic.results(SPEC, methods=()), SPEC) is None


def test_a_single_evaluation_gives_no_chart_of_them():
    results = synthetic.results(SPEC, methods=("III",))
    for run in results["methods"]["III"]:
        run["evaluation_episodes"], run["evaluation_returns"] = np.array([0]), np.array([1.0])
    data = curve_data(results, SPEC)
    assert data is not None
    assert [chart["title"] for chart in data["charts"]] == ["Training"]
