"""Slow and obvious twins: Kleene's semantics on words, and an interpreter of edges and guards."""

from __future__ import annotations

import operator
from collections.abc import Sequence

from hypothesis import strategies as st

from tickwise.automata.model import TimedAutomaton
from tickwise.logic.sdnf import Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Box, Interval

G = Box.of(x=(3, 4), y=(3, 5))
Y = Box.of(x=(7, 8), y=(5, 8))

CASE_STUDY = SequentialConjunction(
    (
        Primitive(Operator.EVENTUALLY_ALWAYS, Interval(1, 15), 4, G),
        Primitive(Operator.EVENTUALLY, Interval(21, 39), 0, Y),
    )
)
"""The source formula of Case Study 1."""

COMPARE = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


def one(kind: str, start: int, end: int, duration: int = 0) -> SequentialConjunction:
    """A conjunction of one primitive over `G`."""
    return SequentialConjunction((Primitive(Operator(kind), Interval(start, end), duration, G),))


def kleene(conjunction: SequentialConjunction, word: Sequence[int]) -> int:
    """The three-valued verdict on the letters of the ticks from 0; what lies past them is unknown."""
    return min(_primitive(primitive, j, word) for j, primitive in enumerate(conjunction.primitives))


def _primitive(primitive: Primitive, j: int, word: Sequence[int]) -> int:
    combine = {"F": max, "G": min}

    def atom(tick: int) -> int:
        if tick >= len(word):
            return 0
        return 1 if word[tick] >> j & 1 else -1

    def inner(tick: int) -> int:
        if not primitive.operator.nested:
            return atom(tick)
        return combine[primitive.operator.value[1]](atom(later) for later in range(tick, tick + primitive.duration + 1))

    window = range(primitive.window.start, primitive.window.end + 1)
    return combine[primitive.operator.value[0]](inner(tick) for tick in window)


def walk(automaton: TimedAutomaton, word: Sequence[int]) -> list[tuple[int, tuple[int, ...]]]:
    """The location and clock valuation after each letter; fails unless exactly one edge is enabled."""
    location, valuation = automaton.initial, [0] * len(automaton.clocks)
    trace = []
    for tick, letter in enumerate(word):
        if tick > 0:
            valuation = [value + 1 for value in valuation]
        (edge,) = (
            edge
            for edge in automaton.edges
            if edge.source == location
            and all(bool(letter >> j & 1) == holds for j, holds in edge.literals)
            and all(COMPARE[atom.comparison](valuation[atom.clock], atom.value) for atom in edge.guard)
        )
        location = edge.target
        valuation = [0 if clock in edge.resets else value for clock, value in enumerate(valuation)]
        trace.append((location, tuple(valuation)))
    return trace


@st.composite
def words(draw: st.DrawFn, conjunction: SequentialConjunction) -> list[int]:
    """Letters of a conjunction's alphabet for a few ticks more than matter; each predicate tends to dwell."""
    ticks = conjunction.primitives[-1].end + 3
    word = [0] * ticks
    for j in range(len(conjunction.primitives)):
        switches = draw(st.lists(st.integers(0, ticks), max_size=2 * ticks // 3))
        state = draw(st.booleans())
        for tick in range(ticks):
            state ^= switches.count(tick) % 2 == 1
            word[tick] |= state << j
    return word
