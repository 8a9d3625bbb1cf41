from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.experiments.measures import (
    block_means,
    difference_statistics,
    episode_statistics,
    final_mean,
    goal_reached,
    ratio,
    reached,
    return_statistics,
    settled,
    stays,
)
from tickwise.experiments.study import Goal

EPISODES = np.array([0, 100, 200, 300, 400])


def returns(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float64)


@pytest.mark.parametrize(
    ("blocks", "expected"),
    [
        ([90, 95, 100, 80], 60),
        ([100, 0, 0], 20),
        ([96.4, 0], 20),  # at the optimum counts
        ([96.3, 96.39], None),
        ([], None),
    ],
)
def test_the_goal_counts_to_the_end_of_the_block(blocks: list[float], expected: int | None):
    # 96.4 has no exact float32; the block of that mean must count all the same
    optimum = float(np.float32(96.4))
    episodes = np.repeat(np.array(blocks, dtype=np.float32), 20)
    assert goal_reached(episodes, Goal(block=20), optimum) == expected


def test_a_goal_of_one_episode_has_to_be_exceeded():
    episodes = np.array([-800, 1_000, 900, 1_100, 2_000], dtype=np.float32)
    assert goal_reached(episodes, Goal(block=1, above=1_000.0), 2_012.0) == 4
    assert goal_reached(episodes, Goal(block=1, above=2_000.0), 2_012.0) is None
    # blocks of two: 100, 1000; the last episode is no whole block
    assert goal_reached(episodes, Goal(block=2, above=500.0), 2_012.0) == 4


def test_block_means_leave_out_a_part_of_a_block():
    assert block_means(np.array([1, 3, 5, 7, 100], dtype=np.float32), 2).tolist() == [2.0, 6.0]


def test_training_has_settled_near_its_end():
    # 100 a block from the 300th of 1,000 blocks of 10 episodes on, and 0 before; failing is -100. The threshold is
    # -100 + 0.95 * 200 = 90, which the mean of 50 blocks first has when 45 of them are good: blocks 295 to 344
    blocks = np.where(np.arange(1_000) >= 300, 100.0, 0.0).astype(np.float32)
    assert final_mean(blocks) == 100.0
    assert settled(blocks, 10, -100.0) == 2_950
    assert settled(np.full(7, 3.0, dtype=np.float32), 10, -10.0) == 0
    # it got worse: the best that it ever was is above the threshold from the start
    assert settled(np.arange(100, 0, -1, dtype=np.float32), 10, 0.0) == 0


@given(st.lists(st.integers(-800, 2_000), min_size=1, max_size=200))
def test_training_always_settles(values: list[int]):
    assert 0 <= settled(np.array(values, dtype=np.float32), 10, -800.0) < 10 * len(values)


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


def test_the_difference_of_means_and_its_noise():
    found = difference_statistics([3.0, 5.0], [1.0, 1.0, 1.0], 0)
    assert (found["value"], found["low"], found["high"]) == (3.0, 2.0, 4.0)  # the means of 3 and 5 drawn twice
    assert difference_statistics([3.0, 3.0], [1.0, 1.0], 0) == {"value": 2.0, "low": 2.0, "high": 2.0}
    assert difference_statistics([3.0], [1.0, 2.0], 0) == {"value": 1.5, "low": None, "high": None}
