"""Model-based learning: equal to its twin, what is expected of what was not met, and that it learns."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.form_twins import chance_world, formula_problem
from tests.rl.model_twins import random_counts, slow_expectations, slow_model_learning
from tests.rl.test_counterfactual import crossroads
from tests.rl.test_kernels import seeds
from tests.rl.twins import problems
from tickwise.automata.build import timed_automata
from tickwise.envs.catalog import CASE_STUDY_1_TARGET
from tickwise.envs.planning import optimal_value
from tickwise.envs.temporal import sdnf_table
from tickwise.errors import ConfigurationError
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.model import ModelBased, expectations, imagined, no_counts, satisfying_plan
from tickwise.rl.qlearning import Problem, evaluate
from tickwise.rl.states import automaton_memory, tau_memory

EPISODES = 5

forms = st.builds(
    ModelBased,
    known=st.sampled_from([1, 2]),
    hope=st.sampled_from([50.0, 0.0, -1.5]),
    pooling=st.sampled_from([0.01, 1.0]),
)


def a_problem(text: str = "F[1,2] (x >= 1)") -> Problem:
    return formula_problem(chance_world(2), to_sdnf(parse(text)))


@settings(max_examples=60, deadline=None)
@given(problems(), seeds, forms, st.booleans())
def test_learning_equals_its_twin_step_for_step(problem: Problem, seed: int, form: ModelBased, begins: bool):
    rng = np.random.default_rng(seed)
    shape = problem.memory.n_states, problem.mdp.n_states, problem.mdp.n_actions
    values = rng.normal(size=shape).astype(np.float32) if begins else None
    fast_rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    learner, counts = form.learner(problem, values), no_counts(problem.mdp)
    returns, paths = learner.learn(fast_rng, EPISODES)
    expected, slow_paths, plan = slow_model_learning(problem, form, values, counts, slow_rng, EPISODES)
    assert returns.tobytes() == expected.tobytes()
    np.testing.assert_array_equal(paths, slow_paths, strict=True)
    assert fast_rng.bit_generator.state == slow_rng.bit_generator.state
    for array, slow in zip(learner.counts, counts, strict=True):
        assert array.tobytes() == slow.tobytes()
    pairs = zip(learner.unrolled.tick.tolist(), learner.unrolled.state.tolist(), strict=True)
    np.testing.assert_array_equal(learner.q, [[plan.row(t, u, s) for s in range(shape[1])] for t, u in pairs])


@settings(max_examples=100, deadline=None)
@given(problems(), seeds, forms)
def test_expectations_equal_their_twin(problem: Problem, seed: int, form: ModelBased):
    counts = random_counts(problem, np.random.default_rng(seed))
    for found, expected in zip(expectations(counts, form), slow_expectations(counts, form), strict=True):
        np.testing.assert_array_equal(found, expected, strict=True)


def test_a_reward_is_hoped_for_at_the_last_tick_until_one_was_seen():
    counts, form = no_counts(chance_world()), ModelBased(hope=30.0)
    reward, ends = expectations(counts, form)
    # by class: false, unknown, true, and each at the last tick
    assert reward.tolist() == [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [30.0, 30.0], [0.0, 0.0], [30.0, 30.0]]
    assert (ends == 0.0).all()
    counts.arrivals[5, 0], counts.rewards[5, 0] = 1, 2.0
    np.testing.assert_allclose(expectations(counts, form)[0][[3, 5]], [[30.0, 30.0], [2.0, 2.0]])


def test_states_share_what_is_met_in_their_class():
    counts, form = no_counts(chance_world()), ModelBased(pooling=0.5)
    counts.arrivals[2], counts.rewards[2], counts.ends[2] = [3, 1], [6.0, 10.0], [3, 0]
    reward, ends = expectations(counts, form)
    # the mean of the four is 4, and three of four ended; either weighs half an arrival
    np.testing.assert_allclose(reward[2], [(6.0 + 2.0) / 3.5, (10.0 + 2.0) / 1.5])
    np.testing.assert_allclose(ends[2], [(3 + 0.375) / 3.5, 0.375 / 1.5])
    # nothing was met in another class
    assert not reward[[0, 1, 4]].any()
    assert not ends[[0, 1, 3, 4, 5]].any()


def test_nothing_follows_where_an_episode_ends():
    problem = a_problem("F[1,3] (x >= 1)")
    counts = no_counts(problem.mdp)
    counts.outcomes[:], counts.arrivals[:] = 1, 1
    counts.rewards[4], counts.ends[4] = 100.0, 1
    counts.rewards[5] = 100.0
    learner = ModelBased().learner(problem, counts=counts)
    # in three ticks x >= 1 is seen with 7/8, and paid once
    assert learner.q[learner.problem.memory.start[0], 0] == pytest.approx([87.5, 87.5])


def test_what_is_unknown_is_worth_what_is_hoped_for_and_then_what_was_seen():
    problem = a_problem("F[1,3] (x >= 1)")
    nothing = np.zeros_like(problem.task.reward)
    task = replace(problem.task, horizon=5, reward=nothing, terminated=nothing[:, 0])
    form, paid = ModelBased(hope=50.0), np.where(problem.task.success, 4.0, 0.0)
    learner = form.learner(replace(problem, task=replace(task, final_reward=paid)))
    last = learner.unrolled.tick == 5
    assert (learner.q[~last] == 50.0).all()
    assert (learner.q[last] == 0.0).all()
    rng = np.random.default_rng(0)
    while learner.learn(rng, 1)[0][0] == 0.0:
        pass
    # a formula that is decided by the last tick is not unknown there, so nothing is hoped for any more
    counts = learner.counts._replace(outcomes=np.zeros_like(learner.counts.outcomes))
    anew = form.learner(Problem(problem.mdp, learner.problem.task, problem.memory), counts=counts)
    assert anew.q[~last] == pytest.approx(4.0)


def test_rewards_on_the_way_add_up_in_what_is_unknown():
    problem = a_problem("F[1,3] (x >= 1)")
    counts = no_counts(problem.mdp)
    counts.arrivals[[2, 5], 1], counts.rewards[[2, 5], 1] = 1, [3.0, 20.0]
    learner = ModelBased().learner(problem, counts=counts)
    # 3 at each tick but the last, which gives 20
    for tick, worth in enumerate([26.0, 23.0, 20.0, 0.0]):
        assert learner.q[learner.unrolled.tick == tick] == pytest.approx(worth)


def test_given_values_are_those_of_what_is_unknown():
    problem = a_problem("F[1,2] (x >= 1) & F[4,5] (x <= 1)")
    shape = problem.memory.n_states, 2, 2
    values = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    learner = ModelBased(known=3).learner(problem, values)
    tick, state = learner.unrolled.tick, learner.unrolled.state
    before = tick < problem.task.horizon
    np.testing.assert_array_equal(learner.q[before], values[state[before]])
    learner.learn(np.random.default_rng(1), 3)
    known = np.broadcast_to(learner.counts.outcomes.sum(axis=2) >= 3, learner.q[before].shape)
    np.testing.assert_array_equal(learner.q[before] != values[state[before]], known)
    assert known.any()
    assert not known.all()


def test_given_values_are_followed():
    """From the crossroads either way is unknown; the first episode goes where the values say."""
    tables = [automaton.compile() for automaton in timed_automata(to_sdnf(parse("F[0,1] (x == 5)")))]
    mdp = crossroads()
    problem = Problem(mdp, sdnf_table(to_sdnf(parse("F[0,1] (x == 5)")), mdp, 3), automaton_memory(mdp, tables))
    for action in range(2):
        values = np.zeros((problem.memory.n_states, 5, 2), np.float32)
        values[:, 0, action] = 1.0
        _, paths = ModelBased().learner(problem, values).learn(np.random.default_rng(0), 1)
        assert paths[0].tolist() == [0, 1 + action, 3, 3]


def test_counts_go_on_in_another_learner():
    problem, counts = a_problem(), no_counts(chance_world(2))
    first = ModelBased().learner(problem, counts=counts)
    first.learn(np.random.default_rng(0), 20)
    assert first.counts is counts
    assert ModelBased().learner(problem, counts=counts).q.tobytes() == first.q.tobytes()
    # another formula's plan knows the world too
    other = ModelBased().learner(a_problem("F[0,1] (x <= 1)"), counts=counts)
    frequencies = counts.outcomes[1, :, 0] / counts.outcomes[1].sum(axis=1)
    assert satisfying_plan(other)[other.problem.memory.start[1], 1] == pytest.approx(frequencies)


def test_a_plan_to_satisfy_takes_the_weak_view_and_what_is_unknown_for_good():
    problem = a_problem("F[1,2] (x >= 1) & F[3,4] (x >= 0)")
    learner = ModelBased().learner(problem)
    violated = learner.unrolled.verdict < 0
    last = learner.unrolled.tick == problem.task.horizon
    q = satisfying_plan(learner)
    assert (q[~violated & ~last] == 1.0).all()
    assert (q[violated] == 0.0).all()
    assert (violated & ~last).any()
    learner.counts.outcomes[:] = 1
    start = learner.problem.memory.start[0]
    assert satisfying_plan(learner)[start, 0] == pytest.approx([3 / 4] * 2)
    short = ModelBased().learner(replace(problem, task=replace(problem.task, horizon=1)), counts=learner.counts)
    assert satisfying_plan(short)[start, 0] == pytest.approx([1.0, 1.0])


def test_a_plan_in_place_of_the_own_one_is_played():
    problem = Problem(mdp := crossroads(), sdnf_table(to_sdnf(parse("F[0,1] (x == 5)")), mdp, 3), tau_memory(mdp, 1))
    learner = ModelBased().learner(problem)
    table = np.zeros_like(learner.q)
    table[:, :, 1] = 1.0
    assert learner.play(np.random.default_rng(0), table)[1].tolist() == [[0, 2, 3, 3]]
    # a way that was never gone is not imagined
    learner.q[:] = 1.0 - table
    assert imagined(learner, np.array([0, 2], np.int32), 2, np.random.default_rng(1)).shape == (2, 4)
    assert set(imagined(learner, np.zeros(1, np.int32), 3, np.random.default_rng(1)).ravel().tolist()) == {0}
    learner.q[:] = table
    paths = imagined(learner, np.zeros(1, np.int32), 3, np.random.default_rng(1))
    assert paths.tolist() == [[0, 2, 3, 3]] * 3


def test_case_study_1_is_learned_in_a_few_hundred_episodes():
    mdp, task = CASE_STUDY_1_TARGET.mdp(), CASE_STUDY_1_TARGET.task_table()
    formula = to_sdnf(parse(CASE_STUDY_1.true["target"]))
    tables = [automaton.compile() for automaton in timed_automata(formula)]
    learner = ModelBased().learner(Problem(mdp, task, automaton_memory(mdp, tables)))
    rng, seed, best = np.random.default_rng(0), np.random.SeedSequence(1), optimal_value(mdp, task)
    episodes, value = 0, -math.inf
    while value < 0.95 * best and episodes < 400:
        learner.learn(rng, 20)
        episodes += 20
        value = evaluate(learner.problem, learner.q, seed, 400)
    assert value >= 0.95 * best
    assert episodes > 20


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"known": 0}, "known is 0; use a whole number, 1 or more"),
        ({"known": 1.5}, "known is 1.5; use a whole number, 1 or more"),
        ({"known": math.nan}, "known is nan; use a whole number, 1 or more"),
        ({"hope": math.nan}, "hope is nan and pooling 0.01; use a finite number, and one above 0"),
        ({"hope": math.inf}, "hope is inf"),
        ({"pooling": 0.0}, "pooling 0.0; use a finite number, and one above 0"),
        ({"pooling": math.nan}, "pooling nan"),
        ({"pooling": math.inf}, "pooling inf"),
        ({"form": "q"}, "the form of ModelBased is 'model', not 'q'"),
    ],
)
def test_settings_that_do_not_fit_are_refused(arguments: dict[str, Any], message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        ModelBased(**arguments)
    assert "\n" not in str(caught.value)


def test_what_is_of_another_shape_is_refused():
    problem = a_problem()
    learner = ModelBased().learner(problem)
    q, rng, start = learner.q, np.random.default_rng(0), np.zeros(1, np.int32)
    counts = no_counts(chance_world(2))
    refused = [
        ("the values to begin with have shape", lambda: ModelBased().learner(problem, q[:1])),
        (
            r"outcomes of the counts has shape \(5, 2, 1\); use",
            lambda: ModelBased().learner(problem, counts=no_counts(crossroads())),
        ),
        (
            "ends of the counts has shape",
            lambda: ModelBased().learner(problem, counts=counts._replace(ends=counts.ends[:2])),
        ),
        ("the table to play has shape", lambda: learner.play(rng, q[:-1])),
        ("the starts to imagine from", lambda: imagined(learner, start[:0], 1, rng)),
        ("the starts to imagine from", lambda: imagined(learner, start + 2, 1, rng)),
        ("the starts to imagine from", lambda: imagined(learner, start - 1, 1, rng)),
    ]
    for message, call in refused:
        with pytest.raises(ConfigurationError, match=message) as caught:
            call()
        assert "\n" not in str(caught.value)
