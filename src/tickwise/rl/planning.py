"""The compiled loops of model-based learning: what is counted while an episode is played, and planning on the counts.

Draws are in the order of `tickwise.rl.kernels`: a uniform number for the initial state, then two at each step, the
first for a tie of actions and the second for the outcome.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.rl.loop import advance, begin
from tickwise.rl.stream import uniform

_index = np.uint32

CLASSES = 6
"""Rewards are counted by what the automaton says on arriving (false, unknown, true) and whether it is the last tick."""


class Counts(NamedTuple):
    """What was met in a world; none of it depends on the automaton but the rewards' classes.

    Attributes:
        outcomes: How often each outcome of a state and an action came, int32, shape ``(states, actions, outcomes)``. An
            outcome's successor is known once it came.
        rewards: The sum of the rewards on arriving in a state, float64, shape ``(CLASSES, states)``.
        arrivals: How often it was arrived in, int32, shape ``(CLASSES, states)``.
        ends: How often the episode ended there, int32, shape ``(CLASSES, states)``.
    """

    outcomes: NDArray[np.int32]
    rewards: NDArray[np.float64]
    arrivals: NDArray[np.int32]
    ends: NDArray[np.int32]


@njit
def greedy_action(values: NDArray[np.float32], number: float) -> int:
    """The action of the greatest value, one of equal ones by a uniform number."""
    best = values.max()
    pick = int(number * np.count_nonzero(values == best))
    for a in range(len(values)):
        if values[a] == best:
            if pick == 0:
                return a
            pick -= 1
    return 0


@njit
def play(
    world: Any,
    verdict: NDArray[np.int8],
    q: NDArray[np.float32],
    counts: Counts,
    stream: NDArray[np.uint64],
    returns: NDArray[np.float32],
    paths: NDArray[np.int32],
) -> None:
    """Play episodes greedily, ties at random, and count what is met.

    ``verdict`` is that of `tickwise.rl.unrolled.Unrolled`; for the rest see `tickwise.rl.loop.run_episodes`.
    """
    horizon, delta, letters = world[9], world[11], world[12]
    for episode in range(len(returns)):
        u, s, w = begin(world, stream)
        paths[episode, 0] = s
        total = 0.0
        for t in range(1, horizon + 1):
            action = _index(greedy_action(q[u, s], uniform(stream)))
            outcome, next_s, w, gained, over = advance(world, t, s, w, action, uniform(stream))
            counts.outcomes[s, action, outcome] += 1
            u, s = _index(delta[u, _index(letters[s, action, outcome])]), next_s
            kind = 2 * (verdict[u] + 1) + (t == horizon)
            counts.rewards[kind, s] += gained
            counts.arrivals[kind, s] += 1
            counts.ends[kind, s] += over
            total += gained
            paths[episode, t] = s
            if over:
                break
        returns[episode] = total


@njit
def plan(
    successor: NDArray[np.int32],
    memory_delta: NDArray[np.int32],
    memory_letter: NDArray[np.int32],
    tick: NDArray[np.int32],
    verdict: NDArray[np.int8],
    horizon: int,
    outcomes: NDArray[np.int32],
    known: int,
    reward: NDArray[np.float64],
    ends: NDArray[np.float64],
    worth: NDArray[np.float64],
    given: NDArray[np.float32],
    q: NDArray[np.float32],
) -> None:
    """Fill ``q`` with the values of the empirical model, by one sweep from the last tick to the first.

    Args:
        successor: The world's successors; only those of outcomes that came are read.
        memory_delta: The unrolled memory's.
        memory_letter: The unrolled memory's.
        tick: The tick of each memory state, ascending.
        verdict: What the automaton says in it.
        horizon: The last tick.
        outcomes: How often each outcome came, shape ``(states, actions, outcomes)``.
        known: A state and an action are taken as known once they were met so often.
        reward: The expected reward on arriving, shape ``(CLASSES, states)``.
        ends: The probability that the episode ends there, same shape.
        worth: What an unknown pair is taken to be worth in each memory state, shape ``(memory states,)``.
        given: The same by pair, such as transferred values, shape ``(memory states, states, actions)``; of no memory
            states where `worth` counts.
        q: Filled, shape ``(memory states, states, actions)``; 0 at the last tick, where no action is left to take.
    """
    states, actions, slots = successor.shape
    following = np.empty((len(memory_delta), states), dtype=np.float64)
    for u in range(len(memory_delta) - 1, -1, -1):
        last = tick[u] == horizon
        kind = 2 * (verdict[u] + 1) + last
        for s in range(states):
            best = 0.0
            for a in range(actions):
                met = 0
                for k in range(slots):
                    met += outcomes[s, a, k]
                if last:
                    value = 0.0
                elif met < known:
                    value = np.float64(given[u, s, a]) if len(given) > 0 else worth[u]
                else:
                    value = 0.0
                    for k in range(slots):
                        if outcomes[s, a, k] > 0:
                            then = memory_delta[u, memory_letter[s, a, k]]
                            value += outcomes[s, a, k] * following[then, successor[s, a, k]]
                    value /= met
                q[u, s, a] = value
                best = value if a == 0 else max(best, value)
            # what arriving here is worth: the reward, and what follows unless the episode ends
            following[u, s] = reward[kind, s] + (1.0 - ends[kind, s]) * best


@njit
def imagine(
    starts: NDArray[np.int32],
    successor: NDArray[np.int32],
    memory_start: NDArray[np.int32],
    memory_delta: NDArray[np.int32],
    memory_letter: NDArray[np.int32],
    outcomes: NDArray[np.int32],
    stream: NDArray[np.uint64],
    q: NDArray[np.float32],
    paths: NDArray[np.int32],
) -> None:
    """Play greedily, ties at random, in the world as far as it was met.

    Where an action never was, the state stays as it is to the end, and nothing more is drawn for the episode.

    ``starts``, shape ``(n,)``, are MDP states, one of which is drawn at the beginning of each episode; ``paths``, shape
    ``(episodes, horizon + 1)``, is filled with MDP states. The rest is as in `plan`.
    """
    _actions, slots = successor.shape[1], successor.shape[2]
    for episode in range(len(paths)):
        s = _index(starts[int(uniform(stream) * len(starts))])
        u = _index(memory_start[s])
        paths[episode, :] = s
        for t in range(1, paths.shape[1]):
            action = greedy_action(q[u, s], uniform(stream))
            met = 0
            for k in range(slots):
                met += outcomes[s, action, k]
            if met == 0:
                break
            left = int(uniform(stream) * met)
            outcome = _index(0)
            while left >= outcomes[s, action, outcome]:
                left -= outcomes[s, action, outcome]
                outcome = _index(outcome + 1)
            u = _index(memory_delta[u, _index(memory_letter[s, action, outcome])])
            s = _index(successor[s, action, outcome])
            paths[episode, t:] = s
