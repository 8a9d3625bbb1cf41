"""A timed automaton as integer arrays: the reachable (location, clock valuation) pairs and their successors.

Discrete time makes the automaton finite (tick automata, the paper's Remark 1): all that a learner, a planner
or a probability needs is ``u = delta[u, letter]`` at every tick.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise._wording import brief
from tickwise.automata.model import TimedAutomaton, letter_text
from tickwise.errors import AutomatonError, ConfigurationError, DataError

MOST_ENTRIES = 2**26
"""A table whose delta could have more entries is refused."""


@dataclass(frozen=True, slots=True, eq=False)
class TickTable:
    """The tick automaton of a timed automaton; all arrays are read-only.

    State 0 is the start, before any letter was read; the others are pairs of a location and the clock
    valuation *after* a letter was read. ``u = delta[0, letter_0]`` reads the letter of tick 0 with no time
    passing, and ``delta[u, letter]`` for a later state lets one tick flow, then takes the edge.

    Attributes:
        delta: int32 (U, 2**n), the next state for each state and letter.
        location: int16 (U,), the location of each state.
        clocks: int16 (U, C), the clock valuation of each state, in ticks.
        stage: int16 (U,), the primitive that the state works on.
        verdict: int8 (U,), what the state says of the conjunction: 1 true, 0 unknown, -1 false.
        automaton: The timed automaton.
    """

    delta: NDArray[np.int32]
    location: NDArray[np.int16]
    clocks: NDArray[np.int16]
    stage: NDArray[np.int16]
    verdict: NDArray[np.int8]
    automaton: TimedAutomaton

    def __len__(self) -> int:
        return len(self.delta)

    def run(self, letters: NDArray[Any], lengths: NDArray[Any] | None = None) -> NDArray[np.int32]:
        """The state after each tick's letter.

        Args:
            letters: Whole numbers in ``[0, 2**n)``, shape (ticks,) or (n, ticks), one a tick from tick 0.
            lengths: The number of letters of each row, shape (n,); what lies past it is not read.

        Returns:
            int32 of the shape of `letters`; past a row's length its last state is repeated.

        Raises:
            DataError: If the letters are no letters of the automaton, or the lengths do not fit.
        """
        rows, counts = _checked(letters, lengths, self.automaton.letters_count)
        states: NDArray[np.int32] = _follow(self.delta, rows, counts)
        return states if np.ndim(letters) == 2 else states[0]

    def verdicts(self, letters: NDArray[Any], lengths: NDArray[Any] | None = None) -> NDArray[np.int8]:
        """The verdict after the last letter of each row; the arguments are `run`'s, the result int8 (n,)."""
        return self.verdict[np.atleast_2d(self.run(letters, lengths))[:, -1]]


def compile_table(automaton: TimedAutomaton, horizon: int | None = None, *, reduce: bool = True) -> TickTable:
    """Number the reachable (location, clock valuation) pairs, breadth first, letters in increasing order.

    Args:
        automaton: A timed automaton that has an edge for every letter in everything reachable.
        horizon: The greatest clock value, in ticks, at which clocks stop: V = {0, …, horizon} for each clock;
            by default the conjunction's end-effect time (Definition 4), or the greatest constant if that is
            greater.
        reduce: Whether to hold the clocks that a location does not use at 0 (activity reduction), which
            changes no verdict. Without it all clocks run in every location, as in the paper.

    Returns:
        The table.

    Raises:
        ConfigurationError: If the horizon is out of range or too short to tell guards apart, or the table too
            large.
        AutomatonError: If no edge can be taken on some letter somewhere.
    """
    if horizon is None:
        horizon = max([automaton.conjunction.primitives[-1].end, *_constants(automaton)])
    delta, location, clocks, too_short = _explored(automaton, horizon, reduce)
    if too_short:
        enough = _ceilings(automaton).max()
        raise ConfigurationError(f"horizon {horizon} is too short for the guards; use {enough} or more")
    if (delta < 0).any():
        state, letter = (int(index) for index in np.argwhere(delta < 0)[0])
        raise AutomatonError(_missing(automaton, location[state], clocks[state], letter))
    stages = np.array(automaton.stages, dtype=np.int16)
    outcomes = np.array([automaton.outcome(q) for q in range(len(automaton.locations))], dtype=np.int8)
    arrays = (
        delta,
        location.astype(np.int16),
        clocks.astype(np.int16),
        stages[location],
        outcomes[location],
    )
    for array in arrays:
        array.flags.writeable = False
    return TickTable(*arrays, automaton)


