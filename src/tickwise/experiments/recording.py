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
        points: The numbers of learned episodes at which it records; it passes over all others.
        formulas: The formula whose automata the memory followed at each of them, as text; None for τ-states.
    """

    seed: np.random.SeedSequence
    points: Sequence[int]
    formulas: list[str | None] = field(default_factory=list)
    _parts: list[Mapping[str, NDArray[Any]]] = field(default_factory=list)

    def look(self, learned: int, problem: Problem, q: NDArray[np.float32]) -> None:
        """Record here if this is one of the points.

        Args:
            learned: How many episodes were learned.
            problem: What is learned; from one point to the next its memory may change.
            q: The Q-table, shape ``(memory states, states, actions)``.
        """
        if learned in self.points:
            conjunctions = tuple(table.automaton.conjunction for table in problem.memory.tables)
            self.formulas.append(str(SDNF(conjunctions)) if conjunctions else None)
            self._parts.append({"at": np.array(learned), **greedy_episodes(problem, q, self.seed, EPISODES)})

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What was recorded: the arrays of `greedy_episodes` with a first axis for the points, and `at`."""
        names = self._parts[0] if self._parts else ()
        return {PREFIX + name: np.stack([part[name] for part in self._parts]) for name in names}


def greedy_episodes(
    problem: Problem, q: NDArray[np.float32], seed: np.random.SeedSequence, episodes: int
) -> dict[str, NDArray[Any]]:
    """The first episodes that `tickwise.rl.qlearning.evaluate` plays, tick by tick.

    It is the plain twin of `tickwise.rl.kernels.greedy_returns`: the few episodes of a recording take
    milliseconds, and the compiled loop need not know of them.

    Args:
        problem: What was learned.
        q: The Q-table, shape ``(memory states, states, actions)``.
        seed: The seed of the evaluation.
        episodes: How many episodes E.

    Returns:
        ``states`` and ``memory`` (the memory's states), int32, shape ``(E, horizon + 1)``, -1 after an episode's end;
        ``actions``, int8, shape ``(E, horizon)``, likewise; ``disjunct``, int16, shape ``(E,)``: the disjunct
        whose automaton the memory follows, -1 for a memory without automata; ``returns``, float32, shape ``(E,)``.
    """
    task, memory, horizon = problem.task, problem.memory, problem.task.horizon
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
        w, u = int(task_start[s]), int(memory.start[s])
        total = 0.0
        found["states"][episode, 0], found["memory"][episode, 0] = s, u
        if memory.offsets:
            found["disjunct"][episode] = np.searchsorted(memory.offsets, u, side="right") - 1
        for t in range(1, horizon + 1):
            chance = rng.random()
            action = int(q[u, s].argmax())  # the first of equal ones, as the kernel has it
            outcome = draw(thresholds[s, action], chance)
            u = int(memory.delta[u, memory.letter[s, action, outcome]])
            s = int(successor[s, action, outcome])
            w = int(task.delta[w, task.letter[s]])
            total += float(task.reward[w, s]) + (float(task.final_reward[w]) if t == horizon else 0.0)
            found["states"][episode, t], found["memory"][episode, t] = s, u
            found["actions"][episode, t - 1] = action
            if task.terminated[w]:
                break
        found["returns"][episode] = total
    return found
