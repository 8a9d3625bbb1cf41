from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from tests.automata.twins import one
from tests.strategies import sequential_conjunctions
from tickwise.automata.build import build
from tickwise.automata.distance import (
    acceptance_potential,
    progress_potential,
    ticks_to_acceptance,
    ticks_to_progress,
)
from tickwise.automata.ticks import TickTable
from tickwise.logic.sdnf import SequentialConjunction


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


def shortest_way_on(table: TickTable, state: int) -> int:
    """The length of the shortest word to acceptance or a later primitive, by trying all words; -1 if there is none."""
    if table.verdict[state] > 0:
        return 0
    reached, length, seen = {state}, 0, set()
    while reached - seen:
        if any(table.verdict[u] > 0 or table.stage[u] > table.stage[state] for u in reached):
            return length
        seen |= reached
        following = {int(table.delta[u, letter]) for u in reached for letter in range(table.delta.shape[1])}
        reached = {u for u in following if table.verdict[u] >= 0}
        length += 1
    return -1


@settings(max_examples=40)
@given(sequential_conjunctions(most=3, longest=2))
def test_progress_is_the_length_of_the_shortest_word_to_a_later_primitive(conjunction):
    table = build(conjunction).compile()
    ticks = ticks_to_progress(table)
    undecided = np.flatnonzero(table.verdict >= 0)
    undecided = undecided[:: max(1, len(undecided) // 20)]
    assert ticks[undecided].tolist() == [shortest_way_on(table, state) for state in undecided]
    assert (ticks[table.verdict < 0] == -1).all()


@settings(max_examples=40)
@given(sequential_conjunctions(most=3, longest=2))
def test_a_later_primitive_has_the_greater_potential(conjunction):
    table = build(conjunction).compile()
    potential, count = progress_potential([table], 8.0), len(conjunction.primitives)
    undecided = table.verdict == 0
    assert (potential[undecided] > 8.0 * table.stage[undecided] / count).all()
    assert (potential[undecided] < 8.0 * (table.stage[undecided] + 1) / count).all()
    assert (potential[table.verdict > 0] == 8.0).all()
    assert (potential[table.verdict < 0] == 0.0).all()


def test_potentials_by_hand():
    # F[0,3] G[0,1] p & F[6,7] q, bits p = 1 and q = 2: p at two ticks in a row, then q at tick 6 or 7
    stay, reach = one("FG", 0, 3, 1), one("F", 6, 7)
    table = build(SequentialConjunction(stay.primitives + reach.primitives)).compile()
    states = table.run(np.array([0, 1, 1, 0, 0, 0, 2]))
    # soonest acceptance is at tick 6 all along, and only the other potential tells that the first primitive is done
    assert acceptance_potential([table], 0.5, 64.0)[states].tolist() == [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]
    ways_on = [2, 1, 4, 3, 2, 1]
    expected = [(done + 1 / (1 + d)) / 2 for done, d in zip([0, 0, 1, 1, 1, 1], ways_on, strict=True)]
    np.testing.assert_allclose(progress_potential([table])[states], [*expected, 1.0])
