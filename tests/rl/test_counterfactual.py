"""Counterfactual updates: like their twin, exact where they are sound, faster there, biased where they are not."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings

from tests.rl.form_twins import (
    chance_world,
    differences,
    disjunct_of,
    exact_values,
    formula_problem,
    slow_counterfactual,
    steady_problem,
)
from tests.rl.test_kernels import q_settings, seeds
from tests.rl.twins import extended_problems
from tests.strategies import sequential_conjunctions
from tickwise.automata.build import timed_automata
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.temporal import sdnf_table
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SequentialConjunction, to_sdnf
from tickwise.rl.counterfactual import Alternatives, Counterfactual
from tickwise.rl.learner import LearningForm, QLearning
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.states import automaton_memory, tau_memory

EPISODES = 12


@settings(max_examples=60, deadline=None)
@given(extended_problems(), seeds, q_settings)
def test_learning_equals_its_twin_step_for_step(problem: Problem, seed: int, chosen: QSettings):
    learner, slow = Counterfactual(chosen).learner(problem), problem.initial_q(chosen)
    fast_rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
    # in two parts, which is the same as at once
    parts = [learner.learn(fast_rng, episodes) for episodes in (5, EPISODES - 5)]
    slow_returns, slow_paths = slow_counterfactual(problem, slow, chosen, slow_rng, EPISODES)
    assert learner.q.tobytes() == slow.tobytes()
    assert np.concatenate([part[0] for part in parts]).tobytes() == slow_returns.tobytes()
    np.testing.assert_array_equal(np.concatenate([part[1] for part in parts]), slow_paths)
    assert fast_rng.bit_generator.state == slow_rng.bit_generator.state


@settings(max_examples=50, deadline=None)
@given(extended_problems())
def test_alternatives_are_what_some_word_leads_to(problem: Problem):
    mdp, memory = problem.mdp, problem.memory
    known, width = Alternatives.of(problem), memory.delta.shape[1]
    horizon = problem.task.horizon
    letters = np.unique(memory.letter[mdp.probability > 0])
    for number, t in product(range(len(memory.tables)), range(min(horizon, 4))):
        expected: list[set[int]] = [set() for _ in range(width)]
        starts = [int(u) for u in memory.start[mdp.initial > 0] if disjunct_of(memory, u) == number]
        for u, word in product(starts, product(letters, repeat=t) if t else ()):
            for letter in word:
                u = int(memory.delta[u, letter])
            expected[word[-1]].add(u)
        for letter in range(width):
            row = (number * horizon + t) * width + letter
            assert known.states[known.first[row] : known.first[row + 1]].tolist() == sorted(expected[letter])


@settings(max_examples=30, deadline=None)
@given(sequential_conjunctions(most=2, longest=1), seeds)
def test_it_finds_the_exact_values_where_the_task_is_the_formula(conjunction: SequentialConjunction, seed: int):
    rng = np.random.default_rng(seed)
    problem = steady_problem(conjunction, rng)
    exact = exact_values(problem, 0.5)
    learner = Counterfactual(QSettings(alpha=1.0, gamma=0.5, epsilon=1.0)).learner(problem)
    learner.learn(rng, 20_000)
    assert differences(learner.q, exact) == 0


def episodes_until_exact(form: LearningForm, problem: Problem, exact: dict[tuple[int, int], list[float]]) -> int:
    total = 0
    for seed in range(10):
        learner, rng = form.learner(problem), np.random.default_rng(seed)
        while differences(learner.q, exact):
            learner.learn(rng, 5)
            total += 5
    return total


def test_it_needs_fewer_episodes():
    steady = GridWorld(2, slip=0.0, turn_failure=0.0).mdp()
    sdnf = to_sdnf(parse("F[0,4] G[0,2] (0 <= x <= 1 & 1 <= y <= 2)"))
    problem, chosen = formula_problem(steady, sdnf), QSettings(alpha=1.0, gamma=0.5, epsilon=1.0)
    exact = exact_values(problem, 0.5)
    ours, plain = (episodes_until_exact(form(chosen), problem, exact) for form in (Counterfactual, QLearning))
    assert ours < 0.6 * plain


def test_outcomes_are_not_selected():
    """Of two pasts, one is satisfied by one more tick in x >= 1 and the other by two more: both at x = 1.5, tick 1.

    The other's value is 100 with a chance of 1/4 (ticks 2 and 3; a window that starts at tick 2 would be too late), -10
    else, so 17.5. Were it updated where the first stays undecided too, which is after x = 0.5, that would draw it down.
    """
    problem = formula_problem(chance_world(), to_sdnf(parse("F[0,1] G[0,2] (x >= 1)")))
    memory = problem.memory
    later = int(memory.delta[memory.start[0], memory.letter[0, 0, 1]])
    assert len({later, int(memory.delta[memory.start[1], memory.letter[1, 0, 1]])}) == 2
    learner = Counterfactual(QSettings(alpha=0.002, gamma=1.0)).learner(problem)
    learner.learn(np.random.default_rng(0), 40_000)
    # with a rate of 0.002 the standard deviation is 1.5
    assert abs(learner.q[later, 1, 0] - 17.5) < 4


def crossroads() -> TabularMDP:
    """From x = 1 to x = 5 or x = 0, from both to x = 2, and there the robot stays; nothing leads to x = 9."""
    successor = np.array([[1, 2], [3, 3], [3, 3], [3, 3], [3, 3]])[:, :, None]
    return TabularMDP(
        successor=successor,
        probability=np.ones(successor.shape),
        initial=np.eye(5)[0],
        cell=np.arange(5),
        cell_coordinates=np.array([[1.0], [5.0], [0.0], [2.0], [9.0]]),
        variables=("x",),
        limits=((0.0, 10.0),),
    )


def test_values_are_biased_where_the_task_is_not_the_formula():
    """The memory tells all that the task needs, whether x = 5 was visited; but its formula asks for x = 9 as well.

    So the formula is violated by either past, and each is told that it earned what the other did: 100 and -10, mixed
    by how often each is chosen. The assumption of counterfactual updates does not hold; Q-learning needs none.
    """
    mdp = crossroads()
    formula, task = (to_sdnf(parse(text)) for text in ("F[0,1] (x == 5) & F[2,3] (x == 9)", "F[0,1] (x == 5)"))
    tables = [automaton.compile() for automaton in timed_automata(formula)]
    problem = Problem(mdp, sdnf_table(task, mdp, 3), automaton_memory(mdp, tables))
    memory = problem.memory
    visited, missed = (
        int(memory.delta[memory.delta[memory.start[0], memory.letter[0, action, 0]], memory.letter[1 + action, 0, 0]])
        for action in range(2)
    )
    chosen = QSettings(alpha=0.02, gamma=1.0, epsilon=1.0)
    plain, ours = (form(chosen).learner(problem) for form in (QLearning, Counterfactual))
    for learner in (plain, ours):
        learner.learn(np.random.default_rng(0), 4_000)
    np.testing.assert_allclose(plain.q[[visited, missed], 3].T, [[100.0, -10.0]] * 2, atol=1e-3)
    assert (abs(ours.q[[visited, missed], 3] - 45.0) < 20.0).all()


def test_values_to_begin_with_are_copied():
    problem = formula_problem(chance_world(), to_sdnf(parse("F[1,2] (x >= 1)")))
    q = problem.initial_q(QSettings(initial=3.0))
    learner = Counterfactual().learner(problem, q)
    assert (learner.q == 3.0).all()
    learner.learn(np.random.default_rng(0), 2)
    assert (q == 3.0).all()
    assert (learner.q != 3.0).any()


def test_a_memory_without_verdicts_is_refused():
    problem = formula_problem(chance_world(), to_sdnf(parse("F[1,2] (x >= 1)")))
    plain = replace(problem, memory=tau_memory(problem.mdp, 2))
    with pytest.raises(ConfigurationError, match="this memory follows no automaton; use automaton_memory") as caught:
        Counterfactual().learner(plain)
    assert "\n" not in str(caught.value)
