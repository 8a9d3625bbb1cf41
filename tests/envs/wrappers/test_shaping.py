from __future__ import annotations

import copy
from fractions import Fraction
from functools import cache
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.wrappers.slow import Replay
from tests.envs.wrappers.worlds import frozen_lake
from tests.strategies import VARIABLES, sdnfs
from tickwise.automata.distance import acceptance_potential
from tickwise.automata.monitor import Monitor
from tickwise.envs.wrappers import ExtendedState, Labelled, PotentialShaping
from tickwise.errors import ConfigurationError
from tickwise.logic.sdnf import SDNF
from tickwise.rl.qlearning import QSettings
from tickwise.rl.qtable import QTable
from tickwise.rl.stepping import learn_by_steps

STATES, ACTIONS = 3, 2
CHANCES = Fraction(1, 4), Fraction(3, 4)
formulas = sdnfs(most=2, disjuncts=2, longest=2)
seeds = st.integers(0, 2**30)


class Chances(gymnasium.Env[Any, Any]):
    """A random world of three states; each action has two outcomes, of 1/4 and 3/4, and a reward for each."""

    observation_space = spaces.Discrete(STATES)
    action_space = spaces.Discrete(ACTIONS)

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.successor = rng.integers(STATES, size=(STATES, ACTIONS, 2))
        self.gained = rng.integers(-4, 5, size=self.successor.shape)
        self.place = rng.integers(-1, 7, size=(STATES, 2)).astype(float)
        self.state, self.outcome = 0, None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        del options
        self.state = int(self.np_random.integers(STATES))
        return self.state, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        outcome = int(self.np_random.random() < CHANCES[1]) if self.outcome is None else self.outcome
        reward = float(self.gained[self.state, action, outcome])
        self.state = int(self.successor[self.state, action, outcome])
        return self.state, reward, False, False, {}


