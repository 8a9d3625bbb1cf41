"""What an agent remembers beside the MDP state: the τ-states and the extended states of the paper, as one table.

A memory is a finite automaton over the transitions of an MDP. The agent learns on pairs (memory state u, MDP
state s): with the tick tables of a formula they are the extended states X = ∪ X_i (Section IV-B, Step 3), with
the last τ-1 states they are the τ-states (Section V). One kernel runs both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import frozen_array
from tickwise.automata.ticks import TickTable
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError, DataError
from tickwise.logic.semantics import holds

DisjunctChoice = Callable[[TabularMDP, Sequence[TickTable]], NDArray[np.int32]]
"""Chooses the index i of the disjunct for each initial state: shape ``(states,)``."""


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """A finite memory over the transitions of an MDP.

    Attributes:
        start: Memory state once the initial state was seen, int32, shape ``(states,)``.
        delta: Next memory state, int32, shape ``(memory states, letters)``.
        letter: Letter of each transition, int32, shape ``(states, actions, outcomes)``.
        tables: The tick tables of the disjuncts; empty for τ-states.
        offsets: Where each table's states start: memory state ``offsets[i] + u`` is state u of ``tables[i]``.
    """

    start: NDArray[np.int32]
    delta: NDArray[np.int32]
    letter: NDArray[np.int32]
    tables: tuple[TickTable, ...] = ()
    offsets: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name in ("start", "delta", "letter"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), np.int32))
        if self.start.max() >= self.n_states or self.delta.max() >= self.n_states or self.start.min() < 0:
            raise DataError(f"a memory names a state beyond its {self.n_states}")
        if self.letter.max() >= self.delta.shape[1]:
            raise DataError(f"a memory's letter is beyond its {self.delta.shape[1]} letters")

    @property
    def n_states(self) -> int:
        """The number of memory states."""
        return len(self.delta)


def tau_memory(mdp: TabularMDP, tau: int = 5) -> Memory:
    """The memory of τ-states: the current state and the τ-1 states before it (Section V, Case Study 1).

    Given a state, the one before it is one of its few predecessors in the MDP; the memory holds the positions of
    the last τ-1 states in their successors' lists of predecessors, 0 for "before tick 0". That is a bijection
    with the sequences of states, in far less room than a power of the number of states.

    Args:
        mdp: The world.
        tau: The horizon τ, at least 1; 1 is plain Q-learning.

    Returns:
        The memory, with ``(largest number of predecessors + 1) ** (tau - 1)`` states.

    Raises:
        ConfigurationError: If tau is less than 1.
    """
    if tau < 1:
        raise ConfigurationError(f"the horizon of τ-states is {tau}; use 1 or more")
    before, actions, outcomes = np.nonzero(mdp.probability > 0)
    after = mdp.successor[before, actions, outcomes]
    pairs = np.unique(after.astype(np.int64) * mdp.n_states + before)
    first = np.searchsorted(pairs, np.arange(mdp.n_states) * mdp.n_states)
    rank = np.searchsorted(pairs, after.astype(np.int64) * mdp.n_states + before) - first[after]
    letter = np.zeros(mdp.successor.shape, dtype=np.int32)
    letter[before, actions, outcomes] = rank + 1
    base = int(letter.max()) + 1
    states = np.arange(base ** (tau - 1))
    delta = ((states[:, None] * base + np.arange(base)) % len(states)).astype(np.int32)
    return Memory(np.zeros(mdp.n_states, np.int32), delta, letter)


def tick_memory(mdp: TabularMDP, horizon: int) -> Memory:
    """The memory of how many ticks have passed: with it, what is due at a tick can be learned, but not what was done.

    It is what an agent has that sees a clock beside the state, and the baseline that says what the automaton adds.

    Args:
        mdp: The world.
        horizon: The last tick that is told from the ones before it.

    Returns:
        The memory, with ``horizon + 1`` states.

    Raises:
        ConfigurationError: If the horizon is less than 1.
    """
    if horizon < 1:
        raise ConfigurationError(f"the horizon of counted ticks is {horizon}; use 1 or more")
    following = np.minimum(np.arange(horizon + 1) + 1, horizon)[:, None]
    return Memory(np.zeros(mdp.n_states, np.int32), following, np.zeros(mdp.successor.shape, np.int32))


def nearest_centroid(mdp: TabularMDP, tables: Sequence[TickTable]) -> NDArray[np.int32]:
    """Choose the disjunct whose first predicate's region has its centroid nearest to the state (Step 3).

    Args:
        mdp: The world, whose limits close the open sides of a region.
        tables: The tick table of each disjunct.

    Returns:
        The index of the nearest disjunct for each state, ties to the lower index, shape ``(states,)``.
    """
    centroids = np.array(
        [table.automaton.conjunction.primitives[0].box.centroid(mdp.variables, mdp.limits) for table in tables]
    )
    distance = np.linalg.norm(mdp.coordinates[:, None, :] - centroids[None, :, :], axis=2)
    return np.asarray(distance.argmin(axis=1), dtype=np.int32)


def nearest_region(mdp: TabularMDP, tables: Sequence[TickTable]) -> NDArray[np.int32]:
    """Choose the disjunct whose first predicate's region itself is nearest to the state, ties as `nearest_centroid`.

    Args:
        mdp: The world.
        tables: The tick table of each disjunct.

    Returns:
        The index of the nearest disjunct for each state, shape ``(states,)``.
    """
    columns = []
    for table in tables:
        ranges = {bound.variable: bound for bound in table.automaton.conjunction.primitives[0].box.bounds}
        low, high = (
            np.array([getattr(ranges[name], side) if name in ranges else open_end for name in mdp.variables])
            for side, open_end in (("lower", -np.inf), ("upper", np.inf))
        )
        outside = mdp.coordinates - np.clip(mdp.coordinates, low, high)
        columns.append(np.linalg.norm(outside, axis=1))
    centroid = nearest_centroid(mdp, tables)
    distance = np.round(np.stack(columns, axis=1), 9)
    nearest = distance == distance.min(axis=1, keepdims=True)
    tie = nearest[np.arange(len(centroid)), centroid]
    return np.where(tie, centroid, nearest.argmax(axis=1)).astype(np.int32)


def first_disjunct(mdp: TabularMDP, tables: Sequence[TickTable]) -> NDArray[np.int32]:
    """Choose the first disjunct always: a baseline that makes no use of the others, shape ``(states,)``."""
    del tables
    return np.zeros(mdp.n_states, dtype=np.int32)


DISJUNCT_CHOICES: dict[str, DisjunctChoice] = {
    "nearest_centroid": nearest_centroid,
    "nearest_region": nearest_region,
    "first_disjunct": first_disjunct,
}
"""The strategies by name; the first is the paper's example. A study names one, and another may be added here."""


