"""Tests of the interface of learning forms."""

import numpy as np
import pytest

from tickwise.envs.catalog import CASE_STUDY_1_TARGET
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import Problem, QSettings, learn
from tickwise.rl.states import tau_memory


def a_problem() -> Problem:
    mdp = CASE_STUDY_1_TARGET.mdp()
    return Problem(mdp, CASE_STUDY_1_TARGET.task_table(), tau_memory(mdp, 2))


def test_q_learning_is_what_the_function_does() -> None:
    problem, settings = a_problem(), QSettings(initial=20.0)
    learner = QLearning(settings).learner(problem)
    rng = np.random.default_rng(1)
    parts = [learner.learn(rng, episodes) for episodes in (3, 4)]
    q = problem.initial_q(settings)
    returns = learn(problem, q, settings, np.random.default_rng(1), 7)
    assert np.array_equal(np.concatenate([part[0] for part in parts]), returns)
    assert all(part[1].shape[1] == problem.task.horizon + 1 for part in parts)
    assert np.array_equal(learner.q, q)


def test_given_values_are_copied() -> None:
    problem = a_problem()
    q = problem.initial_q(QSettings(initial=3.0))
    learner = QLearning().learner(problem, q)
    learner.learn(np.random.default_rng(0), 2)
    assert (q == 3.0).all()
    assert (learner.q != 3.0).any()


def test_given_values_of_another_shape_are_refused() -> None:
    problem = a_problem()
    with pytest.raises(ConfigurationError, match=r"the values to begin with have shape \(3, 3\); give \(memory states"):
        QLearning().learner(problem, np.zeros((3, 3), dtype=np.float32))


def test_settings_under_the_name_of_another_form_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="the form of QLearning is 'q', not 'model'; leave it out"):
        QLearning(form="model")
