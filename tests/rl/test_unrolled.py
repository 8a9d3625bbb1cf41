"""A memory with the tick in it says the same as the memory itself, and the tick."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings

from tests.rl.form_twins import chance_world, formula_problem
from tests.rl.model_twins import slow_pairs, verdict_of
from tests.rl.test_kernels import seeds
from tests.rl.twins import problems
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import tau_memory, tick_memory
from tickwise.rl.unrolled import unroll


@settings(max_examples=100, deadline=None)
@given(problems(), seeds)
def test_every_history_leads_to_its_tick_and_to_the_state_of_the_memory(problem: Problem, seed: int):
    memory, horizon = problem.memory, problem.task.horizon
    unrolled = unroll(memory, horizon)
    rng = np.random.default_rng(seed)
    for s in range(problem.mdp.n_states):
        pair, u = int(unrolled.memory.start[s]), int(memory.start[s])
        for t in range(horizon + 1):
            assert (unrolled.tick[pair], unrolled.state[pair]) == (t, u)
            where = s, rng.integers(problem.mdp.n_actions), rng.integers(problem.mdp.successor.shape[2])
            last, pair = pair, int(unrolled.memory.delta[pair, unrolled.memory.letter[where]])
            u, s = int(memory.delta[u, memory.letter[where]]), int(problem.mdp.successor[where])
        assert pair == last


@settings(max_examples=100, deadline=None)
@given(problems())
def test_the_pairs_are_those_that_words_lead_to_each_once_by_tick(problem: Problem):
    memory, horizon = problem.memory, problem.task.horizon
    unrolled = unroll(memory, horizon)
    pairs = list(zip(unrolled.tick.tolist(), unrolled.state.tolist(), strict=True))
    assert all(before < after for before, after in pairwise(pairs))
    assert set(pairs) == slow_pairs(problem)
    assert unrolled.verdict.tolist() == [verdict_of(memory, u) for _, u in pairs]
    following = unrolled.memory.delta[:, np.unique(memory.letter)]
    last = unrolled.tick == horizon
    np.testing.assert_array_equal(unrolled.tick[following[~last]].T, [unrolled.tick[~last] + 1] * following.shape[1])
    assert (following[last] == np.flatnonzero(last)[:, None]).all()
    np.testing.assert_array_equal(unrolled.memory.letter, memory.letter)


def test_a_memory_that_tells_the_tick_has_as_many_pairs_as_states():
    mdp = chance_world()
    unrolled = unroll(tick_memory(mdp, 3), 3)
    assert unrolled.memory.delta.tolist() == [[1], [2], [3], [3]]
    assert unrolled.tick.tolist() == unrolled.state.tolist() == [0, 1, 2, 3]
    assert unrolled.verdict.tolist() == [0, 0, 0, 0]


def test_verdicts_by_hand():
    problem = formula_problem(chance_world(), to_sdnf(parse("F[1,1] (x >= 1)")))
    unrolled = unroll(problem.memory, 2)
    said = [sorted(unrolled.verdict[unrolled.tick == t].tolist()) for t in range(3)]
    # what is due at tick 1 was seen there or not
    assert [sorted(set(verdicts)) for verdicts in said] == [[0], [-1, 1], [-1, 1]]


def test_nothing_can_be_written_to():
    unrolled = unroll(tau_memory(chance_world(), 2), 4)
    arrays = unrolled.tick, unrolled.state, unrolled.verdict, unrolled.memory.start, unrolled.memory.delta
    assert not any(array.flags.writeable for array in arrays)
    assert [array.dtype.name for array in arrays] == ["int32", "int32", "int8", "int32", "int32"]


@pytest.mark.parametrize("horizon", [0, -3])
def test_an_episode_without_ticks_is_refused(horizon: int):
    with pytest.raises(ConfigurationError, match=f"the horizon of an episode is {horizon}; use 1 tick") as caught:
        unroll(tau_memory(chance_world(), 2), horizon)
    assert "\n" not in str(caught.value)
