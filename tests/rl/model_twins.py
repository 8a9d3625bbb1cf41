"""Plain-Python twins of model-based learning: by the definitions, over ticks and memory states as they come.

Nothing is numbered by tick here, so that a comparison is one with `tickwise.rl.unrolled` too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tests.envs.twins import random_mdp
from tests.rl.form_twins import disjunct_of
from tests.rl.twins import choose
from tickwise.automata.build import timed_automata
from tickwise.envs.tabulate import cumulative, draw
from tickwise.envs.tasks import TaskMonitor
from tickwise.envs.temporal import ENDINGS, Ending, sdnf_table
from tickwise.logic.sdnf import SDNF, SequentialConjunction
from tickwise.logic.syntax import Box, Not
from tickwise.rl.model import ModelBased, no_counts
from tickwise.rl.planning import CLASSES, Counts
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import Memory, automaton_memory

Row: TypeAlias = Callable[[int, int, int], NDArray[np.float32]]
"""The values of the actions at a tick, in a memory state and in a state."""


def verdict_of(memory: Memory, u: int) -> int:
    """What the automaton says in a memory state; 0 where there is none."""
    if not memory.tables:
        return 0
    i = disjunct_of(memory, u)
    return int(memory.tables[i].verdict[u - memory.offsets[i]])


def kind_of(problem: Problem, t: int, u: int) -> int:
    """The class of what is met at a tick in a memory state."""
    return 2 * (verdict_of(problem.memory, u) + 1) + (t == problem.task.horizon)


def slow_pairs(problem: Problem) -> set[tuple[int, int]]:
    """The ticks and memory states that words of the world's letters lead to."""
    memory, letters = problem.memory, set(problem.memory.letter.ravel().tolist())
    present = set(memory.start.tolist())
    found = {(0, u) for u in present}
    for t in range(1, problem.task.horizon + 1):
        present = {int(memory.delta[u, letter]) for u in present for letter in letters}
        found |= {(t, u) for u in present}
    return found


def slow_play(
    problem: Problem, row: Row, counts: Counts, rng: np.random.Generator
) -> tuple[np.float32, NDArray[np.int32]]:
    """One greedy episode, and what is counted in it."""
    mdp, memory, monitor = problem.mdp, problem.memory, TaskMonitor(problem.task)
    path = np.full(problem.task.horizon + 1, -1, dtype=np.int32)
    s = draw(cumulative(mdp.initial), rng.random())
    u = int(memory.start[s])
    monitor.start(s)
    path[0] = s
    total, over = 0.0, False
    while not over:
        action = choose(row(monitor.tick, u, s), 0.0, rng.random())
        outcome = draw(cumulative(mdp.probability)[s, action], rng.random())
        counts.outcomes[s, action, outcome] += 1
        u, s = int(memory.delta[u, memory.letter[s, action, outcome]]), int(mdp.successor[s, action, outcome])
        reward, over = monitor.advance(s)
        kind = kind_of(problem, monitor.tick, u)
        counts.rewards[kind, s] += reward
        counts.arrivals[kind, s] += 1
        counts.ends[kind, s] += over
        path[monitor.tick] = s
        total += reward
    return np.float32(total), path


@dataclass(frozen=True)
class SlowPlan:
    """The values of what was counted, by recursion over what can follow.

    Attributes:
        problem: The problem, whose memory does not tell the tick.
        outcomes: How often each outcome came.
        known: How often a state and an action have to be met to be known.
        reward: The expected reward on arriving, by class and state.
        ends: The probability that the episode ends there.
        unknown: What is not known is worth, by tick, memory state, state and action.
    """

    problem: Problem
    outcomes: NDArray[np.int32]
    known: int
    reward: NDArray[np.float64]
    ends: NDArray[np.float64]
    unknown: Callable[[int, int, int, int], float]

    @cached_property
    def _found(self) -> dict[tuple[int, int, int], list[float]]:
        return {}

    def row(self, t: int, u: int, s: int) -> NDArray[np.float32]:
        """What each action is worth."""
        return np.array(self.values(t, u, s), dtype=np.float32)

    def values(self, t: int, u: int, s: int) -> list[float]:
        """The same, before it is rounded."""
        if (t, u, s) not in self._found:
            actions = range(self.problem.mdp.n_actions)
            over = t == self.problem.task.horizon
            self._found[t, u, s] = [0.0 if over else self._value(t, u, s, a) for a in actions]
        return self._found[t, u, s]

    def _value(self, t: int, u: int, s: int, a: int) -> float:
        met = int(self.outcomes[s, a].sum())
        if met < self.known:
            return float(self.unknown(t, u, s, a))
        memory, total = self.problem.memory, 0.0
        for k in np.flatnonzero(self.outcomes[s, a]):  # one by one; newer Pythons' sum is more exact
            after, then = int(self.problem.mdp.successor[s, a, k]), int(memory.delta[u, memory.letter[s, a, k]])
            total += int(self.outcomes[s, a, k]) * self._arriving(t + 1, then, after)
        return total / met

    def _arriving(self, t: int, u: int, s: int) -> float:
        kind = kind_of(self.problem, t, u)
        return float(self.reward[kind, s]) + (1.0 - float(self.ends[kind, s])) * max(self.values(t, u, s))


