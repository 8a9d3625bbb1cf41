"""Episodes of the greedy policy, recorded at some points of learning, so that a report can show what was learned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import draw
from tickwise.logic.sdnf import SDNF
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import Memory

SHARES = (0.0, 0.02, 0.1, 1.0)
"""The shares of learning after which episodes are recorded: before it, early, later, and at its end."""

EPISODES = 4
"""Episodes recorded at each of these points: the first of those that the evaluation plays."""

PREFIX = "recorded_"
"""What the names of a recording's arrays begin with in the artefact of the job that learned."""


def recording_points(points: Sequence[int]) -> list[int]:
    """The evaluations at which episodes are recorded.

    Args:
        points: The numbers of episodes after which the greedy policy is evaluated, ascending.

    Returns:
        Those of them that come first at or after each of `SHARES`, each once.
    """
    wanted = np.searchsorted(points, [share * points[-1] for share in SHARES])
    return [points[index] for index in dict.fromkeys(int(index) for index in wanted)]


@dataclass(slots=True)
class Recorder:
    """Gathers episodes of the greedy policy while a method learns.

    It draws from the evaluation's seeds only and leaves the Q-table as it is, so that learning does not depend on it.

    Attributes:
        seed: The seed of the evaluations.
        formulas: The formula that was followed at each recording, as text; None for τ-states.
    """

    seed: np.random.SeedSequence
    formulas: list[str | None] = field(default_factory=list)
    _parts: list[Mapping[str, NDArray[Any]]] = field(default_factory=list)

    def record(self, learned: int, problem: Problem, q: NDArray[np.float32], memory: Memory) -> None:
        """Record some episodes.

        Args:
            learned: How many episodes were learned.
            problem: What is learned; its memory may be another at the next recording.
            q: The Q-table, shape ``(memory states, states, actions)``.
            memory: The memory whose states are recorded; see `greedy_episodes`.
        """
        conjunctions = tuple(table.automaton.conjunction for table in memory.tables)
        self.formulas.append(str(SDNF(conjunctions)) if conjunctions else None)
        self._parts.append({"at": np.array(learned), **greedy_episodes(problem, q, self.seed, EPISODES, memory)})

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What was recorded: the arrays of `greedy_episodes` with a first axis for the points, and `at`."""
        names = self._parts[0] if self._parts else ()
        return {PREFIX + name: np.stack([part[name] for part in self._parts]) for name in names}


def greedy_episodes(
    problem: Problem, q: NDArray[np.float32], seed: np.random.SeedSequence, episodes: int, memory: Memory
) -> dict[str, NDArray[Any]]:
    """The first episodes that `tickwise.rl.qlearning.evaluate` plays, tick by tick.

    It is the plain twin of `tickwise.rl.kernels.greedy_returns`: the few episodes of a recording take
    milliseconds, and the compiled loop need not know of them.

    Args:
        problem: What was learned.
        q: The Q-table, shape ``(memory states, states, actions)``.
        seed: The seed of the evaluation.
        episodes: How many episodes E.
        memory: The memory whose states are given, beside that of the problem: a form of learning may put the tick into
            the states that it learns on, and what is to be seen are the extended states that they stand for.

    Returns:
        ``states`` and ``memory`` (the memory's states), int32, shape ``(E, horizon + 1)``, -1 after an episode's end;
        ``actions``, int8, shape ``(E, horizon)``, likewise; ``disjunct``, int16, shape ``(E,)``: the disjunct
        whose automaton the memory follows, -1 for a memory without automata; ``returns``, float32, shape ``(E,)``.
    """
    task, own, horizon = problem.task, problem.memory, problem.task.horizon
    starts, successor, thresholds, task_start = problem.arrays[:4]
    rng = np.random.default_rng(seed)
    found: dict[str, NDArray[Any]] = {
        "states": np.full((episodes, horizon + 1), -1, dtype=np.int32),
        "memory": np.full((episodes, horizon + 1), -1, dtype=np.int32),
        "actions": np.full((episodes, horizon), -1, dtype=np.int8),
        "disjunct": np.full(episodes, -1, dtype=np.int16),
        "returns": np.zeros(episodes, dtype=np.float32),
    }
    for episode in range(episodes):
        s = draw(starts, rng.random())
        w, u, v = int(task_start[s]), int(own.start[s]), int(memory.start[s])
        total = 0.0
        found["states"][episode, 0], found["memory"][episode, 0] = s, v
        if memory.offsets:
            found["disjunct"][episode] = np.searchsorted(memory.offsets, v, side="right") - 1
        for t in range(1, horizon + 1):
            chance = rng.random()
            action = int(q[u, s].argmax())  # the first of equal ones, as the kernel has it
            outcome = draw(thresholds[s, action], chance)
            u = int(own.delta[u, own.letter[s, action, outcome]])
            v = int(memory.delta[v, memory.letter[s, action, outcome]])
            s = int(successor[s, action, outcome])
            w = int(task.delta[w, task.letter[s]])
            total += float(task.reward[w, s]) + (float(task.final_reward[w]) if t == horizon else 0.0)
            found["states"][episode, t], found["memory"][episode, t] = s, v
            found["actions"][episode, t - 1] = action
            if task.terminated[w]:
                break
        found["returns"][episode] = total
    return found
