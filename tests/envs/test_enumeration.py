from __future__ import annotations

import threading
from collections import defaultdict
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.wrappers import TransformObservation, TransformReward
from hypothesis import given, settings
from hypothesis import strategies as st

from tickwise.envs.enumeration import tabulate
from tickwise.envs.planning import optimal_value
from tickwise.envs.tasks import TaskMonitor
from tickwise.envs.temporal import FormulaTask
from tickwise.envs.wrappers import Labelled, TimedTask
from tickwise.errors import ConfigurationError, DataError

LAKE = {"row": lambda s: s // 4, "column": lambda s: s % 4}
# row, column, passenger and destination are digits of the state's number
TAXI = {
    "row": lambda s: s // 100, "column": lambda s: s // 20 % 5, "passenger": lambda s: s // 4 % 5,
    "destination": lambda s: s % 4,
}  # fmt: skip


@pytest.mark.parametrize(("name", "features"), [("FrozenLake-v1", LAKE), ("Taxi-v4", TAXI), ("CliffWalking-v1", ["s"])])
def test_an_environments_own_table_is_read_as_it_is(name: str, features: Any):
    env = gymnasium.make(name)
    table: Any = env.unwrapped
    tabulation = tabulate(env, features)
    mdp = tabulation.mdp
    for s, a in np.ndindex(mdp.n_states, mdp.n_actions):
        expected, ours = defaultdict(float), defaultdict(float)
        for probability, following, reward, _ in table.P[s][a]:
            expected[int(following), float(reward)] += probability
        for probability, following, reward in zip(
            mdp.probability[s, a], mdp.successor[s, a], tabulation.reward[s, a], strict=True
        ):
            if probability > 0:
                ours[int(following), float(reward)] += probability
        assert ours == pytest.approx(expected)
    np.testing.assert_array_equal(mdp.initial, table.initial_state_distrib)
    assert tabulation.observations == tuple(range(len(table.P)))
    reachable, waiting = set(), set(np.flatnonzero(mdp.initial).tolist())
    while waiting:
        reachable |= waiting
        rows = [row for s in waiting for row in table.P[s].values()]
        assert all(over == tabulation.terminal[following] for row in rows for _, following, _, over in row)
        waiting = {int(f) for row in rows for _, f, _, over in row if not over} - reachable


@pytest.mark.parametrize(("name", "features"), [("FrozenLake-v1", LAKE), ("Taxi-v4", TAXI)])
def test_cells_have_the_features_of_their_states(name: str, features: Any):
    mdp = tabulate(gymnasium.make(name), features).mdp
    assert mdp.variables == tuple(features)
    expected = [[function(s) for function in features.values()] for s in range(mdp.n_states)]
    np.testing.assert_array_equal(mdp.coordinates, expected)
    assert mdp.limits == tuple((0.0, float(column.max())) for column in np.array(expected).T)


class Maze(gymnasium.Env[Any, Any]):
    """A random deterministic world; what of the state the observation tells, and what chance does, can be chosen."""

    def __init__(self, seed: int, states: int = 12, **wrong: Any) -> None:
        rng = np.random.default_rng(seed)
        self.successor = rng.integers(states, size=(states, 3))
        self.over = rng.random(states) < 0.2
        self.over[:2] = False
        self.gained = rng.integers(-3, 4, size=(states, 3)).astype(float)
        self.wrong = wrong
        self.action_space = spaces.Discrete(3, start=wrong.get("start", 0))
        self.observation_space = spaces.Discrete(states)
        self.state = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        del options
        self.state = int(self.np_random.integers(2))
        return self.told(), {}

    def told(self) -> int:
        return self.state % self.wrong.get("modulus", 10**6)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        reward = float(self.gained[self.state, action])
        self.state = int(self.successor[self.state, action])
        over = bool(self.over[self.state])
        if "reward" in self.wrong:
            reward += self.np_random.normal()
        if "end" in self.wrong:
            over = bool(self.np_random.random() < 0.5)
        if "walk" in self.wrong:
            self.state = int(self.np_random.integers(len(self.over)))
        return self.told(), reward, over, False, {}


@settings(max_examples=30)
@given(st.integers(0, 2**30))
def test_trying_every_action_finds_what_there_is(seed: int):
    maze = Maze(seed)
    tabulation = tabulate(maze, ["place"], seeds=range(8))
    starts = [maze.reset(seed=number)[0] for number in range(8)]
    expected = {*starts}
    while new := {int(f) for s in expected if not maze.over[s] for f in maze.successor[s]} - expected:
        expected |= new
    assert sorted(tabulation.observations) == sorted(expected)
    for number, s in enumerate(tabulation.observations):
        assert tabulation.terminal[number] == maze.over[s]
        assert tabulation.mdp.initial[number] == starts.count(s) / 8
        assert tabulation.mdp.coordinates[number].tolist() == [s]
        for action in range(3):
            following = tabulation.observations[tabulation.mdp.successor[number, action, 0]]
            assert following == (s if maze.over[s] else maze.successor[s, action])
            assert tabulation.reward[number, action, 0] == (0.0 if maze.over[s] else maze.gained[s, action])


def test_observations_of_any_kind_are_told_apart():
    kinds = {
        "dictionary": (spaces.Dict({"a": spaces.Discrete(12), "b": spaces.Text(3)}), lambda s: {"a": s, "b": "go"}),
        "tuple": (spaces.Tuple([spaces.Discrete(12)]), lambda s: (s,)),
        "vector": (spaces.Box(0, 12, (2,)), lambda s: np.array([s, 0], dtype=np.float32)),
    }
    plain = tabulate(Maze(3), ["place"])
    for space, told in kinds.values():
        first = {"place": lambda o: o["a"] if isinstance(o, dict) else o[0]}
        tabulation = tabulate(TransformObservation(Maze(3), told, space), first)
        np.testing.assert_array_equal(tabulation.mdp.successor, plain.mdp.successor)
        np.testing.assert_array_equal(tabulation.mdp.coordinates, plain.mdp.coordinates)


def at(observation: Any) -> np.ndarray:
    """Where a MiniGrid world's full picture shows the agent, which is object 10."""
    return np.argwhere(observation["image"][..., 0] == 10)[0]


def minigrid() -> Any:
    wrappers = pytest.importorskip("minigrid.wrappers")
    return wrappers.FullyObsWrapper(gymnasium.make("MiniGrid-Empty-5x5-v0"))


PLACES = {"i": lambda o: at(o)[0], "j": lambda o: at(o)[1], "heading": lambda o: o["direction"]}


@pytest.mark.parametrize("orientation", [(), ("heading",)])
def test_a_minigrid_world_goes_as_its_table_says(orientation: tuple[str, ...]):
    env = minigrid()
    tabulation = tabulate(env, PLACES, orientation=orientation)
    mdp, rng = tabulation.mdp, np.random.default_rng(0)
    # nine cells with four headings; the agent ends in the corner, where it comes looking right or down only
    assert mdp.n_cells == (9 if orientation else 34)
    assert sum(observation is not None for observation in tabulation.observations) == 34
    for _ in range(20):
        observation, _ = env.reset(seed=0)
        state, over = int(mdp.initial.argmax()), False
        for _ in range(60):
            assert tabulation.terminal[state] == over
            told = tabulation.observations[state]
            np.testing.assert_array_equal(told["image"], observation["image"])
            if over:
                break
            action = int(rng.integers(3))
            observation, _, over, *_ = env.step(action)
            state = int(mdp.successor[state, action, 0])


def test_an_orientation_is_laid_out_alike_in_every_cell():
    tabulation = tabulate(minigrid(), PLACES, orientation=["heading"])
    mdp = tabulation.mdp
    assert mdp.variables == ("i", "j")
    np.testing.assert_array_equal(mdp.cell, np.repeat(np.arange(9), 4))
    for number, observation in enumerate(tabulation.observations):
        if observation is None:  # never there: it stays where it is
            assert (mdp.successor[number] == number).all()
        else:
            assert int(observation["direction"]) == number % 4
            assert mdp.coordinates[number].tolist() == at(observation).tolist()


FORMULA = "F[0,4] (row >= 1) & F[5,9] (row >= 2) | G[0,8] (row <= 1)"


@pytest.mark.parametrize("ends", ["deadline", "violated", "decided"])
def test_a_timed_task_ends_where_the_environment_does(ends: Any):
    env = gymnasium.make("FrozenLake-v1")
    tabulation = tabulate(env, LAKE)
    task = FormulaTask(FORMULA, 12, reward=3.0, penalty=-1.0, ends=ends)
    monitor = TaskMonitor(tabulation.timed(task.table(tabulation.mdp)))
    ours = TimedTask(Labelled(env, LAKE), FORMULA, 12, 3.0, -1.0, ends)
    rng, rewards = np.random.default_rng(0), set()
    for episode in range(200):
        observation, _ = ours.reset(seed=episode)
        monitor.start(observation)
        over = False
        while not over:
            observation, reward, over, _, info = ours.step(int(rng.integers(4)))
            assert monitor.advance(observation) == (reward, over)
        assert monitor.success == info["is_success"]
        rewards.add(reward)
    assert rewards == {3.0, -1.0}


def test_the_optimum_of_an_environments_own_rewards_is_the_known_one():
    # without slipping, the goal is six steps away
    tabulation = tabulate(gymnasium.make("FrozenLake-v1", is_slippery=False), LAKE)
    assert [optimal_value(tabulation.mdp, tabulation.own_task(horizon)) for horizon in (5, 6, 50)] == [0.0, 1.0, 1.0]
    # with slipping, by backward induction over P itself
    env: Any = gymnasium.make("FrozenLake-v1").unwrapped
    values = np.zeros(16)
    for _ in range(20):
        values = np.array([
            max(sum(p * (r + (0 if over else values[f])) for p, f, r, over in row) for row in env.P[s].values())
            for s in range(16)
        ])  # fmt: skip
    tabulation = tabulate(env, LAKE)
    assert optimal_value(tabulation.mdp, tabulation.own_task(20)) == pytest.approx(values[0], abs=1e-9)


def test_a_reward_that_depends_on_more_than_where_one_arrives_is_no_task():
    with pytest.raises(DataError, match=r"depends on how it is reached; learn over steps with tickwise.rl.stepping"):
        tabulate(gymnasium.make("Taxi-v4"), TAXI).own_task(20)


@pytest.mark.parametrize(
    ("env", "arguments", "error", "message"),
    [
        (lambda: gymnasium.make("Pendulum-v1"), {}, ConfigurationError, r"actions are in Box.*numbers from 0"),
        (lambda: Maze(0, start=1), {}, ConfigurationError, r"start=1.*numbers from 0"),
        (lambda: Maze(0), {"orientation": ["heading"]}, ConfigurationError, "'heading' is no feature; use place"),
        (lambda: Maze(0), {"orientation": ["place"]}, ConfigurationError, "every feature is an orientation"),
        (lambda: Maze(0), {"seeds": ()}, ConfigurationError, "there is no seed"),
        (lambda: Maze(0), {"most": 2}, DataError, "more than 2 states; raise most, or learn over steps"),
        (lambda: gymnasium.make("FrozenLake-v1"), {"most": 2}, DataError, "more than 2 states"),
        (lambda: Maze(0, walk=True), {}, DataError, r"by chance.*learn over steps with tickwise\.rl\.stepping"),
        (lambda: Maze(0, reward=True), {}, DataError, "observations, rewards or ends by chance"),
        (lambda: Maze(0, end=True), {}, DataError, r"by chance|on one way and goes on on another"),
        (lambda: gymnasium.make("Blackjack-v1"), {}, DataError, r"by chance|on one way and goes on on another"),
        (
            lambda: TransformReward(gymnasium.make("FrozenLake-v1"), lambda reward: -reward), {},
            ConfigurationError, r"table of .*FrozenLakeEnv.* knows nothing of TransformReward; tabulate what is below",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_tabulated_is_refused(env: Any, arguments: Any, error: type[Exception], message: str):
    features = {"place": lambda o: np.ravel(o)[0]}
    with pytest.raises(error, match=message) as caught:
        tabulate(env(), features, **arguments)
    assert "\n" not in str(caught.value)


def test_an_observation_that_hides_the_state_is_found_out():
    # 0 and 2 are told alike and both reached from 1; from 0 everything leads to 1, and from 2 nowhere
    maze = Maze(0, states=4, modulus=2)
    maze.over[:] = False
    maze.successor[:] = [[1, 1, 1], [0, 2, 1], [2, 2, 2], [3, 3, 3]]
    with pytest.raises(DataError, match=r"leads on by how it was reached; let the observation tell the whole state"):
        tabulate(maze, ["place"])


def test_an_environment_that_cannot_be_copied_is_named():
    env = Maze(0)
    env.lock = threading.Lock()
    with pytest.raises(DataError, match=r"cannot be copied \(.*\), so that its states cannot be tried"):
        tabulate(env, ["place"])


def test_two_states_with_the_same_features_are_no_orientation():
    same = {"row": lambda s: s // 4, "turn": lambda _: 0}
    with pytest.raises(DataError, match="two states have the same features"):
        tabulate(gymnasium.make("FrozenLake-v1"), same, orientation=["turn"])


def test_an_own_table_that_ends_by_the_way_is_refused():
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    table: Any = env.unwrapped
    table.P[4][1] = [(1.0, 8, 0.0, True)]  # and from state 9 it goes on
    with pytest.raises(DataError, match="an episode ends in 8 on one way and goes on on another"):
        tabulate(env, LAKE)