def is_complete(automaton: TimedAutomaton) -> bool:
    """Whether an edge can be taken on every letter at every reachable location and clock valuation.

    Args:
        automaton: A timed automaton.

    Returns:
        The answer, for valuations that some trajectory reaches.

    Raises:
        ConfigurationError: If the automaton is too large for a table.
    """
    delta, *_ = _explored(automaton, int(_ceilings(automaton).max(initial=0)), reduce=True)
    return bool((delta >= 0).all())


def _explored(automaton: TimedAutomaton, horizon: int, reduce: bool) -> tuple[Any, Any, Any, bool]:
    """What `_explore` finds: delta, locations, clocks and whether the horizon is too short."""
    longest = np.iinfo(np.int16).max
    if isinstance(horizon, bool) or not 0 <= horizon <= longest:
        raise ConfigurationError(f"horizon {horizon} is out of range; use 0 to {longest} ticks")
    arrays = (*_edge_arrays(automaton), *_clock_arrays(automaton, reduce))
    room, letters, clocks = 512, automaton.letters_count, len(automaton.clocks)
    while room * letters <= MOST_ENTRIES:
        table = np.full(2 * room, -1, dtype=np.int64)
        delta = np.full((room, letters), -1, dtype=np.int32)
        found = np.empty(room, dtype=np.int64), np.empty((room, clocks), dtype=np.int64)
        count, too_short = _explore(horizon, table, delta, *found, *arrays)
        if count <= room:
            return delta[:count].copy(), found[0][:count], found[1][:count], too_short
        room *= 8  # and from the start: a search costs less than keeping what it found
    raise ConfigurationError(
        f"the table needs more than {MOST_ENTRIES} entries, {letters} letters for each state; use fewer "
        "primitives, a shorter horizon or activity reduction"
    )


def _constants(automaton: TimedAutomaton) -> list[int]:
    return [atom.value for edge in automaton.edges for atom in edge.guard]


def _missing(automaton: TimedAutomaton, location: int, clocks: NDArray[np.int64], letter: int) -> str:
    values = ", ".join(f"{name}={value}" for name, value in zip(automaton.clocks, clocks, strict=True))
    return (
        f"not complete: after {brief(automaton.locations[location])} with {values or 'no clocks'} no edge "
        f"can be taken on {letter_text(letter, len(automaton.predicates))}; add one"
    )


def _ceilings(automaton: TimedAutomaton) -> NDArray[np.int64]:
    """The value of each clock from which on a location's guards do not tell values apart, (Q, C)."""
    ceilings = np.zeros((len(automaton.locations), len(automaton.clocks)), dtype=np.int64)
    for edge in automaton.edges:
        for atom in edge.guard:
            ceilings[edge.source, atom.clock] = max(ceilings[edge.source, atom.clock], atom.ceiling)
    return ceilings


def _edge_arrays(automaton: TimedAutomaton) -> tuple[Any, ...]:
    """The edges sorted by source: where each location's begin, cubes, targets, guards' ranges and resets."""
    clocks = len(automaton.clocks)
    edges = sorted(automaton.edges, key=lambda edge: edge.source)
    first = np.searchsorted([edge.source for edge in edges], np.arange(len(automaton.locations) + 1))
    cubes = np.array([edge.cube for edge in edges], dtype=np.int64).reshape(-1, 2)
    targets = np.array([edge.target for edge in edges], dtype=np.int64)
    ranges = np.array([edge.ranges(clocks) for edge in edges], dtype=np.int64).reshape(-1, clocks, 2)
    resets = np.zeros((len(edges), clocks), dtype=np.bool_)
    for row, edge in zip(resets, edges, strict=True):
        row[list(edge.resets)] = True
    return automaton.initial, first, cubes, targets, ranges, resets


def _clock_arrays(automaton: TimedAutomaton, reduce: bool) -> tuple[Any, ...]:
    """Which clocks run in which location, and the ceilings there."""
    running = np.full((len(automaton.locations), len(automaton.clocks)), not reduce)
    for row, active in zip(running, automaton.active, strict=True):
        row[list(active)] = True
    return running, _ceilings(automaton)


