"""A memory with the tick in it: extended states, each at the ticks at which it occurs in an episode of known length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import frozen_array
from tickwise.errors import ConfigurationError
from tickwise.rl.states import Memory


@dataclass(frozen=True, slots=True, eq=False)
class Unrolled:
    """The pairs (tick, memory state) that words of the world's letters lead to, as a memory; none is met twice.

    Planning on it is a single sweep from the last tick to the first. An automaton's clocks mostly tell the tick
    anyhow, so that there are few more pairs than states.

    Attributes:
        memory: The memory over the pairs, which are numbered by tick, and of one tick by state.
        tick: The tick of each pair, int32, shape ``(pairs,)``.
        state: The memory state of each pair, int32, shape ``(pairs,)``.
        verdict: What the automaton that is followed says in it: 1 true, 0 unknown, -1 false, int8, shape ``(pairs,)``;
            0 for a memory without automata.
    """

    memory: Memory
    tick: NDArray[np.int32]
    state: NDArray[np.int32]
    verdict: NDArray[np.int8]


def unroll(memory: Memory, horizon: int) -> Unrolled:
    """Put the tick into a memory.

    Args:
        memory: A memory, such as that of extended states.
        horizon: The length L of an episode, in ticks; a pair of tick L has itself as its successor.

    Returns:
        The memory over the pairs.

    Raises:
        ConfigurationError: If the horizon is less than 1.
    """
    if horizon < 1:
        raise ConfigurationError(f"the horizon of an episode is {horizon}; use 1 tick or more")
    letters = np.unique(memory.letter)
    present = [np.unique(memory.start)]
    for _ in range(horizon):
        present.append(np.unique(memory.delta[present[-1]][:, letters]))
    first = np.concatenate([[0], np.cumsum([len(states) for states in present])])
    delta = np.tile(np.arange(first[-1], dtype=np.int32)[:, None], memory.delta.shape[1])
    for t in range(horizon):
        following = memory.delta[present[t]][:, letters]
        delta[first[t] : first[t + 1], letters] = first[t + 1] + np.searchsorted(present[t + 1], following)
    start = np.searchsorted(present[0], memory.start).astype(np.int32)
    state = np.concatenate(present)
    tick = np.repeat(np.arange(horizon + 1), [len(states) for states in present])
    verdict = np.concatenate([table.verdict for table in memory.tables]) if memory.tables else np.zeros(memory.n_states)
    return Unrolled(
        Memory(start, delta, memory.letter),
        frozen_array(tick, np.int32),
        frozen_array(state, np.int32),
        frozen_array(verdict[state], np.int8),
    )
