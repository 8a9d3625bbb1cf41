"""Plain-Python twins of exact planning, and small random worlds and tasks to run them on."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskMonitor, TaskTable


def history_value(mdp: TabularMDP, task: TaskTable, sign: float = 1.0) -> float:
    """The best (with sign -1, the worst) expected return of all policies that may use the whole history."""
    return _over_histories(mdp, task, max if sign > 0 else min, lambda gained, _: gained)


def history_success(mdp: TabularMDP, task: TaskTable, combine: Callable[[list[float]], float]) -> float:
    """The probability of success where `combine` makes one number of those of the actions, at every history."""
    return _over_histories(mdp, task, combine, lambda _, success: 0.0 if success is None else float(success))


def _over_histories(
    mdp: TabularMDP,
    task: TaskTable,
    combine: Callable[[list[float]], float],
    worth: Callable[[float, bool | None], float],
) -> float:
    """Expectation of the sum of what each tick is worth, given its reward and, at the end, the success."""

    def value(history: tuple[int, ...]) -> float:
        monitor = TaskMonitor(task)
        monitor.start(history[0])
        gained, over = 0.0, False
        for _, s in pairwise(history):
            gained, over = monitor.advance(s)
        if over:
            return worth(gained, monitor.success)
        s = history[-1]
        expected = [
            sum(
                float(mdp.probability[s, action, k]) * value((*history, int(mdp.successor[s, action, k])))
                for k in range(mdp.successor.shape[2])
                if mdp.probability[s, action, k] > 0
            )
            for action in range(mdp.n_actions)
        ]
        return worth(gained, None) + combine(expected)

    return sum(float(mdp.initial[s]) * value((s,)) for s in range(mdp.n_states) if mdp.initial[s] > 0)


def distributions(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Random distributions along the last axis, with outcomes of probability zero in any place."""
    weights = rng.random(shape) * (rng.random(shape) < 0.7)
    weights[..., rng.integers(shape[-1])] += 0.1
    return weights / weights.sum(axis=-1, keepdims=True)


def random_mdp(rng: np.random.Generator, states: int, actions: int, outcomes: int) -> TabularMDP:
    return TabularMDP(
        successor=rng.integers(states, size=(states, actions, outcomes)),
        probability=distributions(rng, (states, actions, outcomes)),
        initial=distributions(rng, (states,)),
        cell=np.arange(states),
        cell_coordinates=rng.integers(0, 4, size=(states, 2)) + 0.5,
        variables=("x", "y"),
        limits=((0.0, 4.0), (0.0, 4.0)),
    )


def random_task(rng: np.random.Generator, states: int, horizon: int) -> TaskTable:
    """A task with rewards at any tick and at the deadline, and with early termination."""
    task_states, letters = rng.integers(1, 5, size=2)
    return TaskTable(
        delta=rng.integers(task_states, size=(task_states, letters)),
        letter=rng.integers(letters, size=states),
        reward=rng.normal(size=(task_states, states)),
        final_reward=rng.choice([-10.0, 0.0, 33.3], size=task_states),
        terminated=rng.random(task_states) < 0.2,
        success=rng.random(task_states) < 0.5,
        horizon=horizon,
        stages=("",) * int(task_states),
    )
