from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.twins import history_success, history_value, random_mdp, random_task
from tickwise.envs.catalog import CASE_STUDY_1_SOURCE, CASE_STUDY_1_TARGET, CASE_STUDY_2_SOURCE
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import best_success_probability, optimal_value, reachable, success_probability, worst_value
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import ReachStayReach, Recurrence, TaskTable
from tickwise.logic.syntax import Box

LEFT, RIGHT = Box.of(x=(0, 1)), Box.of(x=(1, 2))


def small(seed: int) -> tuple[TabularMDP, TaskTable]:
    """A random world of up to three states, and a task of up to four ticks that may end early."""
    rng = np.random.default_rng(seed)
    states, actions, outcomes, horizon = (int(rng.integers(1, most + 1)) for most in (3, 2, 2, 4))
    return random_mdp(rng, states, actions, outcomes), random_task(rng, states, horizon)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_values_equal_brute_force_over_histories(seed: int):
    mdp, task = small(seed)
    assert optimal_value(mdp, task) == pytest.approx(history_value(mdp, task), abs=1e-9)
    assert worst_value(mdp, task) == pytest.approx(history_value(mdp, task, sign=-1.0), abs=1e-9)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_chances_of_success_equal_brute_force_over_histories(seed: int):
    mdp, task = small(seed)
    mean = history_success(mdp, task, lambda chances: sum(chances) / len(chances))
    assert success_probability(mdp, task) == pytest.approx(mean, abs=1e-9)
    assert best_success_probability(mdp, task) == pytest.approx(history_success(mdp, task, max), abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_reachable_task_states_are_those_of_some_sequence_of_letters(seed: int):
    _, task = small(seed)
    states = {int(task.delta[0, letter]) for letter in task.letter}
    found = reachable(task.delta, task.letter, task.horizon)
    for row in found:
        assert set(np.flatnonzero(row).tolist()) == states
        states = {int(task.delta[state, letter]) for state in states for letter in task.letter}


def test_one_step_by_hand():
    """Two cells side by side, one step: only a robot on the left that looks east can get to the right at once."""
    world = GridWorld(2, slip=0.0, turn_failure=0.0)
    task = ReachStayReach(first=LEFT, stay=0, second=RIGHT, deadline=1)
    mdp = world.mdp()
    table = task.table(mdp)
    # starts: 2 of 16 are on the left and look east
    assert optimal_value(mdp, table) == pytest.approx((2 * 100 + 14 * -10) / 16)
    assert worst_value(mdp, table) == pytest.approx(-10.0)
    assert best_success_probability(mdp, table) == pytest.approx(2 / 16)
    assert success_probability(mdp, table) == pytest.approx(2 / 16 / 3)  # straight is one of three actions


def test_one_step_with_slips_by_hand():
    # east of the left cells: 0.92 forward; north and south slip to the right with 0.04 each
    world = GridWorld(2)
    mdp = world.mdp()
    table = ReachStayReach(first=LEFT, stay=0, second=RIGHT, deadline=1).table(mdp)
    chance = (2 * 0.92 + 4 * 0.04) / 16
    assert optimal_value(mdp, table) == pytest.approx(110 * chance - 10)


def test_a_rule_that_ends_the_episode_by_hand():
    """Without slips the robot keeps turning on the spot: where it starts decides, and breaking comes once."""
    world = GridWorld(2, slip=0.0, turn_failure=0.0)
    mdp = world.mdp()
    table = Recurrence(regions=(LEFT,), period=1, greens=(LEFT,), deadline=3).table(mdp)
    # on the left: 100 a tick. On the right: from tick 0 on, tick 1 must be on the left, or -800 at once; only
    # the two that look west can do it
    best = (8 * 300 + 2 * 300 + 6 * -800) / 16
    assert optimal_value(mdp, table) == pytest.approx(best)


@pytest.mark.parametrize("spec", [CASE_STUDY_1_SOURCE, CASE_STUDY_1_TARGET], ids=lambda spec: spec.name)
def test_case_study_1_lies_between_failing_and_the_reward(spec):
    mdp, task = spec.mdp(), spec.task_table()
    assert worst_value(mdp, task) == pytest.approx(-10.0, abs=1e-6)
    assert 80 < optimal_value(mdp, task) < 100


def test_a_later_deadline_never_harms_in_case_study_1():
    mdp = CASE_STUDY_1_TARGET.mdp()
    values = [
        optimal_value(mdp, dataclasses.replace(CASE_STUDY_1_TARGET.task, deadline=deadline).table(mdp))
        for deadline in (20, 30, 40, 60)
    ]
    assert values == sorted(values)


def test_always_failing_is_the_worst_in_case_study_2():
    # a break at the first possible tick costs 800; starts in the region can break later only
    mdp, task = CASE_STUDY_2_SOURCE.mdp(), CASE_STUDY_2_SOURCE.task_table()
    assert worst_value(mdp, task) == pytest.approx(-800.0, abs=5.0)
    assert optimal_value(mdp, task) > 0


def test_the_value_of_a_reward_at_the_deadline_follows_from_the_chance():
    mdp, task = CASE_STUDY_1_SOURCE.mdp(), CASE_STUDY_1_SOURCE.task_table()
    best, random = best_success_probability(mdp, task), success_probability(mdp, task)
    assert optimal_value(mdp, task) == pytest.approx(110 * best - 10)
    assert 0 < random < best <= 1