def slow_imagine(
    problem: Problem,
    row: Row,
    outcomes: NDArray[np.int32],
    starts: NDArray[np.int32],
    episodes: int,
    rng: np.random.Generator,
) -> NDArray[np.int32]:
    """Greedy episodes among the outcomes that came, each as often as it came; they stay where nothing did."""
    mdp, memory, horizon = problem.mdp, problem.memory, problem.task.horizon
    paths = []
    for _ in range(episodes):
        s = int(starts[int(rng.random() * len(starts))])
        u = int(memory.start[s])
        path = [s]
        for t in range(horizon):
            action = choose(row(t, u, s), 0.0, rng.random())
            urn = np.repeat(np.arange(mdp.successor.shape[2]), outcomes[s, action])
            if len(urn) == 0:
                path += [s] * (horizon - t)
                break
            outcome = urn[int(rng.random() * len(urn))]
            u, s = int(memory.delta[u, memory.letter[s, action, outcome]]), int(mdp.successor[s, action, outcome])
            path.append(s)
        paths.append(path)
    return np.array(paths, dtype=np.int32)


def slow_expectations(counts: Counts, form: ModelBased) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The expected reward and the probability of an end, by class and state."""
    reward, ends = np.zeros(counts.rewards.shape), np.zeros(counts.rewards.shape)
    for kind in range(CLASSES):
        met = int(counts.arrivals[kind].sum())
        if met > 0:
            mean, ending = float(counts.rewards[kind].sum()) / met, int(counts.ends[kind].sum()) / met
        else:
            mean, ending = form.hope if kind in (3, 5) else 0.0, 0.0
        for s in range(counts.rewards.shape[1]):
            weight = int(counts.arrivals[kind, s]) + form.pooling
            reward[kind, s] = (float(counts.rewards[kind, s]) + form.pooling * mean) / weight
            ends[kind, s] = (int(counts.ends[kind, s]) + form.pooling * ending) / weight
    return reward, ends


def slow_replan(problem: Problem, form: ModelBased, counts: Counts, given: NDArray[np.float32] | None) -> SlowPlan:
    """The plan for the rewards, as a learner makes it after each episode."""
    reward, ends = slow_expectations(counts, form)
    kinds = {kind_of(problem, t, u) for t, u in slow_pairs(problem)}
    best = [max(0.0, *reward[kind]) if kind in kinds else 0.0 for kind in range(CLASSES)]

    def unknown(t: int, u: int, s: int, a: int) -> float:
        if given is not None:
            return float(given[u, s, a])
        left = problem.task.horizon - t
        return max(left - 1, 0) * max(best[0], best[2], best[4]) + max(best[1], best[3], best[5])

    return SlowPlan(problem, counts.outcomes.copy(), form.known, reward, ends, unknown)


def slow_model_learning(
    problem: Problem,
    form: ModelBased,
    given: NDArray[np.float32] | None,
    counts: Counts,
    rng: np.random.Generator,
    episodes: int,
) -> tuple[NDArray[np.float32], NDArray[np.int32], SlowPlan]:
    """Plan, play and count in turn; changes the counts."""
    returns = np.empty(episodes, dtype=np.float32)
    paths = np.empty((episodes, problem.task.horizon + 1), dtype=np.int32)
    for episode in range(episodes):
        returns[episode], paths[episode] = slow_play(
            problem, slow_replan(problem, form, counts, given).row, counts, rng
        )
    return returns, paths, slow_replan(problem, form, counts, given)


def random_counts(problem: Problem, rng: np.random.Generator) -> Counts:
    """Numbers that need not come from any episode; a third of the outcomes never came."""
    counts = no_counts(problem.mdp)
    shape = counts.rewards.shape
    counts.outcomes[:] = rng.integers(0, 3, counts.outcomes.shape) * rng.integers(1, 3, counts.outcomes.shape)
    counts.arrivals[:] = rng.integers(0, 3, shape)
    counts.rewards[:] = rng.normal(size=shape) * counts.arrivals
    counts.ends[:] = rng.integers(0, counts.arrivals + 1)
    return counts


def counted_problem(sdnf: SDNF, ends: Ending, rng: np.random.Generator) -> tuple[Problem, SDNF, Counts]:
    """A random world of four cells whose outcomes are as probable as they were frequent, and all that there is to see.

    The task is the formula with its regions moved to where two cells are, which comes back too.
    """
    outcomes = rng.integers(0, 5, size=(4, 2, 3))
    outcomes[:, :, rng.integers(3)] += 1
    mdp = replace(
        random_mdp(rng, 4, 2, 3),
        probability=outcomes / outcomes.sum(axis=2, keepdims=True),
        cell_coordinates=np.arange(4)[:, None] + np.array([0.5, 0.5]),
    )
    moved = SDNF(tuple(_moved(disjunct, rng) for disjunct in sdnf.disjuncts))
    deadline = max(1, *(disjunct.primitives[-1].end for disjunct in moved.disjuncts)) + int(rng.integers(3))
    tables = tuple(automaton.compile() for automaton in timed_automata(moved))
    counts = no_counts(mdp)
    counts.outcomes[:] = outcomes
    counts.arrivals[:] = 1
    for kind in range(CLASSES):
        verdict, last = kind // 2 - 1, kind % 2 == 1
        counts.ends[kind] = last or verdict in ENDINGS[ends]
        counts.rewards[kind] = counts.ends[kind] * (100.0 if verdict > 0 else -10.0)
    return Problem(mdp, sdnf_table(moved, mdp, deadline, ends=ends), automaton_memory(mdp, tables)), moved, counts


def _moved(conjunction: SequentialConjunction, rng: np.random.Generator) -> SequentialConjunction:
    boxes = [Box.of(x=(start, start + 2)) for start in rng.integers(0, 3, size=len(conjunction.primitives))]
    return SequentialConjunction(
        tuple(
            replace(primitive, predicate=Not(box) if primitive.complemented else box)
            for primitive, box in zip(conjunction.primitives, boxes, strict=True)
        )
    )
