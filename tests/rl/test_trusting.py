"""Q-learning with confidence: it is Q-learning without any, its twin says what it does, and it ends at the optimum."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.test_kernels import EPISODES, q_settings, seeds
from tests.rl.test_qlearning import small_problem
from tests.rl.twins import problems, random_problem, slow_trusting
from tickwise.envs.planning import optimal_value
from tickwise.errors import ConfigurationError, DataError
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import Problem, QSettings, evaluate
from tickwise.rl.trusting import Trusting

patiences = st.sampled_from([0.5, 3.0, 100.0])


@settings(max_examples=200, deadline=None)
@given(problems(), seeds, q_settings, patiences)
def test_without_confidence_it_is_q_learning(problem: Problem, seed: int, chosen: QSettings, patience: float):
    learners = QLearning(chosen).learner(problem), Trusting(chosen, patience).learner(problem)
    rngs = [np.random.default_rng(seed) for _ in learners]
    (returns, paths), (ours, our_paths) = (
        learner.learn(rng, EPISODES) for learner, rng in zip(learners, rngs, strict=True)
    )
    assert learners[0].q.tobytes() == learners[1].q.tobytes()
    assert returns.tobytes() == ours.tobytes()
    np.testing.assert_array_equal(paths, our_paths)
    assert rngs[0].bit_generator.state == rngs[1].bit_generator.state


@settings(max_examples=200, deadline=None)
@given(problems(), seeds, q_settings, patiences)
def test_it_equals_its_twin_step_for_step(problem: Problem, seed: int, chosen: QSettings, patience: float):
    shape = problem.initial_q(chosen).shape
    draws = np.random.default_rng(seed)
    confidence = (20 * draws.random(shape) * draws.integers(0, 2, shape)).astype(np.float32)
    values = draws.normal(50, 20, shape).astype(np.float32)
    learner = Trusting(chosen, patience).learner(problem, values, confidence)
    rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    parts = [learner.learn(rng, episodes) for episodes in (EPISODES // 2, EPISODES - EPISODES // 2)]
    q, visits = values.copy(), np.zeros(shape, dtype=np.uint32)
    returns, paths = slow_trusting(problem, q, confidence, visits, chosen, patience, slow_rng, EPISODES)
    assert learner.q.tobytes() == q.tobytes()
    assert learner.visits.tobytes() == visits.tobytes()
    assert np.concatenate([part[0] for part in parts]).tobytes() == returns.tobytes()
    np.testing.assert_array_equal(np.concatenate([part[1] for part in parts]), paths)
    assert rng.bit_generator.state == slow_rng.bit_generator.state


@settings(max_examples=100, deadline=None)
@given(problems(), seeds)
def test_every_step_is_one_visit(problem: Problem, seed: int):
    """Visits of an MDP state are the steps that the paths make from it."""
    learner = Trusting(QSettings(epsilon=0.3)).learner(problem)
    _, paths = learner.learn(np.random.default_rng(seed), EPISODES)
    steps = np.zeros(problem.mdp.n_states, dtype=int)
    for path in paths:
        for before, after in pairwise(path):
            steps[before] += after >= 0
    np.testing.assert_array_equal(learner.visits.sum(axis=(0, 2)), steps)


def test_the_rates_of_one_entry_by_hand():
    """One state and one action, no discount, a reward of 8 in every episode, α = 1/2, c = 2 and h = 1.

    The rates are 1 / (2 + 2 / (1 + n)) = 1/4, 1/3, 3/8: from 0, the first update goes a quarter of the way to 8, to 2;
    the second a third of the way from 2 to 8, to 4; the third three eighths of the way from 4 to 8, to 5.5.
    """
    problem = random_problem(0, states=1, actions=1, outcomes=1, horizon=1)
    task = problem.task
    eight = replace(task, reward=np.full_like(task.reward, 8), final_reward=np.zeros_like(task.final_reward))
    problem = replace(problem, task=eight)
    shape = problem.initial_q(QSettings()).shape
    learner = Trusting(QSettings(alpha=0.5, gamma=0.0, initial=0.0), patience=1.0).learner(
        problem, confidence=np.full(shape, 2.0, dtype=np.float32)
    )
    expected = []
    for _ in range(3):
        learner.learn(np.random.default_rng(0), 1)
        expected.append(float(learner.q.max()))
    assert expected == pytest.approx([2.0, 4.0, 5.5])


def test_it_comes_to_the_optimum_from_values_that_it_trusts_and_that_are_wrong():
    problem, chosen = small_problem(), QSettings(epsilon=0.05)
    shape = problem.initial_q(chosen).shape
    wrong = np.random.default_rng(3).uniform(0, 100, shape).astype(np.float32)
    learner = Trusting(chosen, patience=20.0).learner(problem, wrong, np.full(shape, 50.0, dtype=np.float32))
    learner.learn(np.random.default_rng(0), 60_000)
    best = optimal_value(problem.mdp, problem.task)
    assert evaluate(problem, learner.q, np.random.SeedSequence(1), 1000) == best


def test_given_values_are_copied():
    problem = random_problem(5)
    q = problem.initial_q(QSettings(initial=3.0))
    learner = Trusting().learner(problem, q)
    learner.learn(np.random.default_rng(0), 2)
    assert (q == 3.0).all()
    assert (learner.q != 3.0).any()


def test_what_it_refuses():
    problem = random_problem(5)
    shape = problem.initial_q(QSettings()).shape
    with pytest.raises(ConfigurationError, match="patience is 0"):
        Trusting(patience=0.0)
    with pytest.raises(DataError, match="use the same"):
        Trusting().learner(problem, confidence=np.zeros((1, 2, 3, 4), dtype=np.float32))
    for wrong in (-0.1, np.inf, np.nan):
        with pytest.raises(DataError, match="below 0 or not finite"):
            Trusting().learner(problem, confidence=np.full(shape, wrong, dtype=np.float32))
