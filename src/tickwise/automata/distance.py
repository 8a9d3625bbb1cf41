"""How far a table state is from acceptance."""

from __future__ import annotations

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
