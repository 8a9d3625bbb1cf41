"""Exact values and chances by dynamic programming on the product of a world and its hidden task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import read_only
from tickwise._jit import njit
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskTable

# Unsigned, so that the compiled indexing need not ask whether an index counts from the end.
_index = np.uint32


def optimal_value(mdp: TabularMDP, task: TaskTable) -> float:
    """The optimal value V*: the greatest expected undiscounted return, averaged over the initial states.

    It is exact: backward induction over (task state, MDP state, tick), with the hidden task in view.

    Args:
        mdp: The world.
        task: The hidden task over the world's states.

    Returns:
        V*, in units of reward.
    """
    return _value(mdp, task, task.reward, task.final_reward, 1.0)


def worst_value(mdp: TabularMDP, task: TaskTable) -> float:
    """The least expected undiscounted return, averaged over the initial states; see `optimal_value`."""
    return _value(mdp, task, task.reward, task.final_reward, -1.0)


def best_success_probability(mdp: TabularMDP, task: TaskTable) -> float:
    """The greatest probability that an episode ends in success, averaged over the initial states.

    It is exact, with the hidden task in view: the optimal value of a reward of 1 for success alone.

    Args:
        mdp: The world.
        task: The hidden task over the world's states.

    Returns:
        The probability.
    """
    ended = np.where(task.terminated & task.success, 1.0, 0.0).astype(np.float32)
    due = np.where(~task.terminated & task.success, 1.0, 0.0).astype(np.float32)
    reward = np.ascontiguousarray(np.broadcast_to(ended[:, None], task.reward.shape))
    return min(1.0, _value(mdp, task, reward, due, 1.0))


def success_probability(mdp: TabularMDP, task: TaskTable) -> float:
    """The exact probability that an episode ends in success when every action is drawn uniformly at random.

    Args:
        mdp: The world.
        task: The hidden task over the world's states.

    Returns:
        The probability, from the distribution of the initial states.
    """
    probability = random_success(
        mdp.initial, mdp.successor, mdp.probability, task.delta, task.letter, task.terminated, task.success,
        task.horizon,
    )  # fmt: skip
    return min(1.0, float(probability))


def _value(
    mdp: TabularMDP, task: TaskTable, reward: NDArray[np.float32], final_reward: NDArray[np.float32], sign: float
) -> float:
    values = backward_induction(
        mdp.successor, mdp.probability, task.delta, task.letter, read_only(reward), read_only(final_reward),
        task.terminated, task.horizon, sign,
    )  # fmt: skip
    first = task.delta[0, task.letter]
    return float(mdp.initial @ values[first, range(mdp.n_states)])


@njit
def reachable(task_delta: NDArray[np.int32], task_letter: NDArray[np.int32], horizon: int) -> NDArray[np.bool_]:
    """Which task states some sequence of the world's letters reaches at which tick.

    A task that counts ticks reaches few of its states at any one tick, so skipping the others saves most work.

    Returns:
        Shape ``(horizon + 1, task states)``.
    """
    occurring = np.unique(task_letter)
    reached = np.zeros((horizon + 1, len(task_delta)), dtype=np.bool_)
    for letter in occurring:
        reached[0, task_delta[0, letter]] = True
    for t in range(horizon):
        for w in range(len(task_delta)):
            if reached[t, w]:
                for letter in occurring:
                    reached[t + 1, task_delta[w, letter]] = True
    return reached


@njit
def backward_induction(
    successor: NDArray[np.int32],
    probability: NDArray[np.float64],
    task_delta: NDArray[np.int32],
    task_letter: NDArray[np.int32],
    reward: NDArray[np.float32],
    final_reward: NDArray[np.float32],
    terminated: NDArray[np.bool_],
    horizon: int,
    sign: float,
) -> NDArray[np.float64]:
    """Optimal undiscounted values at tick 0 over (task state, state), by backward induction.

    ``sign`` is 1.0 for the greatest value and -1.0 for the least; the rest is arrays of the world and the
    task, see `tickwise.envs.tabulate.TabularMDP` and `tickwise.envs.tasks.TaskTable`.

    Returns:
        Values with ``horizon`` ticks to go, shape ``(task states, states)``; only those of task states that can
        be reached at tick 0 mean something.
    """
    states, actions, outcomes = successor.shape
    reached = reachable(task_delta, task_letter, horizon)
    values = np.zeros((len(task_delta), states))
    arriving = np.zeros_like(values)
    for t in range(horizon, 0, -1):
        # the value of arriving at tick t in state s with the task in w: the reward there and what follows
        for w in range(len(task_delta)):
            if not reached[t, w]:
                continue
            for s in range(states):
                value = np.float64(reward[w, s])
                if t == horizon:
                    value += final_reward[w]
                elif not terminated[w]:
                    value += values[w, s]
                arriving[w, s] = value
        for w in range(len(task_delta)):
            if not reached[t - 1, w]:
                continue
            for s in range(states):
                best = -np.inf
                for a in range(actions):
                    expected = 0.0
                    for k in range(outcomes):
                        after = _index(successor[s, a, k])
                        then = _index(task_delta[w, _index(task_letter[after])])
                        expected += probability[s, a, k] * arriving[then, after]
                    best = max(best, sign * expected)
                values[w, s] = sign * best
    return values


@njit
def random_success(
    initial: NDArray[np.float64],
    successor: NDArray[np.int32],
    probability: NDArray[np.float64],
    task_delta: NDArray[np.int32],
    task_letter: NDArray[np.int32],
    terminated: NDArray[np.bool_],
    success: NDArray[np.bool_],
    horizon: int,
) -> float:
    """The probability of ending in success under uniformly random actions, carried forward tick by tick.

    The arguments are arrays of the world and the task, see `backward_induction`.

    Returns:
        The probability, from the distribution of the initial states.
    """
    states, actions, outcomes = successor.shape
    reached = reachable(task_delta, task_letter, horizon)
    mass = np.zeros((len(task_delta), states))
    arriving = np.zeros_like(mass)
    for s in range(states):
        mass[task_delta[0, task_letter[s]], s] += initial[s]
    total = 0.0
    for t in range(1, horizon + 1):
        for w in range(len(task_delta)):
            if reached[t, w]:
                arriving[w] = 0.0
        for w in range(len(task_delta)):
            if not reached[t - 1, w]:
                continue
            for s in range(states):
                share = mass[w, s] / actions
                if share == 0.0:
                    continue
                for a in range(actions):
                    for k in range(outcomes):
                        after = successor[s, a, k]
                        arriving[task_delta[w, task_letter[after]], after] += share * probability[s, a, k]
        for w in range(len(task_delta)):
            if not (reached[t, w] and (terminated[w] or t == horizon)):
                continue
            for s in range(states):
                total += arriving[w, s] if success[w] else 0.0
                arriving[w, s] = 0.0  # the episode is over
        mass, arriving = arriving, mass
    return total
