from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.wrappers.slow import Replay, episodes, extended_state
from tests.envs.wrappers.worlds import frozen_lake
from tests.strategies import VARIABLES, sdnfs
from tickwise.envs.wrappers import ExtendedState, Labelled
from tickwise.envs.wrappers.labelled import FEATURES
from tickwise.errors import FormulaError, UnknownVariableError
from tickwise.logic.sdnf import SDNF


@settings(max_examples=60)
@given(sdnfs(), st.integers(0, 2**30), st.booleans())
def test_each_ticks_extended_state_is_that_of_the_run_by_definition(sdnf: SDNF, seed: int, reduce: bool):
    replayed = episodes(seed)
    env = ExtendedState(Labelled(Replay(replayed), VARIABLES), sdnf, reduce=reduce)
    for X in [*replayed, replayed[0]]:
        observation, info = env.reset()
        for tick in range(len(X)):
            if tick:
                observation, reward, terminated, truncated, info = env.step(0)
                assert reward == tick
                assert (terminated, truncated) == (tick == len(X) - 1, False)
            expected = extended_state(sdnf, X[: tick + 1], reduce=reduce)
            np.testing.assert_array_equal(observation["observation"], X[tick])
            assert observation["location"] == info["location"] == expected["location"]
            assert observation["clocks"].tolist() == info["clocks"].tolist() == expected["clocks"]
            assert info["stage"] == expected["stage"]
            assert info["verdict"] == expected["verdict"]
            assert env.observation_space.contains(observation)
            np.testing.assert_array_equal(info[FEATURES], X[tick])


@settings(max_examples=30)
@given(sdnfs(disjuncts=2, most=2, longest=2), st.integers(0, 2**30))
def test_all_forms_tell_the_same(sdnf: SDNF, seed: int):
    replayed = episodes(seed)
    numbered = gymnasium.wrappers.TransformObservation(
        Labelled(Replay(replayed), VARIABLES), lambda o: (2 * o + 10).astype(np.int64), spaces.MultiDiscrete([50, 50])
    )
    kinds = {form: ExtendedState(numbered, sdnf, form) for form in ("dict", "flat", "discrete")}
    seen: dict[int, tuple[Any, ...]] = {}
    for form, env in kinds.items():
        numbered.unwrapped.number = -1
        for number, X in enumerate(replayed):
            env.reset()
            for tick in range(1, len(X)):
                observation = env.step(0)[0]
                seen.setdefault((number, tick), ())
                seen[(number, tick)] += ((form, observation),)
    size = 50 * 50
    meaning: dict[int, tuple[Any, ...]] = {}
    for told in seen.values():
        each = dict(told)
        plain = tuple(each["dict"]["observation"]), int(each["dict"]["location"]), tuple(each["dict"]["clocks"])
        # a number stands for one triple of observation, location and clocks, and the other way round
        assert meaning.setdefault(int(each["discrete"]), plain) == plain
        assert int(each["discrete"]) % size == plain[0][0] * 50 + plain[0][1]
        one_hot = each["flat"][100 : 100 + int(kinds["dict"].observation_space["location"].n)]
        assert int(one_hot.argmax()) == plain[1]
    assert len(set(meaning.values())) == len(meaning)


def test_an_example_by_hand():
    # [2,5] is done at tick 2, when the row is 2; then [6,20] waits for the corner, and the one clock is the tick
    X = np.array([[0.0, 0], [1, 0], [2, 0], [3, 0], [3, 1]])
    env = ExtendedState(Labelled(Replay([X]), ("row", "column")), "F[2,5] (row >= 2) & F[6,20] (column >= 3)")
    _, info = env.reset()
    told = [info] + [env.step(0)[4] for _ in range(4)]
    assert [each["stage"] for each in told] == [0, 0, 1, 1, 1]
    assert [each["clocks"].tolist() for each in told] == [[0], [1], [2], [3], [4]]
    assert [each["verdict"] for each in told] == [0] * 5
    assert all(isinstance(each[key], int) for each in told for key in ("location", "stage", "verdict", "table_state"))


def test_what_info_tells_is_not_changed_by_who_writes_to_it():
    env = ExtendedState(frozen_lake(), "F[2,5] (row >= 2)")
    _, info = env.reset(seed=0)
    info["clocks"][:] = 99
    assert env.reset(seed=0)[1]["clocks"].tolist() == [0]


def test_a_formula_that_does_not_fit_is_refused():
    with pytest.raises(UnknownVariableError, match="'x' is no feature; the features are row, column"):
        ExtendedState(frozen_lake(), "F[2,5] (x >= 2)")
    with pytest.raises(FormulaError):
        ExtendedState(frozen_lake(), "F[2,5] (row >= 2) & F[3,5] (row >= 2)")


def test_a_feature_that_is_nan_is_named():
    env = ExtendedState(Labelled(Replay([np.array([[0.0, 0], [1, math.nan]])]), VARIABLES), "F[2,5] (x >= 2)")
    env.reset()
    with pytest.raises(ValueError, match="feature 'y' is NaN"):
        env.step(0)
