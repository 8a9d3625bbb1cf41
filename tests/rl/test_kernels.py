"""The compiled loops and their plain-Python twins give the same numbers, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.twins import problems, random_problem, slow_greedy_returns, slow_q_learning
from tickwise.envs.tabulate import TabularMDP, cumulative, draw
from tickwise.envs.tasks import TaskTable
from tickwise.rl.kernels import draw_state, greedy_returns
from tickwise.rl.qlearning import Problem, QSettings, collect, learn
from tickwise.rl.states import Memory
from tickwise.rl.stream import take_stream

EPISODES = 12

seeds = st.integers(0, 2**32 - 1)
q_settings = st.builds(
    QSettings,
    alpha=st.sampled_from([0.0, 0.1, 0.8, 1.0]),
    gamma=st.sampled_from([0.0, 0.9, 0.99, 1.0]),
    epsilon=st.sampled_from([0.0, 0.02, 0.3, 0.97]),
    initial=st.sampled_from([0.0, 50.0, -1.5]),
)


@settings(max_examples=300, deadline=None)
@given(problems(), seeds, q_settings)
def test_learning_equals_its_twin_step_for_step(problem: Problem, seed: int, chosen: QSettings):
    fast, slow = problem.initial_q(chosen), problem.initial_q(chosen)
    fast_rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    returns, paths = collect(problem, fast, chosen, fast_rng, EPISODES)
    slow_returns, slow_paths = slow_q_learning(problem, slow, chosen, slow_rng, EPISODES)
    assert fast.tobytes() == slow.tobytes()
    assert returns.tobytes() == slow_returns.tobytes()
    np.testing.assert_array_equal(paths, slow_paths)
    assert fast_rng.bit_generator.state == slow_rng.bit_generator.state


@settings(max_examples=200, deadline=None)
@given(problems(), seeds, st.booleans())
def test_greedy_play_equals_its_twin(problem: Problem, seed: int, ties: bool):
    rng = np.random.default_rng(seed)
    shape = problem.initial_q(QSettings()).shape
    values = rng.integers(0, 2, size=shape) if ties else rng.normal(size=shape)
    q = values.astype(np.float32)
    returns = np.empty(EPISODES, dtype=np.float32)
    greedy_returns(*problem.arrays, take_stream(np.random.default_rng(seed)), q, returns)
    expected = slow_greedy_returns(problem, q, np.random.default_rng(seed), EPISODES)
    assert returns.tobytes() == expected.tobytes()


@settings(max_examples=100, deadline=None)
@given(seeds, seeds)
def test_recording_changes_nothing(problem_seed: int, seed: int):
    problem, chosen = random_problem(problem_seed), QSettings(epsilon=0.1)
    with_paths, without = problem.initial_q(chosen), problem.initial_q(chosen)
    returns, _ = collect(problem, with_paths, chosen, np.random.default_rng(seed), EPISODES)
    plain = learn(problem, without, chosen, np.random.default_rng(seed), EPISODES)
    assert with_paths.tobytes() == without.tobytes()
    assert returns.tobytes() == plain.tobytes()


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.integers(0, 3), min_size=1, max_size=9).filter(any),
    st.floats(0.0, 1.0, exclude_max=True),
)
def test_draw_state_is_the_rule_of_the_environments(weights: list[int], uniform: float):
    thresholds = cumulative(np.array(weights) / sum(weights))
    for number in (uniform, 0.0, 1 - 2**-53, *(threshold for threshold in thresholds if threshold < 1)):
        state = draw_state(thresholds, number)
        assert state == draw(thresholds, number)
        assert weights[state] > 0


@pytest.mark.parametrize("epsilon", [0.0, 0.5])
def test_ties_are_broken_evenly(epsilon: float):
    """Action a leads to state a, and nothing is ever rewarded: all Q-values stay equal."""
    count = 4
    mdp = TabularMDP(
        successor=np.tile(np.arange(count), (count, 1))[:, :, None],
        probability=np.ones((count, count, 1)),
        initial=np.full(count, 1 / count),
        cell=np.arange(count),
        cell_coordinates=np.zeros((count, 1)),
        variables=("x",),
        limits=((0.0, 1.0),),
    )
    task = TaskTable(
        delta=np.zeros((1, 1)),
        letter=np.zeros(count),
        reward=np.zeros((1, count)),
        final_reward=np.zeros(1),
        terminated=np.zeros(1),
        success=np.ones(1),
        horizon=50,
        stages=("",),
    )
    problem = Problem(mdp, task, Memory(np.zeros(count), np.zeros((1, 1)), np.zeros((count, count, 1))))
    chosen = QSettings(epsilon=epsilon, initial=0.0)
    _, paths = collect(problem, problem.initial_q(chosen), chosen, np.random.default_rng(1), 400)
    counts = np.bincount(paths[:, 1:].ravel(), minlength=count)
    # 20,000 draws: 5,000 each with a standard deviation of 61
    assert (abs(counts - 5000) < 300).all()
