"""What a Q-function promises before any episode is learned: the exact chance that its greedy policy succeeds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.temporal import sdnf_table
from tickwise.logic.sdnf import SDNF
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import Memory


def promise(formula: SDNF, deadline: int, mdp: TabularMDP, memory: Memory, q: NDArray[np.float32]) -> float:
    """The probability that the greedy policy of a Q-function satisfies a formula by a deadline, exactly.

    With transferred values it says how good a start they are, without an episode in the target: a model of its world
    and its formula suffice. The model may be an estimate.

    Args:
        formula: The target's formula; it has no effect past the deadline.
        deadline: The deadline L in ticks.
        mdp: The target's world, or a model of it.
        memory: What the agent remembers in it.
        q: The Q-function, shape ``(memory states, states, actions)``; ties go to the lower action.

    Returns:
        The probability, from the distribution of the initial states.

    Raises:
        ConfigurationError: If a region contains no cell of the world, or the formula's table would be too large.
    """
    return greedy_success(Problem(mdp, sdnf_table(formula, mdp, deadline, ends="decided"), memory), q)


def greedy_success(problem: Problem, q: NDArray[np.float32]) -> float:
    """The exact probability that an episode of the greedy policy ends in success; `evaluate` estimates what it earns.

    The distribution over (task state, memory state, state) is carried forward tick by tick, reachable part only.

    Args:
        problem: The world, the task and the memory.
        q: The Q-function, shape ``(memory states, states, actions)``; ties go to the lower action.

    Returns:
        The probability, from the distribution of the initial states.
    """
    mdp, task, memory = problem.mdp, problem.task, problem.memory
    shape = (task.n_states, memory.n_states, mdp.n_states)
    starts = np.flatnonzero(mdp.initial)
    w, u, s = task.delta[0, task.letter[starts]].astype(np.int64), memory.start[starts].astype(np.int64), starts
    mass, total = mdp.initial[starts], 0.0
    for tick in range(1, task.horizon + 1):
        action = q[u, s].argmax(axis=1)
        after = mdp.successor[s, action]
        following = (
            task.delta[w[:, None], task.letter[after]],
            memory.delta[u[:, None], memory.letter[s, action]],
            after,
        )
        moved = (mass[:, None] * mdp.probability[s, action]).reshape(-1)
        reached, place = np.unique(np.ravel_multi_index(following, shape).reshape(-1), return_inverse=True)
        mass = np.bincount(place, weights=moved).astype(np.float64)
        w, u, s = np.unravel_index(reached, shape)
        over = task.terminated[w] | (tick == task.horizon)
        total += float(mass[over & task.success[w]].sum())
        kept = ~over & (mass > 0)
        w, u, s, mass = w[kept], u[kept], s[kept], mass[kept]
    return min(1.0, total)
