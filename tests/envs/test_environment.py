from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from tickwise.envs.catalog import CATALOG, EnvironmentSpec, register_all
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import ReachStayReach, TaskTable
from tickwise.errors import ConfigurationError
from tickwise.logic.syntax import Box

register_all()
NAMES = pytest.mark.parametrize("name", list(CATALOG))
Tick = tuple[int, float, bool]


def pick(probability: np.ndarray, uniform: float) -> int:
    total = 0.0
    for outcome, share in enumerate(probability.tolist()):
        total += share
        if uniform < total:
            return outcome
    return int(np.flatnonzero(probability)[-1])


def walk(mdp: TabularMDP, table: TaskTable, actions: Iterator[int], rng: np.random.Generator) -> Iterator[Tick]:
    """An episode on the arrays in plain Python: state, reward and end of every tick."""
    state = pick(mdp.initial, rng.random())
    task = table.delta[0, table.letter[state]]
    yield state, 0.0, False
    for tick in range(1, table.horizon + 1):
        action = next(actions)
        state = int(mdp.successor[state, action, pick(mdp.probability[state, action], rng.random())])
        task = table.delta[task, table.letter[state]]
        reward = float(table.reward[task, state])
        if tick == table.horizon:
            reward += float(table.final_reward[task])
        ended = bool(table.terminated[task]) or tick == table.horizon
        yield state, reward, ended
        if ended:
            return


@NAMES
def test_episodes_equal_a_walk_on_the_arrays(name: str):
    spec = CATALOG[name]
    mdp, table = spec.mdp(), spec.task_table()
    env = gymnasium.make(f"{name}-v0")
    rng, chooser = np.random.default_rng(12), np.random.default_rng(34)
    for episode in range(150):
        actions = chooser.choice(3, size=spec.task.deadline, p=(0.6, 0.2, 0.2))
        observation, information = env.reset(seed=12 if episode == 0 else None)
        for tick, (state, reward, ended) in enumerate(walk(mdp, table, iter(actions), rng)):
            if tick:
                observation, got, terminated, truncated, information = env.step(actions[tick - 1])
                assert (got, terminated, truncated) == (reward, ended, False)
            assert observation.tolist() == [*spec.world.place(state)]
            assert information["tick"] == tick
            assert information["state"] == state
            assert ("is_success" in information) == (tick > 0 and ended)
    assert env.unwrapped.np_random.random() == rng.random()  # not one number more was drawn


@NAMES
@pytest.mark.parametrize("render_mode", [None, "rgb_array", "ansi"])
def test_gymnasiums_checker_is_content(name: str, render_mode: str | None):
    for prefix in ("", "tickwise/"):
        env = gymnasium.make(f"{prefix}{name}-v0", render_mode=render_mode)
        check_env(env.unwrapped)
        env.close()


@NAMES
def test_seeds_reproduce(name: str):
    def episode(seed: int) -> list[Any]:
        env = gymnasium.make(f"{name}-v0")
        ticks: list[Any] = [env.reset(seed=seed)[1]["state"]]
        while len(ticks) == 1 or not ticks[-1][1]:
            _, reward, terminated, _, information = env.step(len(ticks) % 3)
            ticks.append((reward, terminated, information["state"]))
        return ticks

    assert episode(5) == episode(5)
    assert episode(5) != episode(6)


def test_a_fixed_start_and_certain_moves():
    """Without chance, five ticks in G and then two cells on to Y do the task at once; the reward waits."""
    corridor = EnvironmentSpec(
        "Corridor",
        GridWorld(4, slip=0.0, turn_failure=0.0),
        ReachStayReach(Box.of(x=(1, 2), y=(0, 1)), 2, Box.of(x=(3, 4), y=(0, 1)), deadline=6),
    )
    env = GridWorldEnv(corridor)
    observation, information = env.reset(options={"state": corridor.world.state(0, 0, 0)})
    assert (observation.tolist(), information) == ([0, 0, 0], {"tick": 0, "state": 0})
    steps = [env.step(action) for action in (0, 1, 2, 0, 0, 0)]
    assert [step[0].tolist() for step in steps] == [
        [1, 0, 0], [1, 0, 1], [1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 0, 0],
    ]  # fmt: skip
    assert [step[1] for step in steps] == [0, 0, 0, 0, 0, 100]
    assert [step[2] for step in steps] == [False] * 5 + [True]
    assert steps[-1][4]["is_success"] is True


def test_the_dynamics_can_be_changed():
    env = gymnasium.make("CaseStudy1Source-v0", slip=0.0, turn_failure=1.0).unwrapped
    assert env.specification.world == GridWorld(9, slip=0.0, turn_failure=1.0)
    assert env.reset(options={"state": 2})[0].tolist() == [0, 0, 2]
    assert env.step(1)[0].tolist() == [0, 0, 2]
    assert CATALOG["CaseStudy1Source"].world == GridWorld(9)


def test_the_checker_wrapper_and_vectors_are_content():
    envs = gymnasium.make_vec("CaseStudy2Source-v0", num_envs=3, vectorization_mode="sync")
    observations, _ = envs.reset(seed=1)
    assert observations.shape == (3, 3)
    for _ in range(40):  # past an end: reset follows by itself
        observations, rewards, *_ = envs.step(np.array([0, 1, 2]))
    assert observations.shape == (3, 3)
    assert rewards.shape == (3,)
    envs.close()


def test_a_copy_goes_its_own_way():
    env = GridWorldEnv("CaseStudy2Target")
    env.reset(seed=4)
    twin = copy.deepcopy(env)
    first = [env.step(0)[4] for _ in range(5)]
    assert [twin.step(0)[4] for _ in range(5)] == first


def test_misuse_is_refused():
    env = GridWorldEnv("CaseStudy2Source")
    with pytest.raises(ResetNeeded, match="call reset"):
        env.step(0)
    env.reset(seed=0)
    for action in (3, -1, "left"):
        with pytest.raises(ConfigurationError, match="there is no action"):
            env.step(action)
    ended = False
    while not ended:
        ended = env.step(1)[2]
    with pytest.raises(ResetNeeded, match="call reset"):
        env.step(0)
    with pytest.raises(ConfigurationError, match="no reset option 'start'; use 'state'"):
        env.reset(options={"start": 1})
    for state in (100, -1, 2.0, "north"):
        with pytest.raises(ConfigurationError, match=r"there is no state .*0 to 99"):
            env.reset(options={"state": state})
    with pytest.raises(ConfigurationError, match="there is no environment 'Maze'"):
        GridWorldEnv("Maze")
    with pytest.raises(ConfigurationError, match="render_mode is 'human'"):
        GridWorldEnv("CaseStudy2Source", render_mode="human")
    with pytest.raises(ConfigurationError, match="slip is 2"):
        GridWorldEnv("CaseStudy2Source", slip=2)
