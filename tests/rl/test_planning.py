"""The compiled loops of model-based learning equal their twins, and planning on the true model is exact planning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.form_twins import disjunct_of
from tests.rl.model_twins import Row, SlowPlan, counted_problem, random_counts, slow_imagine, slow_play
from tests.rl.test_kernels import seeds
from tests.rl.twins import choose, problems
from tests.strategies import sdnfs
from tickwise.envs.planning import best_success_probability, optimal_value
from tickwise.envs.temporal import ENDINGS, Ending, sdnf_table
from tickwise.logic.sdnf import SDNF
from tickwise.rl.model import ModelBased, ModelLearner, imagined, satisfying_plan, sweep
from tickwise.rl.planning import CLASSES, greedy_action
from tickwise.rl.qlearning import Problem
from tickwise.rl.unrolled import unroll

endings = st.sampled_from(list(ENDINGS))


def with_any_values(problem: Problem, rng: np.random.Generator) -> tuple[ModelLearner, Row]:
    """A learner that follows a table with many ties, and the same table by tick and memory state."""
    learner = ModelBased().learner(problem, counts=random_counts(problem, rng))
    learner.q[:] = rng.integers(0, 3, size=learner.q.shape)
    pairs = zip(learner.unrolled.tick.tolist(), learner.unrolled.state.tolist(), strict=True)
    number = {pair: n for n, pair in enumerate(pairs)}
    return learner, lambda t, u, s: learner.q[number[t, u], s]


@given(st.lists(st.sampled_from([-1.5, 0.0, 2.0]), min_size=1, max_size=6), st.floats(0, 1, exclude_max=True))
def test_a_greedy_action_equals_its_twin(values: list[float], number: float):
    row = np.array(values, dtype=np.float32)
    assert greedy_action(row, number) == choose(row, 0.0, number)


def test_equal_actions_are_as_probable():
    row = np.array([1.0, 3.0, 3.0, 2.0, 3.0], dtype=np.float32)
    assert [greedy_action(row, (n + 0.5) / 6) for n in range(6)] == [1, 1, 2, 2, 4, 4]
    assert greedy_action(row, 1.0 - 2.0**-53) == 4


@settings(max_examples=60, deadline=None)
@given(problems(), seeds)
def test_play_equals_its_twin_step_for_step(problem: Problem, seed: int):
    rng = np.random.default_rng(seed)
    learner, row = with_any_values(problem, rng)
    counts = type(learner.counts)(*(array.copy() for array in learner.counts))
    fast_rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    for _ in range(8):
        returns, paths = learner.play(fast_rng)
        total, path = slow_play(problem, row, counts, slow_rng)
        assert returns.tobytes() == total.tobytes()
        np.testing.assert_array_equal(paths, [path])
    for array, expected in zip(learner.counts, counts, strict=True):
        assert array.tobytes() == expected.tobytes()
    assert fast_rng.bit_generator.state == slow_rng.bit_generator.state


@settings(max_examples=100, deadline=None)
@given(problems(), seeds, st.sampled_from([1, 2, 5]), st.booleans())
def test_a_plan_equals_its_twin(problem: Problem, seed: int, known: int, by_pair: bool):
    rng = np.random.default_rng(seed)
    unrolled, counts = unroll(problem.memory, problem.task.horizon), random_counts(problem, rng)
    reward, ends = rng.normal(size=counts.rewards.shape), rng.random(counts.rewards.shape)
    tables = problem.memory.n_states, problem.mdp.n_states, problem.mdp.n_actions
    values, worth = rng.normal(size=tables).astype(np.float32), rng.normal(size=problem.task.horizon + 1)
    given_values = values[unrolled.state] if by_pair else np.empty((0, 1, 1), np.float32)
    q = np.full((unrolled.memory.n_states, *tables[1:]), np.nan, dtype=np.float32)
    whole = replace(problem, memory=unrolled.memory)
    sweep(whole, unrolled, counts, known, reward, ends, worth[unrolled.tick], given_values, q)
    slow = SlowPlan(
        problem, counts.outcomes, known, reward, ends, lambda t, u, s, a: values[u, s, a] if by_pair else worth[t]
    )
    pairs = zip(unrolled.tick.tolist(), unrolled.state.tolist(), strict=True)
    np.testing.assert_array_equal(q, [[slow.row(t, u, s) for s in range(tables[1])] for t, u in pairs], strict=True)


@settings(max_examples=60, deadline=None)
@given(problems(), seeds)
def test_imagined_episodes_equal_their_twin(problem: Problem, seed: int):
    rng = np.random.default_rng(seed)
    learner, row = with_any_values(problem, rng)
    starts = rng.integers(problem.mdp.n_states, size=rng.integers(1, 4)).astype(np.int32)
    fast_rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    paths = imagined(learner, starts, 8, fast_rng)
    expected = slow_imagine(problem, row, learner.counts.outcomes, starts, 8, slow_rng)
    np.testing.assert_array_equal(paths, expected, strict=True)
    assert fast_rng.bit_generator.state == slow_rng.bit_generator.state


@settings(max_examples=100, deadline=None)
@given(sdnfs(disjuncts=1, longest=3), seeds, endings)
def test_a_plan_on_the_true_model_is_worth_the_optimal_value(sdnf: SDNF, seed: int, ends: Ending):
    problem, _, counts = counted_problem(sdnf, ends, np.random.default_rng(seed))
    learner, mdp = ModelBased().learner(problem, counts=counts), problem.mdp
    reached = learner.q[learner.problem.memory.start, range(4)].max(axis=1)
    assert mdp.initial @ reached == pytest.approx(optimal_value(mdp, problem.task), rel=1e-5, abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(sdnfs(longest=3), seeds)
def test_a_plan_to_satisfy_has_the_greatest_probability_of_the_disjunct_that_is_followed(sdnf: SDNF, seed: int):
    problem, moved, counts = counted_problem(sdnf, "deadline", np.random.default_rng(seed))
    learner, mdp = ModelBased().learner(problem, counts=counts), problem.mdp
    reached = satisfying_plan(learner)[learner.problem.memory.start, range(4)].max(axis=1)
    for s in range(4):
        disjunct = moved.disjuncts[disjunct_of(problem.memory, int(problem.memory.start[s]))]
        there = replace(mdp, initial=np.eye(4)[s])
        alone = sdnf_table(SDNF((disjunct,)), mdp, problem.task.horizon)
        assert reached[s] == pytest.approx(best_success_probability(there, alone), abs=1e-5)
        assert reached[s] <= best_success_probability(there, problem.task) + 1e-5


@settings(max_examples=50, deadline=None)
@given(problems(), seeds)
def test_what_was_met_counts_in_all_memory_states(problem: Problem, seed: int):
    """A single episode makes its states and actions known, whatever the memory would have been there."""
    learner, mark = ModelBased().learner(problem), np.float32(-7.0)
    learner.play(np.random.default_rng(seed))
    nothing = np.zeros((CLASSES, problem.mdp.n_states))
    worth = np.full(learner.unrolled.memory.n_states, float(mark))
    q = np.zeros_like(learner.q)
    arguments = learner.problem, learner.unrolled, learner.counts, 1, nothing, nothing + 1.0, worth
    sweep(*arguments, np.empty((0, 1, 1), np.float32), q)
    before_the_end = learner.unrolled.tick < problem.task.horizon
    unknown = learner.counts.outcomes.sum(axis=2) == 0
    np.testing.assert_array_equal(q[before_the_end] == mark, np.broadcast_to(unknown, q[before_the_end].shape))
    assert (q[~before_the_end] == 0.0).all()
