"""The dynamics of a world, estimated from where trajectories went and which actions they took."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import DataError


def estimated(mdp: TabularMDP, states: ArrayLike, actions: ArrayLike) -> TabularMDP:
    """A world with the shares of successors that were seen, in the place of its own probabilities.

    It is the maximum-likelihood model of the transitions and of the initial states; an action that was never taken in a
    state is thought to change nothing there. Of the given world only places, cells and the number of actions are used.

    Args:
        mdp: What is known of the world; its probabilities are not looked at.
        states: The state at each tick, whole numbers, shape ``(n, ticks)``; -1 after a trajectory's end.
        actions: The action after each tick but the last, shape ``(n, ticks - 1)``; any after an end.

    Returns:
        The world.

    Raises:
        DataError: If the shapes do not fit, or a number is no state or no action.
    """
    paths, chosen = np.asarray(states), np.asarray(actions)
    if paths.ndim != 2 or not paths.size or chosen.shape != (len(paths), paths.shape[1] - 1):
        raise DataError(
            f"states have shape {paths.shape} and actions {chosen.shape}; use (trajectories, ticks), and one tick less"
        )
    if paths.dtype.kind not in "iu" or chosen.dtype.kind not in "iu":
        raise DataError(f"states are of type {paths.dtype} and actions of {chosen.dtype}; use whole numbers")
    before, after = paths[:, :-1], paths[:, 1:]
    there = (before >= 0) & (after >= 0)
    for name, numbers, count in (
        ("state", paths[paths >= 0], mdp.n_states),
        ("action", chosen[there], mdp.n_actions),
    ):
        if numbers.size and not 0 <= numbers.min() <= numbers.max() < count:
            raise DataError(
                f"{name} {numbers.max() if numbers.min() >= 0 else numbers.min()} is outside 0..{count - 1}"
            )
    if (paths[:, 0] < 0).any() or ((after >= 0) & (before < 0)).any():
        raise DataError("a trajectory has no state at tick 0, or goes on after its end; use -1 after an end only")
    rows = before[there].astype(np.int64) * mdp.n_actions + chosen[there]
    pairs, counts = np.unique(rows * mdp.n_states + after[there], return_counts=True)
    row, following = np.divmod(pairs, mdp.n_states)
    rank = np.arange(len(row)) - np.searchsorted(row, row)  # the first, second, … successor of its row
    shape = (mdp.n_states * mdp.n_actions, int(rank.max(initial=0)) + 1)
    successor = np.repeat(np.repeat(np.arange(mdp.n_states, dtype=np.int32), mdp.n_actions)[:, None], shape[1], axis=1)
    probability = np.zeros(shape)
    probability[:, 0] = 1.0
    successor[row, rank] = following
    probability[row, rank] = counts / np.bincount(row, counts, minlength=shape[0])[row]
    full = (mdp.n_states, mdp.n_actions, shape[1])
    first = np.bincount(paths[:, 0], minlength=mdp.n_states) / len(paths)
    return replace(mdp, successor=successor.reshape(full), probability=probability.reshape(full), initial=first)
