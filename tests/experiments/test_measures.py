from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.experiments.measures import (
    episode_statistics,
    first_block,
    ratio,
    reached,
    return_statistics,
    stays,
)

EPISODES = np.array([0, 100, 200, 300, 400])


def returns(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float64)


@pytest.mark.parametrize(
    ("blocks", "expected"),
    [
        ([90, 95, 100, 80], 30),
        ([100, 0, 0], 10),
        ([96.4, 0], 10),  # at the optimum counts
        ([96.3, 96.39], None),
        ([], None),
    ],
)
def test_first_block_counts_to_the_end_of_the_block(blocks: list[float], expected: int | None):
    # 96.4 has no exact float32; the block of that mean must count all the same
    optimum = float(np.float32(96.4))
    assert first_block(np.array(blocks, dtype=np.float32), optimum, 10) == expected


@pytest.mark.parametrize(
    ("values", "first", "for_good"),
    [
        ((0, 9, 5, 8, 10), 100, 300),  # it falls back once
        ((8, 8, 8, 8, 8), 0, 0),
        ((0, 0, 0, 0, 8), 400, 400),
        ((9, 9, 9, 9, 7), 0, None),  # the last is below
        ((0, 1, 2, 3, 4), None, None),
    ],
)
def test_reached_and_stays(values: tuple[float, ...], first: int | None, for_good: int | None):
    assert reached(EPISODES, returns(*values), 8.0) == first
    assert stays(EPISODES, returns(*values), 8.0) == for_good


@given(st.lists(st.integers(0, 5), min_size=1, max_size=12), st.integers(0, 6))
def test_reached_and_stays_are_what_their_definitions_say(values: list[int], threshold: int):
    episodes = np.arange(len(values)) * 50
    good = [value >= threshold for value in values]
    first = next((50 * i for i in range(len(good)) if good[i]), None)
    for_good = next((50 * i for i in range(len(good)) if all(good[i:])), None)
    assert reached(episodes, returns(*values), threshold) == first
    assert stays(episodes, returns(*values), threshold) == for_good


def test_episode_statistics_of_runs_that_all_got_there():
    found = episode_statistics([10, 20, 60], seed=0)
    assert (found["mean"], found["median"], found["reached"]) == (30.0, 20.0, 3)
    assert 10 <= found["low"] < 30 < found["high"] <= 60
    assert found == episode_statistics([10, 20, 60], seed=0)


def test_episode_statistics_with_runs_that_did_not():
    nothing = {"mean": None, "low": None, "high": None}
    assert episode_statistics([10, None, 30], 0) == {**nothing, "median": 30.0, "reached": 2}
    assert episode_statistics([10, 20, 40, None], 0) == {**nothing, "median": 30.0, "reached": 3}
    # half of the runs is not enough for a median
    assert episode_statistics([10, None], 0) == {**nothing, "median": None, "reached": 1}
    assert episode_statistics([None, None], 0) == {**nothing, "median": None, "reached": 0}
    assert episode_statistics([], 0) == {**nothing, "median": None, "reached": 0}


@pytest.mark.parametrize("values", [[70], [70, 70, 70]])
def test_runs_that_agree_have_an_interval_of_one_point(values: list[int | None]):
    found = episode_statistics(values, 0)
    assert (found["mean"], found["low"], found["high"], found["median"]) == (70, 70, 70, 70)
    assert return_statistics([5.5], 0) == {"iqm": 5.5, "low": 5.5, "high": 5.5}


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end():
    found = return_statistics([0.0, 1.0, 2.0, 100.0], seed=3)
    assert found["iqm"] == 1.5
    assert 0 <= found["low"] < 1.5 < found["high"] <= 100
    assert return_statistics([1.0, 3.0], 0)["iqm"] == 2.0  # too few to leave out any


def test_ratio_of_means():
    assert ratio([100, 200], [10, 20], 1_000) == {"value": 10.0, "at_least": False}


def test_a_slow_run_that_did_not_get_there_makes_a_lower_bound():
    assert ratio([100, None], [10, 20], 500) == {"value": 20.0, "at_least": True}
    assert ratio([None, None], [10, 20], 450) == {"value": 30.0, "at_least": True}


def test_no_ratio_where_a_fast_run_did_not_get_there():
    assert ratio([100, 200], [10, None], 500) == {"value": None, "at_least": False}
    assert ratio([None, 200], [10, None], 500) == {"value": None, "at_least": True}
    assert ratio([], [], 500) == {"value": None, "at_least": False}


def test_no_episodes_count_as_one():
    assert ratio([100, 100], [0, 0], 500) == {"value": 100.0, "at_least": False}
    assert ratio([0, 0], [10, 10], 500) == {"value": 0.0, "at_least": False}