class Decided(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Ends with the verdict, and pays for it."""

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, reward, _, truncated, info = self.env.step(action)
        return observation, float(reward) + 8 * info["verdict"], info["verdict"] != 0, truncated, info


def product(sdnf: SDNF, seed: int) -> tuple[gymnasium.Env[Any, Any], np.ndarray]:
    """A random world whose reward depends on the formula, and a random potential of whole numbers."""
    place = Chances(seed).place
    names = {name: (lambda s, column=column: place[s, column]) for column, name in enumerate(VARIABLES)}
    extended = ExtendedState(Labelled(Chances(seed), names), sdnf, "discrete")
    count = sum(len(table) for table in extended.monitor.tables)
    return Decided(extended), np.random.default_rng(seed).integers(-16, 17, size=count).astype(float)


def transitions(env: gymnasium.Env[Any, Any]) -> dict[Any, dict[tuple[int, int], tuple[Fraction, Fraction, Any]]]:
    """Of each state that is reached, the reward without and with shaping and the next state, by action and outcome.

    A state is that of the world, the automaton's and the tick; None comes after the end.
    """
    worlds: dict[Any, gymnasium.Env[Any, Any]] = {}
    found: dict[Any, dict[tuple[int, int], tuple[Fraction, Fraction, Any]]] = {}

    def key(world: Any, info: dict[str, Any], tick: int) -> Any:
        place = world.unwrapped.state, info["table_state"], tick
        worlds.setdefault(place, world)
        return place

    for seed in range(6):
        world = copy.deepcopy(env)
        key(world, world.reset(seed=seed)[1], 0)
    while found.keys() != worlds.keys():
        state = next(place for place in worlds if place not in found)
        found[state] = {}
        for action, outcome in np.ndindex(ACTIONS, 2):
            after: Any = copy.deepcopy(worlds[state])
            after.unwrapped.outcome = outcome
            _, shaped, over, _, info = after.step(action)
            following = None if over else key(after, info, state[2] + 1)
            found[state][action, outcome] = Fraction(info["unshaped_reward"]), Fraction(shaped), following
    return found


@settings(max_examples=15)
@given(formulas, seeds)
def test_the_optimal_policies_stay_the_same(sdnf: SDNF, seed: int):
    env, potential = product(sdnf, seed)
    gamma = Fraction(1, 2)
    found = transitions(PotentialShaping(env, 0.5, potential=potential))

    @cache
    def values(state: Any, shaped: bool) -> list[Fraction]:
        """Q*, exactly: what each action of a state is worth."""
        expected = []
        for action in range(ACTIONS):
            total = Fraction(0)
            for outcome, chance in enumerate(CHANCES):
                *rewards, following = found[state][action, outcome]
                later = Fraction(0) if following is None else max(values(following, shaped))
                total += chance * (rewards[shaped] + gamma * later)
            expected.append(total)
        return expected

    for state in found:
        level = Fraction(potential[state[1]])
        # the values of all actions of a state are lower by its potential, so that the best ones are the best ones still
        assert values(state, True) == [value - level for value in values(state, False)]


def met(table: QTable, potential: np.ndarray) -> dict[int, np.ndarray]:
    return {state: table.look(state) for state in range(STATES * len(potential)) if state in table}


@settings(max_examples=25)
@given(formulas, seeds)
def test_learning_is_that_from_initial_values_that_are_higher_by_the_potential(sdnf: SDNF, seed: int):
    # whole numbers, no discount and α = 1 keep all sums exact, so that even ties are broken alike
    plain, potential = product(sdnf, seed)
    shaped = PotentialShaping(product(sdnf, seed)[0], 1.0, potential=potential)
    tables = QTable(ACTIONS, 3.0), QTable(ACTIONS, lambda state: [3.0 + potential[state // STATES]] * ACTIONS)
    rngs = [np.random.default_rng(seed) for _ in tables]
    exploring = QSettings(alpha=1.0, gamma=1.0, epsilon=0.3)
    for env, rng in zip((shaped, plain), rngs, strict=True):
        env.unwrapped.np_random = rng
    for _ in range(30):
        for env, table, rng in zip((shaped, plain), tables, rngs, strict=True):
            learn_by_steps(env, table, exploring, rng, 1)
        ours, theirs = met(tables[0], potential), met(tables[1], potential)
        assert ours.keys() == theirs.keys()
        for state, values in ours.items():
            np.testing.assert_array_equal(values + potential[state // STATES], theirs[state])


@settings(max_examples=10)
@given(formulas, seeds)
def test_so_it_is_with_a_discount(sdnf: SDNF, seed: int):
    plain, potential = product(sdnf, seed)
    potential /= 16
    exploring = QSettings(alpha=0.3, gamma=0.9, epsilon=1.0)
    tables = QTable(ACTIONS), QTable(ACTIONS, lambda state: [potential[state // STATES]] * ACTIONS)
    for env, table in zip((PotentialShaping(plain, 0.9, potential=potential), plain), tables, strict=True):
        rng = np.random.default_rng(seed)
        env.unwrapped.np_random = rng
        learn_by_steps(env, table, exploring, rng, 60)
    theirs = met(tables[1], potential)
    for state, values in met(tables[0], potential).items():
        np.testing.assert_allclose(values + potential[state // STATES], theirs[state], atol=1e-4)


def replay(truncated: bool) -> ExtendedState:
    X = np.array([[0.0, 0], [5, 0], [0, 0], [5, 0]])
    return ExtendedState(Labelled(Replay([X], truncated), ("x", "y")), "F[0,1] (x >= 5) & F[3,9] (x >= 5)")


@pytest.mark.parametrize("truncated", [False, True])
def test_what_is_added_sums_up_to_the_first_potential_by_hand(truncated: bool):
    # tick 0: four states away from acceptance at tick 3, the soonest; each tick comes one nearer
    env = PotentialShaping(replay(truncated), 0.5, 16.0)
    env.reset()
    steps = [env.step(0) for _ in range(3)]
    added = [float(reward) - info["unshaped_reward"] for _, reward, *_, info in steps]
    # Φ is 2, 4, 8, 16: γΦ' - Φ = 0; at the end nothing comes after a termination, but after a truncation it does
    assert added == [0.0, 0.0, 0.0 if truncated else -8.0]
    assert sum(each * 0.5**tick for tick, each in enumerate(added)) == (0.0 if truncated else -2.0)
    assert [step[2:4] for step in steps][-1] == (not truncated, truncated)


def test_the_potential_is_what_acceptance_is_worth_from_there():
    monitor = Monitor.of("F[0,2] (x >= 1) | G[0,1] (x <= 0)", ("x",))
    potential = acceptance_potential(monitor.tables, 0.5, 4.0)
    first = monitor.tables[0]
    states = monitor.start([[0.0], [1.0]])
    assert potential[states[0, 0]] == 2.0  # one tick away
    assert potential[states[1, 0]] == 4.0  # accepted
    assert potential[len(first) + states[1, 1]] == 0.0  # never
    assert potential[len(first) + states[0, 1]] == 2.0


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version.*:UserWarning")
def test_the_checker_finds_nothing_wrong_below_another_wrapper():
    extended = gymnasium.wrappers.RecordEpisodeStatistics(ExtendedState(frozen_lake(), "F[2,5] (row >= 2)", "flat"))
    check_env(PotentialShaping(extended, 0.99), skip_render_check=True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"gamma": 0.0}, "gamma is 0.0; use the agent's discount factor"),
        ({"gamma": 1.5}, "gamma is 1.5"),
        ({"gamma": float("nan")}, "gamma is nan"),
        ({"gamma": 0.9, "potential": [1.0]}, r"potential has shape \(1,\); use \d+ finite numbers"),
        ({"gamma": 0.9, "scale": float("inf")}, "finite"),
    ],
)
def test_what_does_not_fit_is_refused(arguments: dict[str, Any], message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        PotentialShaping(replay(False), **arguments)
    assert "\n" not in str(caught.value)


def test_it_needs_extended_states():
    with pytest.raises(ConfigurationError, match="needs extended states; wrap the environment in ExtendedState"):
        PotentialShaping(frozen_lake(), 0.9)
