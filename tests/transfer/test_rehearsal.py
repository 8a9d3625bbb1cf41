from __future__ import annotations

import numpy as np
import pytest

from tickwise._seeding import generator, seed_sequence
from tickwise.envs.estimation import estimated
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import optimal_value, worst_value
from tickwise.envs.temporal import FormulaTask
from tickwise.envs.walks import random_walks
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import Problem, QSettings, evaluate, learn
from tickwise.rl.states import automaton_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.rehearsal import Goal, learning_times, rehearsal

CHOSEN = QSettings(initial=40.0)
FORM = QLearning(CHOSEN)


def problem(*, model: bool = False) -> Problem:
    """Two ticks in a corner, then beyond the middle; in the world itself or in a model of it."""
    mdp = GridWorld(3).mdp()
    task = FormulaTask("F[4,9] G[0,1] (0 <= x <= 1 & 0 <= y <= 1) & F[12,16] (1 <= x <= 3 & 2 <= y <= 3)", 16)
    if model:
        walks = random_walks(mdp, task.table(mdp), 500, np.random.default_rng(0))
        mdp = estimated(mdp, walks.states, walks.actions)
    return Problem(mdp, task.table(mdp), automaton_memory(mdp, tick_tables(task.sdnf, 16)))


def test_the_threshold_by_hand():
    given = problem()
    worst, best = worst_value(given.mdp, given.task), optimal_value(given.mdp, given.task)
    assert worst == pytest.approx(-10, abs=0.01)
    assert Goal(level=0.5).threshold(given) == pytest.approx((worst + best) / 2)


def test_times_are_those_of_learning_and_looking_in_turn():
    given, goal = problem(), Goal(level=0.9, step=50, plays=100, most=20_000)
    found = learning_times(given, None, 3, 2, form=FORM, goal=goal)
    for run, time in enumerate(found):
        assert time is not None
        assert 0 < time < 20_000
        q, rng = given.initial_q(CHOSEN), generator(3, "learn", run)
        for episodes in range(0, time + 1, 50):
            if episodes:
                learn(given, q, CHOSEN, rng, 50)
            there = evaluate(given, q, seed_sequence(3, "evaluate"), 100) >= goal.threshold(given)
            assert there == (episodes == time)
    assert found == learning_times(given, given.initial_q(CHOSEN), 3, 2, form=FORM, goal=goal)


def test_what_is_learned_needs_no_time_and_what_is_not_reached_has_none():
    given = problem()
    q = given.initial_q(CHOSEN)
    learn(given, q, CHOSEN, np.random.default_rng(0), 50_000)
    before = q.copy()
    assert learning_times(given, q, 0, 2, form=FORM, goal=Goal(level=0.9)) == [0, 0]
    assert (q == before).all()
    short = Goal(most=200)
    assert learning_times(given, None, 0, 2, form=FORM, goal=short) == [None, None]
    assert rehearsal(given, None, runs=2, form=FORM, goal=short) == 200


def test_a_rehearsal_tells_good_values_from_bad_ones_and_none():
    given, model = problem(), problem(model=True)
    good = given.initial_q(CHOSEN)
    learn(given, good, CHOSEN, np.random.default_rng(0), 50_000)
    best, none, bad = (rehearsal(model, q, form=FORM, goal=Goal(level=0.8)) for q in (good, None, -good))
    assert best < none < bad


@pytest.mark.parametrize("wrong", [{"level": 0}, {"level": 1.1}, {"step": 0}, {"plays": 0}, {"most": 0}])
def test_goals_out_of_range_are_refused(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        Goal(**wrong)
