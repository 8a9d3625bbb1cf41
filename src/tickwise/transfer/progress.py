"""Clocks by their progress: how far a window or a duration has come, instead of how many ticks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.ticks import TickTable
from tickwise.logic.sdnf import Operator, Primitive


def progress_valuations(source: TickTable, target: TickTable) -> NDArray[np.float64]:
    """The source's clock values that are as far as the target's, for each table state of the target.

    A location works on one primitive, whose window is [a, b] in the target and [a', b'] in the source.

    - Before its window, the clock is as far on the way to a' as it is on the way to a. The way begins at the first tick
      at which the primitive before can be done with, or at tick 0.
    - In its window, it is as far through [a', b'] as through [a, b].
    - Within a stay or a gap, the tick at which that began is mapped in this way, and its length d by its share of the
      duration, d k' / k; so both clocks still say when it began.

    Clocks that a location does not use, and those of accepting and rejecting locations, are left as they are.

    Args:
        source: The tick table of φ_î^S.
        target: The tick table of φ_i^T, isomorphic to it.

    Returns:
        Clock values in ticks of the source, not whole ones, shape ``(target table states, clocks)``.
    """
    automaton = target.automaton
    own, other = (table.automaton.conjunction.primitives for table in (target, source))
    moved = target.clocks.astype(np.float64)
    for location, stage in enumerate(automaton.stages):
        if location in automaton.accepting or location in automaton.rejecting:
            continue
        there = target.location == location
        ways = _way(own, stage), _way(other, stage)
        if automaton.stages.index(stage) == location:  # it waits
            moved[there, 0] = np.interp(moved[there, 0], *ways)
            continue
        length = moved[there, 1]
        begun = np.interp(moved[there, 0] - length, *ways)
        length = length * (other[stage].duration / own[stage].duration)
        moved[there, 0], moved[there, 1] = begun + length, length
    return moved


def _way(primitives: tuple[Primitive, ...], stage: int) -> list[int]:
    """Where the way to a primitive's window begins, and where the window begins and ends."""
    window = primitives[stage].window
    return [_earliest(primitives[stage - 1]) if stage else 0, window.start, window.end]


def _earliest(primitive: Primitive) -> int:
    """The first tick at which a primitive can be done with."""
    match primitive.operator:
        case Operator.EVENTUALLY:
            return primitive.window.start
        case Operator.EVENTUALLY_ALWAYS:
            return primitive.window.start + primitive.duration
        case _:
            return primitive.window.end
