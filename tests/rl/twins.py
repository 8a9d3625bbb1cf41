"""Plain-Python twins of the compiled loops, and small random problems to run both on.

The twins go by the definitions: a `TaskMonitor` follows the task, `draw` samples, and nothing is kept from
one step for the next.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.envs.twins import random_mdp, random_task
from tests.strategies import sdnfs
from tickwise.automata.build import timed_automata
from tickwise.envs.tabulate import cumulative, draw
from tickwise.envs.tasks import TaskMonitor
from tickwise.logic.sdnf import SDNF
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.states import Memory, automaton_memory


def choose(row: NDArray[np.float32], epsilon: float, uniform: float) -> int:
    """An ε-greedy action: one number in [0, 1) decides whether it is random, and which it is."""
    if uniform < epsilon:
        return int(uniform / epsilon * len(row))
    best = [action for action in range(len(row)) if row[action] == row.max()]
    return best[int((uniform - epsilon) / (1.0 - epsilon) * len(best))]


def advance(problem: Problem, u: int, s: int, action: int, uniform: float) -> tuple[int, int]:
    """The next memory state and the next state."""
    outcome = draw(cumulative(problem.mdp.probability)[s, action], uniform)
    letter = problem.memory.letter[s, action, outcome]
    return int(problem.memory.delta[u, letter]), int(problem.mdp.successor[s, action, outcome])


def slow_q_learning(
    problem: Problem, q: NDArray[np.float32], settings: QSettings, rng: np.random.Generator, episodes: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Q-learning; changes ``q`` and returns what `collect` does."""
    return _slow_learning(problem, q, lambda *_: settings.alpha, settings, rng, episodes)


def slow_trusting(
    problem: Problem,
    q: NDArray[np.float32],
    confidence: NDArray[np.float32],
    visits: NDArray[np.uint32],
    settings: QSettings,
    patience: float,
    rng: np.random.Generator,
    episodes: int,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Q-learning with confidence; changes ``q`` and ``visits`` and returns what `collect` does."""

    def rate(u: int, s: int, action: int) -> float:
        made = int(visits[u, s, action])
        visits[u, s, action] += 1
        trust = float(confidence[u, s, action]) * patience / (patience + made)
        return settings.alpha / (1.0 + settings.alpha * trust)

    return _slow_learning(problem, q, rate, settings, rng, episodes)


def _slow_learning(
    problem: Problem,
    q: NDArray[np.float32],
    rate: Callable[[int, int, int], float],
    settings: QSettings,
    rng: np.random.Generator,
    episodes: int,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Q-learning with a rate for each update; changes ``q`` and returns what `collect` does."""
    returns = np.zeros(episodes, dtype=np.float32)
    paths = np.full((episodes, problem.task.horizon + 1), -1, dtype=np.int32)
    for episode in range(episodes):
        monitor = TaskMonitor(problem.task)
        s = draw(cumulative(problem.mdp.initial), rng.random())
        u = int(problem.memory.start[s])
        monitor.start(s)
        paths[episode, 0] = s
        total, over = 0.0, False
        while not over:
            action = choose(q[u, s], settings.epsilon, rng.random())
            next_u, next_s = advance(problem, u, s, action, rng.random())
            reward, over = monitor.advance(next_s)
            future = 0.0 if over else settings.gamma * float(q[next_u, next_s].max())
            old = float(q[u, s, action])
            q[u, s, action] = old + rate(u, s, action) * (reward + future - old)
            u, s = next_u, next_s
            paths[episode, monitor.tick] = s
            total += reward
        returns[episode] = total
    return returns, paths


def slow_greedy_returns(
    problem: Problem, q: NDArray[np.float32], rng: np.random.Generator, episodes: int
) -> NDArray[np.float32]:
    """Returns of the greedy policy, ties to the lower action."""
    returns = np.zeros(episodes, dtype=np.float32)
    for episode in range(episodes):
        monitor = TaskMonitor(problem.task)
        s = draw(cumulative(problem.mdp.initial), rng.random())
        u = int(problem.memory.start[s])
        monitor.start(s)
        total, over = 0.0, False
        while not over:
            u, s = advance(problem, u, s, int(q[u, s].argmax()), rng.random())
            reward, over = monitor.advance(s)
            total += reward
        returns[episode] = total
    return returns


def random_problem(
    seed: int, *, states: int = 4, actions: int = 3, outcomes: int = 3, horizon: int = 6, formula: SDNF | None = None
) -> Problem:
    """A random world, task and memory, or the memory of a formula's extended states; sizes are at most those given."""
    rng = np.random.default_rng(seed)
    states, actions, outcomes, horizon = (
        int(rng.integers(1, most + 1)) for most in (states, actions, outcomes, horizon)
    )
    memory_states, letters = rng.integers(1, 5, size=2)
    mdp = random_mdp(rng, states, actions, outcomes)
    memory = Memory(
        start=rng.integers(memory_states, size=states),
        delta=rng.integers(memory_states, size=(memory_states, letters)),
        letter=rng.integers(letters, size=mdp.successor.shape),
    )
    if formula is not None:
        memory = automaton_memory(mdp, tuple(automaton.compile() for automaton in timed_automata(formula)))
    return Problem(mdp, random_task(rng, states, horizon), memory)


def problems() -> st.SearchStrategy[Problem]:
    """Random problems, half of them with the extended states of a formula of one to three disjuncts."""
    seeds = st.integers(0, 2**32 - 1)
    return st.one_of(st.builds(random_problem, seeds), extended_problems())


def extended_problems() -> st.SearchStrategy[Problem]:
    """Random problems with the extended states of a formula; the task knows nothing of it and may end early."""
    return st.builds(random_problem, st.integers(0, 2**32 - 1), horizon=st.just(12), formula=sdnfs(longest=3))


def nearest_disjunct(problem: Problem, s: int) -> int:
    """The disjunct whose first region's centroid is nearest to a state, ties to the lower."""
    mdp, distances = problem.mdp, []
    for i, table in enumerate(problem.memory.tables):
        centroid = table.automaton.conjunction.primitives[0].box.centroid(mdp.variables, mdp.limits)
        distances.append((sum((a - b) ** 2 for a, b in zip(mdp.coordinates[s], centroid, strict=True)), i))
    return min(distances)[1]
