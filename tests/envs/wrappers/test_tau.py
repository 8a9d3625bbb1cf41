from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.wrappers.worlds import cart_pole, frozen_lake, gridworld, random_episodes
from tickwise.envs.wrappers import TauState
from tickwise.errors import ConfigurationError


@settings(max_examples=25)
@given(st.integers(1, 6), st.integers(0, 2**30))
def test_a_tau_state_is_the_last_tau_observations(tau: int, seed: int):
    plain, env = frozen_lake(), TauState(frozen_lake(), tau)
    for ours, theirs in zip(random_episodes(env, 3, seed), random_episodes(plain, 3, seed), strict=True):
        history = [0] * tau + [observation + 1 for observation, *_ in theirs]
        for tick, (state, *rest) in enumerate(ours):
            assert state.tolist() == history[tick + 1 : tick + 1 + tau]
            assert env.observation_space.contains(state)
            assert rest[:3] == list(theirs[tick][1:4])


def test_several_whole_numbers_are_one():
    env = TauState(gridworld(), 2)
    plain = gridworld()
    for ours, theirs in zip(random_episodes(env, 2, 0), random_episodes(plain, 2, 0), strict=True):
        assert [state[-1] - 1 for state, *_ in ours] == [i * 36 + j * 4 + heading for (i, j, heading), *_ in theirs]


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version.*:UserWarning")
def test_checkers_find_nothing_wrong():
    check_env(TauState(frozen_lake(), 3), skip_render_check=True)
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(TauState(gridworld(), 3), skip_render_check=True)


def test_it_is_made_anew_from_its_specification():
    again = gymnasium.make(TauState(gymnasium.make("FrozenLake-v1"), 3).spec)
    assert np.array_equal(again.observation_space.nvec, [17] * 3)


@pytest.mark.parametrize("tau", [0, -1, 1.5, True, "5"])
def test_a_horizon_that_is_none_is_refused(tau: Any):
    with pytest.raises(ConfigurationError, match=r"horizon of τ-states is .*; use a whole number"):
        TauState(frozen_lake(), tau)


def test_what_is_not_finite_is_refused():
    with pytest.raises(ConfigurationError, match="TauState needs observations that are whole numbers"):
        TauState(cart_pole())
