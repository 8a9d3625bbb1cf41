"""The C references do what the compiled loops do; they are skipped without a compiler."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmarks.contest import UnavailableError
from benchmarks.native import library

from benchmarks import counting, learning, monitoring, planning


@pytest.fixture(autouse=True)
def _compiler():
    try:
        library("learning")
    except UnavailableError as error:
        pytest.skip(str(error))


def test_learning_and_playing():
    problem = learning.build_problem(9)
    ours, c = learning.ours(problem, 200), learning.in_c(problem, 200)
    for _ in range(2):  # both go on where they were
        assert ours().tobytes() == c().tobytes()
    q = ours()
    play, play_c = learning.play_ours(problem, q, 50), learning.play_in_c(problem, q, 50)
    for _ in range(2):
        assert play().tobytes() == play_c().tobytes()


def test_planning():
    spec = learning.world_spec(9)
    mdp, task = spec.mdp(), spec.task_table()
    np.testing.assert_array_equal(planning.ours(mdp, task)(), planning.in_c(mdp, task)())


@pytest.mark.parametrize(("size", "horizon"), [(9, 40), (9, 130), (12, 40)])
def test_counting(size: int, horizon: int):
    case = counting.Case(size, horizon)
    expected = case.ours()()
    assert expected < -1
    assert math.isclose(case.in_c()(), expected, rel_tol=1e-12)
    assert math.isclose(case.in_scipy()(), expected, rel_tol=1e-9)


@pytest.mark.parametrize("ticks", [10, 41, 100])
def test_monitoring(ticks: int):
    windows, states = monitoring.Windows.fitting(ticks), monitoring.walks(500, ticks)
    expected = monitoring.verdicts(windows, states)()
    assert 0 < expected.sum() < 500
    np.testing.assert_array_equal(monitoring.in_c(windows, states)(), expected)
    np.testing.assert_array_equal(monitoring.robustness(windows, states)() > 0, expected)
