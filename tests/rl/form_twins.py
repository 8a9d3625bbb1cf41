"""Plain-Python twins of the learning forms beside Q-learning; like those of Q-learning, they go by the definitions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.rl.twins import choose
from tickwise.envs.tabulate import cumulative, draw
from tickwise.envs.tasks import TaskMonitor
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.states import Memory


def slow_counterfactual(
    problem: Problem, q: NDArray[np.float32], settings: QSettings, rng: np.random.Generator, episodes: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Q-learning with counterfactual updates; changes ``q`` and returns what a learner does."""
    mdp, memory = problem.mdp, problem.memory
    returns = np.zeros(episodes, dtype=np.float32)
    paths = np.full((episodes, problem.task.horizon + 1), -1, dtype=np.int32)
    for episode in range(episodes):
        monitor = TaskMonitor(problem.task)
        s = draw(cumulative(mdp.initial), rng.random())
        u = int(memory.start[s])
        monitor.start(s)
        paths[episode, 0] = s
        others: set[int] = set()
        everywhere = {int(v) for v in memory.start[mdp.initial > 0] if disjunct_of(memory, v) == disjunct_of(memory, u)}
        total, over = 0.0, False
        while not over:
            action = choose(q[u, s], settings.epsilon, rng.random())
            outcome = draw(cumulative(mdp.probability)[s, action], rng.random())
            letter, next_s = memory.letter[s, action, outcome], int(mdp.successor[s, action, outcome])
            reward, over = monitor.advance(next_s)
            expected = verdicts_after(problem, u, s, action)
            agreeing = [v for v in sorted(others - {u}) if verdicts_after(problem, v, s, action) == expected]
            for v in (u, *agreeing):
                future = 0.0 if over else settings.gamma * float(q[memory.delta[v, letter], next_s].max())
                old = float(q[v, s, action])
                q[v, s, action] = old + settings.alpha * (reward + future - old)
            others = {int(memory.delta[v, letter]) for v in everywhere}
            everywhere = {int(memory.delta[v, each]) for v in everywhere for each in memory.letter[mdp.probability > 0]}
            u, s = int(memory.delta[u, letter]), next_s
            paths[episode, monitor.tick] = s
            total += reward
        returns[episode] = total
    return returns, paths


def disjunct_of(memory: Memory, u: int) -> int:
    """The disjunct whose automaton a memory state is of."""
    return max(i for i, offset in enumerate(memory.offsets) if offset <= u)


def verdicts_after(problem: Problem, u: int, s: int, action: int) -> dict[int, int]:
    """The verdict that each letter which can follow leads to."""
    memory, found = problem.memory, {}
    i = disjunct_of(memory, u)
    for k in np.flatnonzero(problem.mdp.probability[s, action] > 0):
        letter = int(memory.letter[s, action, k])
        found[letter] = int(memory.tables[i].verdict[memory.delta[u, letter] - memory.offsets[i]])
    return found
