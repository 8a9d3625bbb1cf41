from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.envs.wrappers.slow import Replay
from tests.envs.wrappers.worlds import frozen_lake, minigrid_places
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.temporal import ENDINGS, FormulaTask
from tickwise.envs.wrappers import ExtendedState, Labelled, TimedTask
from tickwise.errors import ConfigurationError, UnknownVariableError

CENTRES = {"x": lambda o: o[0] + 0.5, "y": lambda o: o[1] + 0.5}
FORMULA = "F[0,4] G[0,2] (1 <= x <= 3) & F[8,12] (y >= 2) | G[0,9] (y >= 1)"


@pytest.mark.parametrize("ends", list(ENDINGS))
def test_it_is_what_the_same_formula_is_as_a_gridworlds_hidden_task(ends: Any):
    world = GridWorld(4)
    task = FormulaTask(FORMULA, 14, reward=5.0, penalty=-2.0, ends=ends)
    theirs = GridWorldEnv(EnvironmentSpec("Hidden", world, task))
    long = FormulaTask("F[0,90] (x >= 0)", 99)
    ours = TimedTask(
        Labelled(GridWorldEnv(EnvironmentSpec("Plain", world, long)), CENTRES), FORMULA, 14, 5.0, -2.0, ends
    )
    chooser, rewards, successes = np.random.default_rng(0), [], []
    for episode in range(150):
        assert ours.reset(seed=episode)[0].tolist() == theirs.reset(seed=episode)[0].tolist()
        over = False
        while not over:
            action = int(chooser.choice(3, p=(0.6, 0.2, 0.2)))
            observation, reward, over, truncated, info = ours.step(action)
            expected = theirs.step(action)
            assert observation.tolist() == expected[0].tolist()
            assert (reward, over, truncated) == expected[1:4]
            assert info.get("is_success") == expected[4].get("is_success")
        rewards.append(reward)
        successes.append(info["is_success"])
    assert set(rewards) == {5.0, -2.0}
    assert [reward > 0 for reward in rewards] == successes


def played(env: Any) -> list[tuple[Any, ...]]:
    env.reset()
    ticks = [env.step(0)]
    while not (ticks[-1][2] or ticks[-1][3]):
        ticks.append(env.step(0))
    return [(reward, terminated, truncated, info.get("is_success")) for _, reward, terminated, truncated, info in ticks]


def walk(*values: float) -> np.ndarray:
    return np.array([[value, 0.0] for value in values])


@pytest.mark.parametrize(
    ("values", "cut", "expected"),
    [
        # decided at tick 2; what tick 0 decides is paid at tick 1
        ((0, 0, 5, 0, 0), False, [(0.0, False, False, None), (3.0, True, False, True)]),
        ((5, 0, 0, 0, 0), False, [(3.0, True, False, True)]),
        # the window closes at tick 3
        ((0, 0, 0, 0, 0), False, [(0.0, False, False, None)] * 2 + [(-1.0, True, False, False)]),
        # the environment's own end comes first, undecided; all is given then, even where a time limit cut it off
        ((0, 0), False, [(-1.0, True, False, False)]),
        ((0, 0), True, [(-1.0, True, True, False)]),
        ((0, 5), True, [(3.0, True, True, True)]),
    ],
)
def test_episodes_by_hand(values: tuple[float, ...], cut: bool, expected: list[Any]):
    env = TimedTask(Labelled(Replay([walk(*values)], cut), ("x", "y")), "F[0,3] (x >= 5)", 4, 3.0, -1.0)
    assert played(env) == expected
    assert played(env) == expected  # the second episode begins anew


def test_the_deadline_ends_what_nothing_else_does():
    env = TimedTask(Labelled(Replay([walk(*[5.0] * 9)]), ("x", "y")), "F[0,3] (x >= 5)", 4, ends="deadline")
    assert played(env) == [(0.0, False, False, None)] * 3 + [(1.0, True, False, True)]


@pytest.mark.parametrize("make", [frozen_lake, minigrid_places])
@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version.*:UserWarning")
def test_checkers_find_nothing_wrong(make: Any):
    env = make()
    formula = f"F[0,9] ({env.get_wrapper_attr('feature_names')[0]} >= 2)"
    env = ExtendedState(TimedTask(env, formula, 9), formula, "flat")
    check_env(env, skip_render_check=True)
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(env, skip_render_check=True)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (("F[0,9] (row >= 2)", 8), ConfigurationError, "effect until tick 9, past the deadline 8; use .* 9 or more"),
        (("F[0,9] (row >= 2)", 0), ConfigurationError, "deadline"),
        (("F[0,9] (row >= 2)", 9, 1.0, 0.0, "never"), ConfigurationError, "no end of an episode 'never'"),
        (("F[0,9] (depth >= 2)", 9), UnknownVariableError, "'depth' is no feature"),
    ],
)
def test_what_does_not_fit_is_refused(arguments: Any, error: type[Exception], message: str):
    with pytest.raises(error, match=message) as caught:
        TimedTask(frozen_lake(), *arguments)
    assert "\n" not in str(caught.value)
    with pytest.raises(ConfigurationError, match="TimedTask needs named features"):
        TimedTask(gymnasium.make("FrozenLake-v1"), "F[0,9] (row >= 2)", 9)
