"""Actor and critic: equal to their twin, and as good as can be where the optimum is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.form_twins import chance_world, formula_problem, slow_actor_critic
from tests.rl.test_kernels import seeds
from tests.rl.twins import problems
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import optimal_value
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.actor_critic import ActorCritic, expected_values
from tickwise.rl.qlearning import Problem, evaluate

EPISODES = 12

forms = st.builds(
    ActorCritic,
    actor=st.sampled_from([0.0, 0.05, 1.0]),
    critic=st.sampled_from([0.0, 0.3, 1.0]),
    gamma=st.sampled_from([0.0, 0.9, 1.0]),
    trace=st.sampled_from([0.0, 0.1, 0.6, 1.0]),
    temperature=st.sampled_from([0.1, 1.0, 20.0]),
    initial=st.sampled_from([0.0, 40.0, -1.5]),
)


@settings(max_examples=200, deadline=None)
@given(problems(), seeds, forms)
def test_learning_equals_its_twin_step_for_step(problem: Problem, seed: int, form: ActorCritic):
    fast_rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    learner = form.learner(problem)
    preferences, values = learner.q.copy(), learner.values.copy()
    # in two parts, which is the same as at once
    parts = [learner.learn(fast_rng, episodes) for episodes in (5, EPISODES - 5)]
    returns, paths = slow_actor_critic(problem, preferences, values, form, slow_rng, EPISODES)
    assert learner.q.tobytes() == preferences.tobytes()
    assert learner.values.tobytes() == values.tobytes()
    assert np.concatenate([part[0] for part in parts]).tobytes() == returns.tobytes()
    np.testing.assert_array_equal(np.concatenate([part[1] for part in parts]), paths)
    assert fast_rng.bit_generator.state == slow_rng.bit_generator.state


def test_its_greedy_policy_becomes_optimal():
    world = GridWorld(3, slip=0.0, turn_failure=0.0)
    # evaluation begins where it draws, so that only a single state to begin with has the mean that planning has
    mdp = replace(world.mdp(), initial=np.eye(36)[world.state(2, 0, 0)])
    text = "F[3,6] G[0,1] (0 <= x <= 1 & 2 <= y <= 3) & F[8,11] (2 <= x <= 3)"
    problem = formula_problem(mdp, to_sdnf(parse(text)))
    learner = ActorCritic().learner(problem)
    assert evaluate(problem, learner.q, np.random.SeedSequence(0), 1) < optimal_value(mdp, problem.task) == 100.0
    learner.learn(np.random.default_rng(0), 5_000)
    assert evaluate(problem, learner.q, np.random.SeedSequence(0), 1) == 100.0


def a_problem() -> Problem:
    return formula_problem(chance_world(2), to_sdnf(parse("F[0,1] G[0,2] (x >= 1)")))


def test_a_step_by_hand():
    """One step that ends the episode: the surprise is shared among the actions by what is left of certainty."""
    problem = formula_problem(chance_world(2), to_sdnf(parse("F[0,1] (x >= 0)")))
    form = ActorCritic(actor=0.5, critic=0.25, initial=20.0)
    learner = form.learner(problem)
    learner.learn(np.random.default_rng(0), 1)
    # the formula holds at tick 0, so tick 1 pays 100; the critic expected 20, and both actions were as likely
    u, s = np.argwhere(learner.values != 20.0)[0]
    assert learner.values[u, s] == 20.0 + 0.25 * 80.0
    assert sorted(learner.q[u, s]) == [20.0 - 0.5 * 80.0 / 2, 20.0 + 0.5 * 80.0 / 2]


def test_given_values_are_the_preferences_and_the_critic_expects_what_they_say():
    problem = a_problem()
    q = np.random.default_rng(0).normal(size=(problem.memory.n_states, 2, 2)).astype(np.float32)
    before = q.copy()
    learner = ActorCritic(temperature=0.5).learner(problem, q)
    np.testing.assert_array_equal(learner.q, q)
    chances = 1 / (1 + np.exp((q[..., ::-1] - q) / 0.5))
    np.testing.assert_allclose(learner.values, (chances * q).sum(axis=2), rtol=1e-5)
    learner.learn(np.random.default_rng(0), 3)
    np.testing.assert_array_equal(q, before)
    # however cold, and however far the values are apart
    np.testing.assert_array_equal(expected_values(q * 1e6, 1e-6), (q * 1e6).max(axis=2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"actor": 1.5}, "actor is 1.5; use a number from 0 to 1"),
        ({"critic": -0.1}, "critic is -0.1; use a number from 0 to 1"),
        ({"gamma": math.nan}, "gamma is nan; use a number from 0 to 1"),
        ({"trace": 2}, "trace is 2; use a number from 0 to 1"),
        ({"temperature": 0.0}, "the temperature is 0.0; use a finite number above 0"),
        ({"temperature": math.inf}, "the temperature is inf"),
        ({"initial": math.inf}, "the initial value is inf; use a finite number"),
        ({"form": "q"}, "the form of ActorCritic is 'actor_critic', not 'q'"),
    ],
)
def test_what_does_not_fit_is_refused(arguments: dict[str, float], message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        ActorCritic(**arguments)
    assert "\n" not in str(caught.value)
