from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rl.twins import problems, random_problem
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import best_success_probability
from tickwise.envs.tasks import TaskMonitor
from tickwise.envs.temporal import FormulaTask
from tickwise.errors import ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.qlearning import Problem, QSettings, evaluate, learn
from tickwise.rl.states import automaton_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.promise import greedy_success, promise


def slow_greedy_success(problem: Problem, q: np.ndarray) -> float:
    """The sum over all paths, by the definitions."""
    mdp, task, memory = problem.mdp, problem.task, problem.memory

    def chance(path: tuple[int, ...], u: int) -> float:
        monitor = TaskMonitor(task)
        monitor.start(path[0])
        over = False
        for state in path[1:]:
            _, over = monitor.advance(state)
        if over:
            return float(task.success[monitor.state])
        s = path[-1]
        action = int(q[u, s].argmax())
        total = 0.0
        for after, letter, share in zip(
            mdp.successor[s, action], memory.letter[s, action], mdp.probability[s, action], strict=True
        ):
            if share > 0:
                total += share * chance((*path, int(after)), int(memory.delta[u, letter]))
        return total

    starts = np.flatnonzero(mdp.initial)
    return sum(float(mdp.initial[s]) * chance((int(s),), int(memory.start[s])) for s in starts)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_it_is_the_sum_over_all_paths(seed: int):
    problem = random_problem(seed, horizon=5)
    shape = (problem.memory.n_states, problem.mdp.n_states, problem.mdp.n_actions)
    q = np.random.default_rng(seed).integers(3, size=shape).astype(np.float32)  # with ties
    assert greedy_success(problem, q) == pytest.approx(slow_greedy_success(problem, q), abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(problems())
def test_no_policy_promises_more_than_the_best(problem: Problem):
    q = problem.initial_q(QSettings())
    learn(problem, q, QSettings(), np.random.default_rng(0), 50)
    assert greedy_success(problem, q) <= best_success_probability(problem.mdp, problem.task) + 1e-9


def test_evaluation_comes_near_the_promise():
    formula = to_sdnf(parse("F[2,7] G[0,1] (0 <= x <= 1 & 0 <= y <= 1) & F[10,12] (1 <= x <= 3 & 1 <= y <= 2)"))
    mdp = GridWorld(3).mdp()
    task = FormulaTask(str(formula), 12, reward=1.0, penalty=0.0).table(mdp)
    problem = Problem(mdp, task, automaton_memory(mdp, tick_tables(formula, 12)))
    values, chosen = problem.initial_q(QSettings(initial=1.0)), QSettings(initial=1.0, epsilon=0.05)
    found = []
    for episodes in (0, 2_000, 20_000):
        learn(problem, values, chosen, np.random.default_rng(episodes), episodes)
        found.append(promise(formula, 12, mdp, problem.memory, values))
        assert evaluate(problem, values, np.random.SeedSequence(1), 40_000) == pytest.approx(found[-1], abs=0.01)
    assert found[0] < 0.1
    assert found[-1] > 0.7


def test_a_region_outside_the_world_is_refused():
    formula = to_sdnf(parse("F[0,4] (x >= 7)"))
    mdp = GridWorld(2).mdp()
    memory = automaton_memory(mdp, tick_tables(formula, 4))
    with pytest.raises(ConfigurationError):
        promise(formula, 4, mdp, memory, np.zeros((memory.n_states, mdp.n_states, mdp.n_actions), np.float32))
