"""The optimal value of the hidden task by backward induction on the product of world and task, as the world grows.

The task is that of Case Study 1's target. `planning.c` is the same induction, and its values are the same to the bit;
pymdptoolbox is given the product as sparse matrices, and agrees to nine digits.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib
import io
import warnings

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from benchmarks.contest import Contender, Turn, contest
from benchmarks.learning import world_spec
from benchmarks.native import Record, library, pointer
from benchmarks.result import OURS, Result
from tickwise.envs.planning import backward_induction, reachable
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskTable

WORLDS = (9, 15, 25, 50, 100)
LARGEST_FOR_MATRICES = 15


class CWorld(Record):
    """The struct ``world`` of `planning.c`."""

    _fields_ = (
        *(
            (name, ctypes.c_long)
            for name in ("states", "actions", "outcomes", "task_states", "letters", "horizon")
        ),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "successor", "probability", "task_delta", "task_letter", "reward", "final_reward", "terminated",
                "reached",
            )
        ),
    )  # fmt: skip


def ours(mdp: TabularMDP, task: TaskTable) -> Turn:
    arguments = (
        mdp.successor, mdp.probability, task.delta, task.letter, task.reward, task.final_reward, task.terminated,
        task.horizon, 1.0,
    )  # fmt: skip
    return lambda: at_the_start(backward_induction(*arguments), task)


def in_c(mdp: TabularMDP, task: TaskTable) -> Turn:
    function = library("planning").backward_induction
    states, actions, outcomes = mdp.successor.shape
    sizes = {
        "states": states, "actions": actions, "outcomes": outcomes, "task_states": len(task.delta),
        "letters": task.delta.shape[1], "horizon": task.horizon,
    }  # fmt: skip
    tables = {
        "successor": mdp.successor, "probability": mdp.probability, "task_delta": task.delta,
        "task_letter": task.letter, "reward": task.reward, "final_reward": task.final_reward,
        "terminated": task.terminated, "reached": reachable(task.delta, task.letter, task.horizon),
    }  # fmt: skip
    record = CWorld(**sizes, **tables)

    def turn() -> NDArray[np.float64]:
        values, arriving = (np.zeros((len(task.delta), states)) for _ in range(2))
        function(ctypes.byref(record), pointer(values), pointer(arriving))
        return at_the_start(values, task)

    return turn


def with_matrices(mdp: TabularMDP, task: TaskTable) -> Turn:
    """The product as one transition matrix an action, and the reward of leaving a pair by an action."""
    solver = importlib.import_module("mdptoolbox.mdp").FiniteHorizon
    task_states, states, actions = len(task.delta), mdp.n_states, mdp.n_actions
    w, s = np.divmod(np.arange(task_states * states), states)
    final = np.where(task.terminated, 0.0, task.final_reward)[w]
    transitions, rewards = [], np.empty((len(w), actions))
    for action in range(actions):
        after = mdp.successor[s, action]
        next_w = task.delta[w[:, None], task.letter[after]]
        chance = np.where(task.terminated[w][:, None], 0.0, mdp.probability[s, action])
        rewards[:, action] = (chance * task.reward[next_w, after]).sum(axis=1)
        rows = np.repeat(np.arange(len(w)), after.shape[1])
        stays = task.terminated[w].astype(float)  # once it is over nothing more is gained
        matrix = sparse.coo_matrix((chance.ravel(), (rows, (next_w * states + after).ravel())), shape=(len(w),) * 2)
        transitions.append((matrix + sparse.diags(stays)).tocsr())

    # it warns that a sum without discount need not converge, and of how it checks the matrices
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings(action="ignore"):
        solved = solver(transitions, rewards, 1.0, task.horizon, h=final)

    def turn() -> NDArray[np.float64]:
        solved.run()
        return at_the_start(solved.V[:, 0].reshape(task_states, states), task)

    return turn


def at_the_start(values: NDArray[np.float64], task: TaskTable) -> NDArray[np.float64]:
    """The values of the pairs that an episode can start in."""
    return values[task.delta[0, task.letter], np.arange(values.shape[1])]


def measure(quick: bool) -> list[Result]:
    results, repetitions = [], 3 if quick else 7
    for size in WORLDS[:2] if quick else WORLDS:
        mdp, task = world_spec(size).mdp(), world_spec(size).task_table()
        contenders = [
            Contender(OURS, functools.partial(ours, mdp, task), 1, repetitions),
            Contender("C", functools.partial(in_c, mdp, task), 1, repetitions),
        ]
        if size <= LARGEST_FOR_MATRICES:
            contenders.append(Contender("pymdptoolbox", functools.partial(with_matrices, mdp, task), 1, repetitions))
        results += contest("planning", "optimum", contenders, axis="world", size=size, agree=agree)
    return results


def agree(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """To the last digits: the order of sums differs between contenders."""
    return np.allclose(one, other, rtol=1e-9, atol=1e-9)
