from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.twins import random_problem
from tickwise.automata.build import timed_automata
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import optimal_value
from tickwise.envs.tasks import ReachStayReach, TaskMonitor
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.syntax import Box
from tickwise.rl.qlearning import Problem, QSettings, collect, evaluate, learn
from tickwise.rl.states import Memory, automaton_memory, tau_memory


def small_problem(*, slip: float = 0.0, turn_failure: float = 0.0) -> Problem:
    """2×2: two ticks in the lower left cell, later to the upper right one, in 14 ticks; with its formula."""
    mdp = GridWorld(2, slip, turn_failure).mdp()
    task = ReachStayReach(first=Box.of(x=(0, 1), y=(0, 1)), stay=1, second=Box.of(x=(1, 2), y=(1, 2)), deadline=14)
    formula = parse("F[0,7] G[0,1] (0 <= x <= 1 & 0 <= y <= 1) & F[9,14] (1 <= x <= 2 & 1 <= y <= 2)")
    tables = [automaton.compile() for automaton in timed_automata(formula)]
    return Problem(mdp, task.table(mdp), automaton_memory(mdp, tables))


def test_learning_solves_a_small_task_to_its_optimum():
    problem, chosen = small_problem(), QSettings(epsilon=0.05)
    best = optimal_value(problem.mdp, problem.task)
    assert best == 100.0
    q = problem.initial_q(chosen)
    learn(problem, q, chosen, np.random.default_rng(0), 20_000)
    assert evaluate(problem, q, np.random.SeedSequence(1), 1000) == best


def test_learning_comes_near_the_optimum_with_chance():
    problem, chosen = small_problem(slip=0.04, turn_failure=0.03), QSettings(alpha=0.1, epsilon=0.1)
    best = optimal_value(problem.mdp, problem.task)
    assert 90 < best < 100
    q = problem.initial_q(chosen)
    learn(problem, q, chosen, np.random.default_rng(0), 100_000)
    assert evaluate(problem, q, np.random.SeedSequence(1), 20_000) == pytest.approx(best, abs=2.0)


def test_without_memory_the_task_is_not_learnt():
    """The extended state is what makes it learnable: with τ = 1 the robot cannot know what it has done."""
    problem, chosen = small_problem(), QSettings(epsilon=0.05)
    blind = Problem(problem.mdp, problem.task, tau_memory(problem.mdp, 1))
    q = blind.initial_q(chosen)
    learn(blind, q, chosen, np.random.default_rng(0), 20_000)
    assert evaluate(blind, q, np.random.SeedSequence(1), 1000) < 60


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.3]))
def test_collected_paths_are_legal(seed: int, epsilon: float):
    """Each path starts where it may, goes where it can, ends when the task says so, and is worth its return."""
    problem, chosen = random_problem(seed), QSettings(epsilon=epsilon)
    mdp, task = problem.mdp, problem.task
    returns, paths = collect(problem, problem.initial_q(chosen), chosen, np.random.default_rng(seed), 30)
    assert (paths.shape, paths.dtype, returns.shape) == ((30, task.horizon + 1), np.int32, (30,))
    for path, gained in zip(paths, returns, strict=True):
        assert mdp.initial[path[0]] > 0
        monitor, total, over = TaskMonitor(task), 0.0, False
        monitor.start(path[0])
        for before, after in pairwise(path):
            if over:
                assert after == -1
                continue
            assert mdp.probability[before][mdp.successor[before] == after].sum() > 0
            reward, over = monitor.advance(after)
            total += reward
        assert over
        assert gained == np.float32(total)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 20))
def test_learning_goes_on_where_it_ended(seed: int, split: int):
    problem, chosen = random_problem(seed), QSettings(epsilon=0.1)
    whole, parts = problem.initial_q(chosen), problem.initial_q(chosen)
    rng = np.random.default_rng(seed)
    returns = learn(problem, whole, chosen, np.random.default_rng(seed), 20)
    pieces = [learn(problem, parts, chosen, rng, episodes) for episodes in (split, 20 - split)]
    np.testing.assert_array_equal(np.concatenate(pieces), returns)
    np.testing.assert_array_equal(parts, whole)


def test_evaluation_repeats_and_leaves_the_table_alone():
    problem = small_problem(slip=0.04)
    q = problem.initial_q(QSettings())
    before = q.copy()
    values = {evaluate(problem, q, np.random.SeedSequence(3), 50) for _ in range(3)}
    assert len(values) == 1
    np.testing.assert_array_equal(q, before)


def test_one_update_by_hand():
    """One state, one action, two ticks, 1 at the deadline only."""
    problem = random_problem(0, states=1, actions=1, outcomes=1, horizon=1)
    mdp = problem.mdp
    task = type(problem.task)(
        delta=[[0]], letter=[0], reward=[[0]], final_reward=[1], terminated=[False], success=[True], horizon=2,
        stages=("",),
    )  # fmt: skip
    memory = Memory(np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1, 1)))
    q = np.full((1, 1, 1), 8.0, dtype=np.float32)
    learn(Problem(mdp, task, memory), q, QSettings(alpha=0.5, gamma=0.5), np.random.default_rng(0), 1)
    # first 8 + 0.5 (0 + 0.5·8 - 8) = 6, then 6 + 0.5 (1 - 6) = 3.5: the future after the end counts nothing
    assert q[0, 0, 0] == 3.5


def test_a_fresh_table_has_the_initial_value():
    problem = small_problem()
    q = problem.initial_q(QSettings(initial=20.0))
    assert q.shape == (problem.memory.n_states, 16, 3)
    assert q.dtype == np.float32
    assert (q == 20.0).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"alpha": -0.1}, "alpha is -0.1; use a number from 0 to 1"),
        ({"alpha": 1.1}, "alpha is 1.1"),
        ({"gamma": 2.0}, "gamma is 2.0; use a number from 0 to 1"),
        ({"gamma": math.nan}, "gamma is nan"),
        ({"epsilon": 1.1}, "epsilon is 1.1"),
        ({"epsilon": -0.5}, "epsilon is -0.5"),
        ({"initial": math.inf}, "initial Q-value is inf; use a finite number"),
        ({"initial": math.nan}, "initial Q-value is nan"),
    ],
)
def test_settings_out_of_range(changes: dict[str, float], message: str):
    with pytest.raises(ConfigurationError, match=message):
        QSettings(**changes)
