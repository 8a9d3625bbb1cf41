"""Plain-Python twins of the learning forms beside Q-learning, and exact values; they go by the definitions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tests.envs.twins import random_mdp
from tests.rl.twins import advance, choose
from tickwise.automata.build import timed_automata
from tickwise.envs.tabulate import TabularMDP, cumulative, draw
from tickwise.envs.tasks import TaskMonitor
from tickwise.envs.temporal import sdnf_table
from tickwise.logic.sdnf import SDNF, SequentialConjunction
from tickwise.logic.syntax import Box
from tickwise.rl.actor_critic import FORGOTTEN, ActorCritic
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.states import Memory, automaton_memory


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


def formula_problem(mdp: TabularMDP, sdnf: SDNF, task: SDNF | None = None) -> Problem:
    """The task is to satisfy the memory's formula, or another; all clocks run, so that they tell the tick."""
    deadline = max(1, *(disjunct.primitives[-1].end for disjunct in sdnf.disjuncts))
    tables = [automaton.compile(reduce=False) for automaton in timed_automata(sdnf)]
    return Problem(mdp, sdnf_table(task or sdnf, mdp, deadline, ends="decided"), automaton_memory(mdp, tables))


def exact_values(problem: Problem, gamma: float) -> dict[tuple[int, int], list[float]]:
    """Q* of each memory state and state in which a step is made, by the definition, over all histories.

    The world is deterministic. Where two histories lead to the same pair, the values have to be the same.
    """
    mdp, memory, found = problem.mdp, problem.memory, {}

    def values(history: tuple[int, ...]) -> list[float]:
        """What each action after a history is worth."""
        u = int(memory.start[history[0]])
        for s, action in zip(history[:-1:2], history[1::2], strict=True):
            u = int(memory.delta[u, memory.letter[s, action, 0]])
        worth = []
        for action in range(mdp.n_actions):
            monitor = TaskMonitor(problem.task)
            monitor.start(history[0])
            after = (*history, action, int(mdp.successor[history[-1], action, 0]))
            for s in after[2::2]:
                reward, over = monitor.advance(s)
            worth.append(reward if over else reward + gamma * max(values(after)))
        assert found.setdefault((u, history[-1]), worth) == worth
        return worth

    for s in np.flatnonzero(mdp.initial):
        values((int(s),))
    return found


def differences(q: NDArray[np.float32], exact: dict[tuple[int, int], list[float]]) -> int:
    return sum(q[u, s].tolist() != worth for (u, s), worth in exact.items())


def steady_problem(conjunction: SequentialConjunction, rng: np.random.Generator) -> Problem:
    """A random deterministic world of four cells, in which each region of a formula is moved to where two cells are."""
    mdp = replace(random_mdp(rng, 4, 2, 1), cell_coordinates=np.arange(4)[:, None] + np.array([0.5, 0.5]))
    regions = [Box.of(x=(start, start + 2)) for start in rng.integers(0, 3, size=len(conjunction.primitives))]
    primitives = (replace(one, predicate=box) for one, box in zip(conjunction.primitives, regions, strict=True))
    return formula_problem(mdp, SDNF((SequentialConjunction(tuple(primitives)),)))


def chance_world(actions: int = 1) -> TabularMDP:
    """Two cells at x = 0.5 and 1.5; whatever is done, the robot is in either at the next tick, evenly."""
    return TabularMDP(
        successor=np.tile([0, 1], (2, actions, 1)),
        probability=np.full((2, actions, 2), 0.5),
        initial=np.full(2, 0.5),
        cell=np.arange(2),
        cell_coordinates=np.array([[0.5], [1.5]]),
        variables=("x",),
        limits=((0.0, 2.0),),
    )


def slow_shaping(
    problem: Problem,
    q: NDArray[np.float32],
    potential: NDArray[np.float64],
    settings: QSettings,
    rng: np.random.Generator,
    episodes: int,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Q-learning with γΦ(u′) - Φ(u) added to each reward; changes ``q`` and returns what a learner does."""
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
            added = settings.gamma * (0.0 if over else potential[next_u]) - potential[u]
            future = 0.0 if over else settings.gamma * float(q[next_u, next_s].max())
            old = float(q[u, s, action])
            q[u, s, action] = old + settings.alpha * (reward + added + future - old)
            u, s = next_u, next_s
            paths[episode, monitor.tick] = s
            total += reward
        returns[episode] = total
    return returns, paths


def slow_actor_critic(
    problem: Problem,
    preferences: NDArray[np.float32],
    values: NDArray[np.float32],
    form: ActorCritic,
    rng: np.random.Generator,
    episodes: int,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Actor and critic; changes preferences and values, and returns what a learner does."""
    returns = np.zeros(episodes, dtype=np.float32)
    paths = np.full((episodes, problem.task.horizon + 1), -1, dtype=np.int32)
    for episode in range(episodes):
        monitor = TaskMonitor(problem.task)
        s = draw(cumulative(problem.mdp.initial), rng.random())
        u = int(problem.memory.start[s])
        monitor.start(s)
        paths[episode, 0] = s
        # memory state, state, what each action's preference has of a surprise, and the trace, of each step
        steps: list[tuple[int, int, list[float], float]] = []
        total, over = 0.0, False
        while not over:
            row = [float(preference) for preference in preferences[u, s]]
            weights = [math.exp((preference - max(row)) / form.temperature) for preference in row]
            whole = np.cumsum(weights)[-1]  # one by one; newer Pythons' sum is more exact
            chances = [weight / whole for weight in weights]
            action, left = 0, rng.random() * whole - weights[0]
            while left >= 0 and action < len(row) - 1:
                action += 1
                left -= weights[action]
            next_u, next_s = advance(problem, u, s, action, rng.random())
            reward, over = monitor.advance(next_s)
            surprise = reward - float(values[u, s]) + (0.0 if over else form.gamma * float(values[next_u, next_s]))
            shares = [(1.0 if a == action else 0.0) - chance for a, chance in enumerate(chances)]
            steps = [step for step in steps if step[:2] != (u, s)] + [(u, s, shares, 1.0)]
            for past_u, past_s, past_shares, trace in steps:
                values[past_u, past_s] = float(values[past_u, past_s]) + form.critic * (surprise * trace)
                for a, share in enumerate(past_shares):
                    old = float(preferences[past_u, past_s, a])
                    preferences[past_u, past_s, a] = old + form.actor * (surprise * trace) * share
            faded = [(*rest, trace * (form.gamma * form.trace)) for *rest, trace in steps]
            steps = [step for step in faded if step[3] >= FORGOTTEN]
            u, s = next_u, next_s
            paths[episode, monitor.tick] = s
            total += reward
        returns[episode] = total
    return returns, paths
