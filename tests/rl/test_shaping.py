"""Shaping: what it is equal to, and that it leaves the optimum as it is, exactly, whatever the potential."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.rl.form_twins import chance_world, differences, exact_values, formula_problem, slow_shaping, steady_problem
from tests.rl.test_kernels import seeds
from tests.rl.twins import extended_problems
from tests.strategies import sequential_conjunctions
from tickwise.automata.distance import acceptance_potential, progress_potential
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SequentialConjunction, to_sdnf
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.shaping import POTENTIALS, Potential, Shaping
from tickwise.rl.states import tau_memory

EPISODES = 12


def whole_numbers(seed: int) -> Potential:
    """A random potential of whole numbers: any is allowed."""

    def potential(tables, gamma):
        del gamma
        return np.random.default_rng(seed).integers(-40, 41, size=sum(len(table) for table in tables)).astype(float)

    return potential


def rounded(problem: Problem) -> Problem:
    """The problem with rewards that are whole numbers, so that sums are exact."""
    task = problem.task
    return replace(
        problem, task=replace(task, reward=np.round(4 * task.reward), final_reward=np.round(task.final_reward))
    )


def play_both(problem: Problem, form: Shaping, seed: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The learner's values, and those of its twin, which shapes rewards, with the potential added; paths are equal."""
    rngs = [np.random.default_rng(seed) for _ in range(2)]
    phi = form.phi(problem).astype(np.float64)
    slow, learner = problem.initial_q(form.settings), form.learner(problem)
    # in two parts, which is the same as at once
    parts = [learner.learn(rngs[0], episodes) for episodes in (5, EPISODES - 5)]
    returns, paths = slow_shaping(problem, slow, phi, form.settings, rngs[1], EPISODES)
    assert np.concatenate([part[0] for part in parts]).tobytes() == returns.tobytes()
    np.testing.assert_array_equal(np.concatenate([part[1] for part in parts]), paths)
    assert rngs[0].bit_generator.state == rngs[1].bit_generator.state
    return learner.q, slow + phi.astype(np.float32)[:, None, None]


@settings(max_examples=100, deadline=None)
@given(extended_problems(), seeds, st.sampled_from([0.0, 0.3, 1.0]))
def test_learning_equals_its_twin_step_for_step(problem: Problem, seed: int, epsilon: float):
    # without rounding: whole numbers, no discount and α = 1, so that even ties are broken alike
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(POTENTIALS, "any", whole_numbers(seed))
        form = Shaping(QSettings(alpha=1.0, gamma=1.0, epsilon=epsilon, initial=3.0), scale=1.0, potential="any")
        ours, theirs = play_both(rounded(problem), form, seed)
    np.testing.assert_array_equal(ours, theirs)


@settings(max_examples=40, deadline=None)
@given(extended_problems(), seeds, st.sampled_from(list(POTENTIALS)))
def test_so_it_is_with_a_discount(problem: Problem, seed: int, name: str):
    # up to rounding; all actions are random, so that rounding decides none
    form = Shaping(QSettings(alpha=0.3, gamma=0.9, epsilon=1.0), scale=20.0, potential=name)
    np.testing.assert_allclose(*play_both(problem, form, seed), atol=1e-3)


@settings(max_examples=40, deadline=None)
@given(extended_problems(), seeds)
def test_the_optimal_values_are_lower_by_the_potential_exactly(problem: Problem, seed: int):
    """Value iteration over ticks, of the product of world, task and memory, in fractions."""
    mdp, memory, task = problem.mdp, problem.memory, rounded(problem).task
    horizon, gamma = min(task.horizon, 4), Fraction(1, 2)
    phi = [Fraction(value) for value in whole_numbers(seed)(memory.tables, 0.5)]

    @cache
    def values(t: int, u: int, w: int, s: int, shaped: bool) -> list[Fraction]:
        worth = []
        for action in range(mdp.n_actions):
            chances = [Fraction(chance) for chance in mdp.probability[s, action]]
            total = Fraction(0)
            for k, chance in enumerate(chances):
                if chance == 0:
                    continue
                next_u, next_s = memory.delta[u, memory.letter[s, action, k]], mdp.successor[s, action, k]
                next_w = task.delta[w, task.letter[next_s]]
                over = task.terminated[next_w] or t + 1 == horizon
                gained = Fraction(float(task.reward[next_w, next_s]))
                if shaped:
                    gained += gamma * (0 if over else phi[next_u]) - phi[u]
                later = 0 if over else max(values(t + 1, int(next_u), int(next_w), int(next_s), shaped))
                total += chance * (gained + gamma * later)
            worth.append(total / sum(chances))
        return worth

    for s in range(mdp.n_states):
        u, w = int(memory.start[s]), int(task.delta[0, task.letter[s]])
        assert values(0, u, w, s, True) == [value - phi[u] for value in values(0, u, w, s, False)]


@settings(max_examples=30, deadline=None)
@given(sequential_conjunctions(most=2, longest=1), seeds)
def test_it_finds_the_exact_values_of_the_task_itself(conjunction: SequentialConjunction, seed: int):
    rng = np.random.default_rng(seed)
    problem = steady_problem(conjunction, rng)
    exact = exact_values(problem, 0.5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(POTENTIALS, "any", whole_numbers(seed))
        learner = Shaping(QSettings(alpha=1.0, gamma=0.5, epsilon=1.0), scale=1.0, potential="any").learner(problem)
    learner.learn(rng, 20_000)
    assert differences(learner.q, exact) == 0


def a_problem() -> Problem:
    return formula_problem(chance_world(), to_sdnf(parse("F[0,1] G[0,2] (x >= 1)")))


def test_the_potentials_are_those_of_the_tables():
    problem, chosen = a_problem(), QSettings(gamma=0.5)
    tables = problem.memory.tables
    np.testing.assert_allclose(Shaping(chosen, 8.0).phi(problem), progress_potential(tables, 8.0))
    np.testing.assert_allclose(Shaping(chosen, 8.0, "acceptance").phi(problem), acceptance_potential(tables, 0.5, 8.0))


def test_the_potential_is_added_to_values_to_begin_with_which_stay_as_they_are():
    problem = a_problem()
    q = problem.initial_q(QSettings(initial=3.0))
    learner = Shaping().learner(problem, q)
    np.testing.assert_array_equal(learner.q - q, np.broadcast_to(Shaping().phi(problem)[:, None, None], q.shape))
    learner.learn(np.random.default_rng(0), 2)
    assert (q == 3.0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scale": float("nan")}, "the scale of the potential is nan; use a finite number"),
        ({"potential": "height"}, "no potential 'height'; use progress, acceptance, or add yours"),
        ({"form": "q"}, "the form of Shaping is 'shaping', not 'q'"),
    ],
)
def test_what_does_not_fit_is_refused(arguments: dict[str, float], message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        Shaping(**arguments)
    assert "\n" not in str(caught.value)


def test_a_memory_without_automata_and_a_potential_of_another_shape_are_refused(monkeypatch: pytest.MonkeyPatch):
    problem = a_problem()
    with pytest.raises(ConfigurationError, match="this memory follows none; use automaton_memory"):
        Shaping().learner(replace(problem, memory=tau_memory(problem.mdp, 2)))
    monkeypatch.setitem(POTENTIALS, "short", lambda *_: np.zeros(1))
    with pytest.raises(ConfigurationError, match="'short' has shape \\(1,\\); give one number a memory state"):
        Shaping(potential="short").learner(problem)
