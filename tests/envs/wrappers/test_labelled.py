from __future__ import annotations

import math
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from tests.envs.wrappers.worlds import cart_pole, frozen_lake, gridworld, random_episodes
from tickwise.envs.wrappers import Labelled
from tickwise.envs.wrappers.labelled import FEATURES, Features, feature_names
from tickwise.errors import ConfigurationError, DataError


def test_features_are_those_of_the_observation_at_every_tick():
    for episode in random_episodes(frozen_lake(), 20, seed=0):
        for observation, *_, info in episode:
            assert info[FEATURES].tolist() == [*divmod(observation, 4)]
            assert "prob" in info  # what the environment tells stays


def test_names_alone_are_those_of_the_entries():
    for make in (cart_pole, gridworld):
        env = make()
        for episode in random_episodes(env, 2, seed=0):
            for observation, *_, info in episode:
                assert info[FEATURES].dtype == np.float64
                np.testing.assert_array_equal(info[FEATURES], np.asarray(observation, dtype=np.float64))
    assert Features(["n"], spaces.Discrete(3))(2).tolist() == [2.0]


def test_the_environment_is_not_changed():
    plain = gymnasium.make("FrozenLake-v1")
    for ours, theirs in zip(random_episodes(frozen_lake(), 5, 7), random_episodes(plain, 5, 7), strict=True):
        assert [row[:4] for row in ours] == [row[:4] for row in theirs]


# from Python 3.12 on, of any process with threads
forks = pytest.mark.filterwarnings("ignore:.*use of fork.*:DeprecationWarning")


@forks
def test_the_names_are_found_below_other_wrappers_and_in_vectors():
    env = gymnasium.wrappers.RecordEpisodeStatistics(frozen_lake())
    assert feature_names(env, "It") == ("row", "column")
    with closing(SyncVectorEnv([frozen_lake] * 2)) as several:
        assert feature_names(several, "It") == ("row", "column")
    with closing(AsyncVectorEnv([lambda: gymnasium.wrappers.TimeAwareObservation(cart_pole())])) as several:
        assert feature_names(several, "It") == ("position", "velocity", "angle", "turning")
        several.reset()  # asking has not ended it


@forks
def test_what_has_no_names_is_told_how_to_get_them():
    with pytest.raises(ConfigurationError, match="It needs named features; wrap"):
        feature_names(gymnasium.make("FrozenLake-v1"), "It")
    for vector in (SyncVectorEnv, AsyncVectorEnv):
        with closing(vector([lambda: gymnasium.make("FrozenLake-v1")] * 2)) as several:
            with pytest.raises(ConfigurationError, match="It needs named features; wrap"):
                feature_names(several, "It")
            several.reset()


@pytest.mark.parametrize(
    ("given", "space", "message"),
    [
        ([], spaces.Discrete(3), r"features are \[\]"),
        ("x", spaces.Discrete(3), "features are 'x'; give a list of names"),
        (["x", "x"], spaces.Box(0, 1, (2,)), "name occurs twice in x, x"),
        (["x"], spaces.Box(0, 1, (2,)), r"1 names \(x\) for 2 entries"),
        (["x"], spaces.Box(0, 1, (2, 2)), "is no vector"),
        (["x"], spaces.Dict({"a": spaces.Discrete(2)}), "is no vector"),
        ([1], spaces.Discrete(3), "a feature's name is 1; use text"),
        ({"x": 3}, spaces.Discrete(3), "is no function"),
    ],
)
def test_features_that_do_not_fit_are_refused(given: Any, space: Any, message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        Features(given, space)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("given", "observation", "message"),
    [
        ({"x": lambda _: 1.0, "y": lambda _: math.nan}, 0, "feature 'y' is NaN"),
        ({"x": lambda _: "left"}, 0, "feature 'x' is 'left'; let its function give one number"),
        ({"x": lambda _: np.zeros(2)}, 0, "feature 'x' is array"),
        ({"x": lambda _: None}, 0, "feature 'x' is None"),
        (["x", "y"], np.zeros(3), r"shape \(3,\) has no entries x, y"),
    ],
)
def test_features_that_are_no_numbers_are_refused(given: Any, observation: Any, message: str):
    features = Features(given, spaces.Box(0, 1, (2,)))
    with pytest.raises(DataError, match=message) as caught:
        features(observation)
    assert "\n" not in str(caught.value)


def test_an_error_in_a_users_function_stays_what_it_is():
    env = Labelled(gymnasium.make("FrozenLake-v1"), {"x": lambda s: {}[s]})
    with pytest.raises(KeyError):
        env.reset()
