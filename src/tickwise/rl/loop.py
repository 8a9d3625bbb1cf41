"""What the compiled loops of the learning forms share: drawing an action, one tick of the world, and the call.

Q-learning's own loop in `tickwise.rl.kernels` has these parts written out, since that is a tenth faster. The order of
the draws is the same in all: a uniform number for the initial state, then at each step one for the action and one for
the outcome.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.rl.kernels import draw_state
from tickwise.rl.qlearning import Problem
from tickwise.rl.stream import put_back, take_stream, uniform

# Unsigned, so that the compiled indexing need not ask whether an index counts from the end.
_index = np.uint32

Index: TypeAlias = int | np.uint32
"""The number of a state or an action."""


def run_episodes(
    kernel: Callable[..., None], problem: Problem, arguments: tuple[Any, ...], rng: np.random.Generator, episodes: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Call a compiled loop that learns, and let the generator go on where the loop ended.

    Args:
        kernel: Takes the problem's arrays as one tuple, the arguments, the stream of the generator, the returns and the
            paths; it fills the latter two.
        problem: What is learned.
        arguments: The form's own arrays and settings; what is learned is changed in place.
        rng: The generator that all draws come from.
        episodes: The number of episodes.

    Returns:
        What `tickwise.rl.learner.Learner.learn` does.
    """
    returns = np.empty(episodes, dtype=np.float32)
    paths = np.full((episodes, problem.task.horizon + 1), -1, dtype=np.int32)
    stream = take_stream(rng)
    kernel(problem.arrays, *arguments, stream, returns, paths)
    put_back(rng, stream)
    return returns, paths


@njit
def begin(world: Any, stream: NDArray[np.uint64]) -> Any:
    """The first memory state, state and task state of an episode; ``world`` is `Problem.arrays`."""
    s = _index(draw_state(world[0], uniform(stream)))
    return _index(world[10][s]), s, _index(world[3][s])


@njit
def advance(world: Any, t: int, s: Index, w: Index, action: Index, number: float) -> Any:
    """Go to tick t; the number in [0, 1) draws the outcome.

    Returns:
        The outcome, the next state, the next task state, the reward, and whether the episode is over.
    """
    _, successor, thresholds, _, task_delta, task_letter, reward, final_reward, terminated, horizon, _, _, _ = world
    outcome = _index(0)
    while outcome < successor.shape[2] - 1 and number >= thresholds[s, action, outcome]:
        outcome = _index(outcome + 1)
    next_s = _index(successor[s, action, outcome])
    next_w = _index(task_delta[w, _index(task_letter[next_s])])
    gained = np.float64(reward[next_w, next_s])
    if t == horizon:
        gained += final_reward[next_w]
    return outcome, next_s, next_w, gained, terminated[next_w] or t == horizon


@njit
def best_value(q: NDArray[np.float32], u: Index, s: Index) -> np.float32:
    """The greatest value of an action in memory state u and state s."""
    best: np.float32 = q[u, s, 0]
    for a in range(1, q.shape[2]):
        best = max(best, q[u, s, a])
    return best


@njit
def draw_action(q: NDArray[np.float32], u: Index, s: Index, best: np.float32, epsilon: float, number: float) -> int:
    """The ε-greedy action that a number in [0, 1) selects, ties at random; ``best`` is the greatest value."""
    actions = q.shape[2]
    if number < epsilon:
        return int(number / epsilon * actions)
    ties, action = 0, 0
    for a in range(actions):
        if q[u, s, a] == best:
            action = a
            ties += 1
    if ties > 1:
        pick = int((number - epsilon) / (1.0 - epsilon) * ties)
        for a in range(actions):
            if q[u, s, a] == best:
                if pick == 0:
                    return a
                pick -= 1
    return action