@njit
def _slot(table: Any, location: Any, clocks: Any, q: int, v: Any) -> int:
    """Where the pair (q, v) is in an open-addressing hash table of state numbers, or would be put."""
    mask = len(table) - 1
    key = q + 1
    for value in v:
        key = (key * 1000003) ^ (value + 7919)
    slot = (key ^ (key >> 15)) & mask
    while True:
        state = table[slot]
        if state < 0:
            return slot
        same = location[state] == q
        for clock in range(len(v)):
            same = same and clocks[state, clock] == v[clock]
        if same:
            return slot
        slot = (slot + 1) & mask


@njit
def _explore(
    horizon: int,
    table: Any,
    delta: Any,
    location: Any,
    clocks: Any,
    initial: int,
    first: Any,
    cubes: Any,
    targets: Any,
    ranges: Any,
    resets: Any,
    running: Any,
    ceilings: Any,
) -> Any:
    """Breadth-first search into arrays full of -1; -1 stays in delta where no edge fits.

    Returns the number of states, which is one more than there is room for where it ended early, and whether
    a clock was stopped where guards can still tell its values apart.
    """
    count_clocks = running.shape[1]
    room, letters = delta.shape
    flowed, v = np.zeros(count_clocks, dtype=np.int64), np.zeros(count_clocks, dtype=np.int64)
    location[0] = initial
    clocks[0] = 0
    count, state, too_short = 1, 0, False
    while state < count:
        q = location[state]
        for clock in range(count_clocks):
            flowed[clock] = clocks[state, clock]
            if state > 0 and running[q, clock]:
                if flowed[clock] < horizon:
                    flowed[clock] += 1
                elif ceilings[q, clock] > horizon:
                    too_short = True
        for letter in range(letters):
            for edge in range(first[q], first[q + 1]):
                fits = letter & cubes[edge, 0] == cubes[edge, 1]
                for clock in range(count_clocks):
                    fits = fits and ranges[edge, clock, 0] <= flowed[clock] <= ranges[edge, clock, 1]
                if not fits:
                    continue
                for clock in range(count_clocks):
                    kept = running[targets[edge], clock] and not resets[edge, clock]
                    v[clock] = flowed[clock] if kept else 0
                slot = _slot(table, location, clocks, targets[edge], v)
                if table[slot] < 0:
                    if count == room:
                        return room + 1, too_short
                    table[slot] = count
                    location[count] = targets[edge]
                    for clock in range(count_clocks):
                        clocks[count, clock] = v[clock]
                    count += 1
                delta[state, letter] = table[slot]
                break
        state += 1
    return count, too_short


@njit
def _follow(delta: Any, letters: Any, lengths: Any) -> Any:
    states = np.empty(letters.shape, dtype=np.int32)
    for row in range(letters.shape[0]):
        state = 0
        for tick in range(letters.shape[1]):
            if tick < lengths[row]:
                state = delta[state, letters[row, tick]]
            states[row, tick] = state
    return states


def _checked(
    letters: NDArray[Any], lengths: NDArray[Any] | None, alphabet: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Letters as int64 (n, ticks) and lengths as int64 (n,)."""
    rows = np.atleast_2d(np.asarray(letters))
    if rows.ndim != 2 or rows.shape[1] == 0 or not np.issubdtype(rows.dtype, np.integer):
        raise DataError(f"letters of shape {rows.shape} and type {rows.dtype}; give whole numbers (n, ticks)")
    count, ticks = rows.shape
    counts = np.full(count, ticks) if lengths is None else np.atleast_1d(np.asarray(lengths))
    if counts.shape != (count,) or ((counts < 1) | (counts > ticks)).any():
        raise DataError(f"lengths {counts} do not fit {count} rows; give one length from 1 to {ticks} a row")
    wrong = ((rows < 0) | (rows >= alphabet)) & (np.arange(ticks) < counts[:, None])
    if wrong.any():
        row, tick = (int(index) for index in np.argwhere(wrong)[0])
        raise DataError(f"letter {rows[row, tick]} at tick {tick} of row {row} is not in [0, {alphabet})")
    return np.ascontiguousarray(rows, dtype=np.int64), counts.astype(np.int64)