def disjunct_choice(name: str) -> DisjunctChoice:
    """The strategy of a name.

    Raises:
        ConfigurationError: If there is none.
    """
    if name not in DISJUNCT_CHOICES:
        raise ConfigurationError(
            f"there is no choice of the disjunct {name!r}; use {', '.join(DISJUNCT_CHOICES)}, or add yours to "
            "DISJUNCT_CHOICES"
        )
    return DISJUNCT_CHOICES[name]


def automaton_memory(mdp: TabularMDP, tables: Sequence[TickTable], choose: DisjunctChoice = nearest_centroid) -> Memory:
    """The memory of extended states X = ∪ X_i: location and clock valuation of the chosen disjunct's automaton.

    Args:
        mdp: The world; predicates are read at the coordinates of its states.
        tables: The tick table of each sequential conjunctive subformula.
        choose: Chooses the disjunct at the start of an episode.

    Returns:
        The memory whose states are the tables' states, one table after the other.

    Raises:
        ConfigurationError: If there is no table.
    """
    if not tables:
        raise ConfigurationError("extended states need at least one timed automaton; give the formula's tables")
    letters = np.stack([state_letters(mdp, table) for table in tables])
    # one letter for each combination that occurs in the world, so that few suffice
    combinations, code = np.unique(letters, axis=1, return_inverse=True)
    code = np.asarray(code.reshape(-1), dtype=np.int32)
    offsets = np.concatenate([[0], np.cumsum([len(table.delta) for table in tables])])
    delta = np.concatenate([table.delta[:, combinations[index]] + offsets[index] for index, table in enumerate(tables)])
    chosen = choose(mdp, tables)
    start = delta[offsets[chosen], code]
    letter = np.asarray(code[mdp.successor], dtype=np.int32)
    return Memory(start, delta, letter, tuple(tables), tuple(int(x) for x in offsets[:-1]))


def state_letters(mdp: TabularMDP, table: TickTable) -> NDArray[np.int32]:
    """The letter that a tick table reads in each state of a world: bit j iff predicate j holds there.

    Args:
        mdp: The world.
        table: A compiled automaton.

    Returns:
        Letters, shape ``(states,)``.
    """
    letter = np.zeros(mdp.n_states, dtype=np.int32)
    for bit, predicate in enumerate(table.automaton.predicates):
        letter |= holds(predicate, mdp.coordinates, mdp.variables).astype(np.int32) << bit
    return letter
