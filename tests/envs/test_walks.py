from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.twins import random_problem
from tickwise.envs.estimation import estimated
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import success_probability
from tickwise.envs.tasks import TaskMonitor
from tickwise.envs.temporal import FormulaTask
from tickwise.envs.walks import Walks, random_walks
from tickwise.errors import DataError

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_walks_go_where_the_world_lets_them_and_end_with_the_task(seed: int):
    problem = random_problem(seed)
    mdp, task = problem.mdp, problem.task
    walks = random_walks(mdp, task, 20, np.random.default_rng(seed))
    assert walks.states.shape == (20, task.horizon + 1)
    for states, actions in zip(walks.states.tolist(), walks.actions.tolist(), strict=True):
        assert mdp.initial[states[0]] > 0
        monitor, over = TaskMonitor(task), False
        monitor.start(states[0])
        for before, action, after in zip(states, actions, states[1:], strict=False):
            if over:
                assert action == after == -1
                continue
            assert mdp.probability[before, action][mdp.successor[before, action] == after].sum() > 0
            _, over = monitor.advance(after)
        assert over


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_every_chance_is_a_frequency(seed: int):
    problem = random_problem(seed)
    walks = random_walks(problem.mdp, problem.task, 20, np.random.default_rng(seed))
    model = estimated(problem.mdp, walks.states, walks.actions)
    seen: dict[tuple[int, int], list[int]] = {}
    for states, actions in zip(walks.states.tolist(), walks.actions.tolist(), strict=True):
        for before, action, after in zip(states, actions, states[1:], strict=False):
            if action >= 0:
                seen.setdefault((before, action), []).append(after)
    for s in range(model.n_states):
        assert model.initial[s] == pytest.approx((walks.states[:, 0] == s).mean())
        for a in range(model.n_actions):
            chances = np.bincount(model.successor[s, a], weights=model.probability[s, a], minlength=model.n_states)
            frequencies = np.bincount(seen.get((s, a), [s]), minlength=model.n_states)  # never tried: nothing happens
            assert chances == pytest.approx(frequencies / frequencies.sum())


def test_a_model_from_many_walks_is_nearly_the_world():
    mdp = GridWorld(3).mdp()
    task = FormulaTask("F[4,8] (0 <= x <= 1 & 0 <= y <= 1)", 8, ends="violated").table(mdp)
    walks = random_walks(mdp, task, 30_000, np.random.default_rng(0))
    model = estimated(mdp, walks.states, walks.actions)
    assert success_probability(model, task) == pytest.approx(success_probability(mdp, task), abs=0.01)
    assert abs(model.initial - mdp.initial).max() < 0.01


def test_walks_of_other_shapes_are_refused():
    with pytest.raises(DataError, match=r"use \(episodes, ticks \+ 1\)"):
        Walks(np.zeros((2, 3), np.int32), np.zeros((2, 3), np.int32))
    with pytest.raises(DataError, match="one episode or more"):
        Walks(np.zeros((0, 3), np.int32), np.zeros((0, 2), np.int32))
