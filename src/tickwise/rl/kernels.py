"""The compiled loops of learning and evaluation: every formula, task and table environment runs through them.

All arrays are those of `tickwise.rl.qlearning.Problem`. Learning draws a uniform number for the initial
state, then two at each step, the first for the action and the second for the outcome; greedy play draws the
same but for the action. The order is part of the contract, so that a plain-Python twin with the same generator
gives the same numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.rl.stream import uniform

# Unsigned, so that the compiled indexing need not ask whether an index counts from the end.
_index = np.uint32


@njit
def draw_state(thresholds: NDArray[np.float64], number: float) -> int:
    """The initial state that a uniform number selects: the first whose threshold exceeds it."""
    low, high = 0, len(thresholds) - 1
    while low < high:
        middle = (low + high) // 2
        if thresholds[middle] > number:
            high = middle
        else:
            low = middle + 1
    return low


@njit
def q_learning(
    start_thresholds: NDArray[np.float64],
    successor: NDArray[np.int32],
    thresholds: NDArray[np.float64],
    task_start: NDArray[np.int32],
    task_delta: NDArray[np.int32],
    task_letter: NDArray[np.int32],
    reward: NDArray[np.float32],
    final_reward: NDArray[np.float32],
    terminated: NDArray[np.bool_],
    horizon: int,
    memory_start: NDArray[np.int32],
    memory_delta: NDArray[np.int32],
    memory_letter: NDArray[np.int32],
    alpha: float,
    gamma: float,
    epsilon: float,
    stream: NDArray[np.uint64],
    q: NDArray[np.float32],
    returns: NDArray[np.float32],
    paths: NDArray[np.int32],
    updates: NDArray[np.uint32] | None = None,
    confidence: NDArray[np.float32] | None = None,
    patience: float = 0.0,
) -> None:
    """Q-learning (Section IV-B, Step 3) with ε-greedy actions and random ties; changes ``q`` in place.

    ``q`` has shape ``(memory states, states, actions)``. ``returns``, shape ``(episodes,)``, is filled with
    the undiscounted return of each episode. ``paths``, shape ``(episodes, horizon + 1)``, is filled with the
    MDP states of each episode and -1 after its end; shape ``(0, 0)`` records nothing. ``updates``, of the
    shape of ``q``, counts how often each entry was updated, and ``confidence``, likewise, slows an entry's
    first updates down; see `tickwise.rl.trusting`. Without them the compiled loop has no trace of them. The
    rest is the problem's arrays, the settings and the generator's stream; see `tickwise.rl.qlearning` and
    `tickwise.rl.stream`.
    """
    actions = successor.shape[1]
    outcomes = successor.shape[2]
    record = len(paths) > 0
    for episode in range(len(returns)):
        s = _index(draw_state(start_thresholds, uniform(stream)))
        w = _index(task_start[s])
        u = _index(memory_start[s])
        total = 0.0
        if record:
            paths[episode, :] = -1
            paths[episode, 0] = s
        best = q[u, s, 0]
        for a in range(1, actions):
            best = max(best, q[u, s, a])
        for t in range(1, horizon + 1):
            number = uniform(stream)
            if number < epsilon:
                action = _index(number / epsilon * actions)
            else:
                ties = 0
                action = _index(0)
                for a in range(actions):
                    if q[u, s, a] == best:
                        action = _index(a)
                        ties += 1
                if ties > 1:
                    pick = int((number - epsilon) / (1.0 - epsilon) * ties)
                    for a in range(actions):
                        if q[u, s, a] == best:
                            if pick == 0:
                                action = _index(a)
                                break
                            pick -= 1
            chance = uniform(stream)
            outcome = _index(0)
            while outcome < outcomes - 1 and chance >= thresholds[s, action, outcome]:
                outcome = _index(outcome + 1)
            next_s = _index(successor[s, action, outcome])
            next_u = _index(memory_delta[u, _index(memory_letter[s, action, outcome])])
            w = _index(task_delta[w, _index(task_letter[next_s])])
            gained = np.float64(reward[w, next_s])
            over = terminated[w] or t == horizon
            if t == horizon:
                gained += final_reward[w]
            total += gained
            best = q[next_u, next_s, 0]
            for a in range(1, actions):
                best = max(best, q[next_u, next_s, a])
            target = gained if over else gained + gamma * best
            rate = alpha
            if updates is not None:
                if confidence is not None:
                    trust = confidence[u, s, action] * patience / (patience + updates[u, s, action])
                    rate = alpha / (1.0 + alpha * trust)
                updates[u, s, action] += np.uint32(1)
            updated = np.float32(q[u, s, action] + rate * (target - q[u, s, action]))
            q[u, s, action] = updated
            if u == next_u and s == next_s:
                # the update may have changed the best value of the very state that comes next
                best = q[u, s, 0]
                for a in range(1, actions):
                    best = max(best, q[u, s, a])
            s = next_s
            u = next_u
            if record:
                paths[episode, t] = s
            if over:
                break
        returns[episode] = total


@njit
def greedy_returns(
    start_thresholds: NDArray[np.float64],
    successor: NDArray[np.int32],
    thresholds: NDArray[np.float64],
    task_start: NDArray[np.int32],
    task_delta: NDArray[np.int32],
    task_letter: NDArray[np.int32],
    reward: NDArray[np.float32],
    final_reward: NDArray[np.float32],
    terminated: NDArray[np.bool_],
    horizon: int,
    memory_start: NDArray[np.int32],
    memory_delta: NDArray[np.int32],
    memory_letter: NDArray[np.int32],
    stream: NDArray[np.uint64],
    q: NDArray[np.float32],
    returns: NDArray[np.float32],
) -> None:
    """Play the greedy policy, ties to the lower action; fills ``returns`` (see `q_learning`)."""
    actions = successor.shape[1]
    outcomes = successor.shape[2]
    for episode in range(len(returns)):
        s = _index(draw_state(start_thresholds, uniform(stream)))
        w = _index(task_start[s])
        u = _index(memory_start[s])
        total = 0.0
        for t in range(1, horizon + 1):
            chance = uniform(stream)
            action = _index(0)
            for a in range(1, actions):
                # not against a running maximum: that becomes a chain of selections, where this is a jump well foreseen
                if q[u, s, a] > q[u, s, action]:
                    action = _index(a)
            outcome = _index(0)
            while outcome < outcomes - 1 and chance >= thresholds[s, action, outcome]:
                outcome = _index(outcome + 1)
            u = _index(memory_delta[u, _index(memory_letter[s, action, outcome])])
            s = _index(successor[s, action, outcome])
            w = _index(task_delta[w, _index(task_letter[s])])
            gained = np.float64(reward[w, s])
            if t == horizon:
                gained += final_reward[w]
            total += gained
            if terminated[w]:
                break
        returns[episode] = total
