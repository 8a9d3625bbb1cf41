"""How far a table state is from acceptance or from its next primitive, and the potentials that say so in rewards."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.ticks import TickTable


def ticks_to_acceptance(table: TickTable) -> NDArray[np.int64]:
    """The fewest ticks after which each table state can accept, if every letter could be had at will.

    Args:
        table: A compiled automaton.

    Returns:
        Ticks, shape ``(U,)``: 0 for accepting states, -1 where no word leads to acceptance. State 0 has not read the
        letter of tick 0 yet, so that its number counts letters and is one more than the tick.
    """
    ticks = np.where(table.verdict > 0, 0, -1).astype(np.int64)
    distance = 0
    while True:
        arriving = (ticks == distance)[table.delta].any(axis=1) & (ticks < 0)
        if not arriving.any():
            return ticks
        distance += 1
        ticks[arriving] = distance


def ticks_to_progress(table: TickTable) -> NDArray[np.int64]:
    """The fewest ticks after which each table state can work on a later primitive, or accept.

    Args:
        table: A compiled automaton.

    Returns:
        Ticks, shape ``(U,)``: 0 for accepting states, -1 where no word leads on. State 0 counts letters, as in
        `ticks_to_acceptance`.
    """
    stage = _stages_done(table)
    following = stage[table.delta]
    kept = following == stage[:, None]
    undecided = table.verdict == 0
    ticks = np.where(table.verdict > 0, 0, -1).astype(np.int64)
    arriving = undecided & ((following > stage[:, None]) & (table.verdict[table.delta] >= 0)).any(axis=1)
    distance = 0
    while arriving.any():
        distance += 1
        ticks[arriving] = distance
        arriving = undecided & (ticks < 0) & (kept & (ticks == distance)[table.delta]).any(axis=1)
    return ticks


def acceptance_potential(tables: Sequence[TickTable], gamma: float, scale: float = 1.0) -> NDArray[np.float64]:
    """The potential Φ(u) = scale · γ^d(u), where d(u) ticks is the soonest that table state u can accept.

    It is what acceptance, worth ``scale``, would be worth to an agent that could have every letter at will, and 0
    where no word leads to acceptance any more.

    Args:
        tables: The compiled automata of a formula's disjuncts.
        gamma: The discount factor γ.
        scale: What acceptance is worth.

    Returns:
        The potential of each table state, one disjunct's after another's, shape ``(table states,)``.
    """
    ticks = np.concatenate([ticks_to_acceptance(table) for table in tables])
    return np.where(ticks >= 0, scale * float(gamma) ** np.maximum(ticks, 0), 0.0)


def progress_potential(tables: Sequence[TickTable], scale: float = 1.0) -> NDArray[np.float64]:
    """The potential Φ(u) = scale · (k + 1 / (1 + d)) / n, where k of n primitives are done and d ticks lead on.

    Unlike `acceptance_potential` it also grows with what is done while a later primitive's window alone says how soon
    acceptance can come. It is ``scale`` where a state accepts, and 0 where it rejects.

    Args:
        tables: The compiled automata of a formula's disjuncts.
        scale: What acceptance is worth.

    Returns:
        The potential of each table state, one disjunct's after another's, shape ``(table states,)``.
    """
    parts = []
    for table in tables:
        ticks = ticks_to_progress(table)
        nearer = np.where(ticks > 0, 1 / (1 + np.maximum(ticks, 0)), 0.0)
        done = (_stages_done(table) + nearer) / len(table.automaton.conjunction.primitives)
        parts.append(np.where(table.verdict < 0, 0.0, scale * done))
    return np.concatenate(parts)


def _stages_done(table: TickTable) -> NDArray[np.int64]:
    """How many primitives are done in each state that does not reject."""
    return np.where(table.verdict > 0, len(table.automaton.conjunction.primitives), table.stage).astype(np.int64)
