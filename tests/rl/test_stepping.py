from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeLimit

from tickwise.automata.build import timed_automata
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.enumeration import tabulate
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.temporal import FormulaTask
from tickwise.envs.wrappers import ExtendedState, Labelled, TauState, TimedTask
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.rl.qlearning import Problem, QSettings, evaluate, learn
from tickwise.rl.qtable import QTable
from tickwise.rl.states import Memory, automaton_memory, tau_memory
from tickwise.rl.stepping import learn_by_steps, play_by_steps

EXPLORING = QSettings(alpha=0.8, gamma=0.99, epsilon=0.1, initial=3.0)
FORMULA = "F[0,4] G[0,2] (1 <= x <= 2 & 1 <= y <= 3) & F[8,12] (2 <= x <= 4 & 0 <= y <= 2)"
EITHER = "F[0,3] (0 <= x <= 1 & 0 <= y <= 1) & F[6,12] (2 <= x <= 4 & 0 <= y <= 2) | G[2,8] (2 <= x <= 4 & 1 <= y <= 4)"
LAKE = {"row": lambda s: s // 4, "column": lambda s: s % 4}
TAXI = {"row": lambda s: s // 100, "column": lambda s: s // 20 % 5, "rest": lambda s: s % 20}


def formula_memory(mdp: Any, formula: str) -> Memory:
    return automaton_memory(mdp, tuple(automaton.compile() for automaton in timed_automata(parse(formula))))


def both(env: Any, problem: Problem, episodes: int = 150) -> tuple[QTable, np.ndarray]:
    """Learn by steps and by the kernel from the same generator; all returns and what is drawn thereafter agree."""
    table, q = QTable(problem.mdp.n_actions, EXPLORING.initial), problem.initial_q(EXPLORING)
    rng, twin = np.random.default_rng(7), np.random.default_rng(7)
    env.unwrapped.np_random = rng
    ours = learn_by_steps(env, table, EXPLORING, rng, episodes)
    theirs = learn(problem, q, EXPLORING, twin, episodes)
    np.testing.assert_array_equal(ours.astype(np.float32), theirs)
    assert rng.random() == twin.random()
    assert len(table) > 10
    assert len(set(ours.tolist())) > 1
    return table, q


def assert_same(table: QTable, q: np.ndarray) -> None:
    """Every Q-value is the same, bit by bit; a number is that of the memory state times the states, and the state."""
    states = q.shape[1]
    rows = {(number // states, number % states) for number in range(q.shape[0] * states) if number in table}
    for u, s in np.ndindex(q.shape[:2]):
        np.testing.assert_array_equal(table.look(u * states + s), q[u, s])
    assert len(rows) == len(table)


@pytest.mark.parametrize("formula", [FORMULA, EITHER])
def test_on_extended_states_of_a_gridworld_it_is_the_kernel(formula: str):
    spec = EnvironmentSpec("Here", GridWorld(4), FormulaTask(FORMULA, 14))
    env = Labelled(GridWorldEnv(spec), {"x": lambda o: o[0] + 0.5, "y": lambda o: o[1] + 0.5})
    mdp = spec.mdp()
    assert_same(
        *both(ExtendedState(env, formula, "discrete"), Problem(mdp, spec.task_table(), formula_memory(mdp, formula)))
    )


def test_on_tau_states_it_is_the_kernel():
    spec = EnvironmentSpec("Here", GridWorld(3), FormulaTask("F[0,4] G[0,1] (x <= 1) & F[6,9] (x >= 2)", 10))
    mdp = spec.mdp()
    problem = Problem(mdp, spec.task_table(), tau_memory(mdp, 3))
    table, q = both(TauState(GridWorldEnv(spec), 3), problem)
    # the kernel has another numbering; what was learned is the same numbers
    learned = table.values[(table.values != EXPLORING.initial).any(axis=1)]
    rows = q.reshape(-1, q.shape[-1])
    expected = rows[(rows != EXPLORING.initial).any(axis=1)]
    assert sorted(map(tuple, learned.tolist())) == sorted(map(tuple, expected.tolist()))


@pytest.mark.parametrize(
    ("name", "features", "formula"),
    [
        (
            "FrozenLake-v1",
            LAKE,
            "F[0,8] (1 <= row <= 2 & 0 <= column <= 1) & F[9,20] (2 <= row <= 3 & 0 <= column <= 3)",
        ),
        (
            "Taxi-v4",
            TAXI,
            "F[0,4] (1 <= row <= 2 & 0 <= column <= 4 & 0 <= rest <= 19) & "
            "F[5,9] (0 <= row <= 1 & 0 <= column <= 1 & 0 <= rest <= 19)",
        ),
    ],
)
def test_a_tabulated_environment_with_a_timed_task_is_the_environment(name: str, features: Any, formula: str):
    env = gymnasium.make(name)
    tabulation = tabulate(env, features)
    task = tabulation.timed(FormulaTask(formula, 20, reward=5.0, penalty=-1.0, ends="decided").table(tabulation.mdp))
    ours = ExtendedState(TimedTask(Labelled(env, features), formula, 20, 5.0, -1.0, "decided"), formula, "discrete")
    assert_same(*both(ours, Problem(tabulation.mdp, task, formula_memory(tabulation.mdp, formula))))


class Final(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A time limit that ends an episode for good, as the horizon of a task does."""

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated or truncated, False, info


def test_an_environments_own_rewards_are_a_task():
    tabulation = tabulate(gymnasium.make("FrozenLake-v1"), LAKE)
    problem = Problem(tabulation.mdp, tabulation.own_task(40), tau_memory(tabulation.mdp, 1))
    env = Final(TimeLimit(gymnasium.make("FrozenLake-v1").unwrapped, 40))
    assert_same(*both(env, problem, episodes=500))


def test_greedy_play_is_the_kernels():
    tabulation = tabulate(gymnasium.make("FrozenLake-v1"), LAKE)
    problem = Problem(tabulation.mdp, tabulation.own_task(30), tau_memory(tabulation.mdp, 1))
    env = Final(TimeLimit(gymnasium.make("FrozenLake-v1").unwrapped, 30))
    table, q = both(env, problem)
    met = len(table)
    ours = play_by_steps(env, table, 40, seed=5)
    # Gymnasium's generator of a seed is NumPy's of that seed sequence
    assert ours.mean() == pytest.approx(evaluate(problem, q, np.random.SeedSequence(5), 40))
    np.testing.assert_array_equal(ours, play_by_steps(env, table, 40, seed=5))
    assert len(table) == met


class Corridor:
    """Two states; the action is given back as reward, and the episode is cut off or ends after one step."""

    def __init__(self, truncated: bool) -> None:
        self.truncated = truncated

    def reset(self, *, seed: int | None = None) -> tuple[Any, dict[str, Any]]:
        del seed
        return 0, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return 1, float(action), not self.truncated, self.truncated, {}


@pytest.mark.parametrize(("truncated", "target"), [(False, 1.0), (True, 1.0 + 0.5 * 4.0)])
def test_what_comes_after_a_truncation_counts_and_after_a_termination_nothing_does(truncated: bool, target: float):
    table = QTable(2, lambda observation: [0.0, 2.0] if observation == 0 else [4.0, 3.0])
    settings = QSettings(alpha=0.5, gamma=0.5, epsilon=0.0)
    returns = learn_by_steps(Corridor(truncated), table, settings, np.random.default_rng(0), 1)
    assert returns.tolist() == [1.0]
    assert table.look(0).tolist() == [0.0, 2.0 + 0.5 * (target - 2.0)]
    assert table.look(1).tolist() == [4.0, 3.0]


def test_another_number_of_actions_is_refused():
    env = gymnasium.make("FrozenLake-v1")
    for call in (
        lambda: learn_by_steps(env, QTable(3), QSettings(), np.random.default_rng(0), 1),
        lambda: play_by_steps(env, QTable(3), 1, 0),
    ):
        with pytest.raises(ConfigurationError, match=r"table has 3 actions and the environment Discrete\(4\)"):
            call()
    continuous = gymnasium.make("Pendulum-v1")
    with pytest.raises(ConfigurationError, match="numbers from 0"):
        play_by_steps(continuous, QTable(1), 1, 0)
