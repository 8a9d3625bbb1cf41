from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from tests.automata.twins import one
from tests.strategies import sequential_conjunctions
from tickwise.automata.build import build
from tickwise.automata.distance import ticks_to_acceptance
from tickwise.automata.ticks import TickTable


def shortest_word(table: TickTable, state: int) -> int:
    """The length of the shortest word to acceptance, by trying all words, breadth first; -1 if there is none."""
    reached, length, seen = {state}, 0, set()
    while reached - seen:
        if any(table.verdict[u] > 0 for u in reached):
            return length
        seen |= reached
        reached = {int(table.delta[u, letter]) for u in reached for letter in range(table.delta.shape[1])}
        length += 1
    return -1


@settings(max_examples=40)
@given(sequential_conjunctions(most=2, longest=3))
def test_the_distance_is_the_length_of_the_shortest_word_to_acceptance(conjunction):
    table = build(conjunction).compile()
    ticks = ticks_to_acceptance(table)
    states = range(0, len(table), max(1, len(table) // 20))
    assert [int(ticks[state]) for state in states] == [shortest_word(table, state) for state in states]
    assert (ticks[table.verdict < 0] == -1).all()
    assert ((ticks == 0) == (table.verdict > 0)).all()


def test_a_stay_is_as_far_as_its_ticks_that_are_left():
    # F[2,9] G[0,3]: after tick 0 the window is two ticks away, and the stay is at ticks 2, 3, 4 and 5
    table = build(one("FG", 2, 9, 3)).compile()
    ticks = ticks_to_acceptance(table)
    word = [0, 0, 1, 1, 1, 1]
    assert [int(ticks[state]) for state in table.run(np.array(word))] == [5, 4, 3, 2, 1, 0]
    # a stay that breaks off begins anew
    assert [int(ticks[state]) for state in table.run(np.array([0, 0, 1, 0, 0]))] == [5, 4, 3, 4, 4]


def test_a_state_that_only_waits_is_as_far_as_its_window():
    # G[3,5]: decided at tick 5 at the soonest
    table = build(one("G", 3, 5)).compile()
    assert [int(ticks_to_acceptance(table)[u]) for u in table.run(np.array([0, 0, 0, 1, 0]))] == [5, 4, 3, 2, -1]
