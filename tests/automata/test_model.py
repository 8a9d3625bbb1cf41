from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from itertools import combinations, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.twins import CASE_STUDY, COMPARE, Y, one
from tickwise.automata.build import build
from tickwise.automata.model import (
    COMPARISONS,
    UNBOUNDED,
    ClockConstraint,
    Edge,
    TimedAutomaton,
    letter_text,
    live_clocks,
)
from tickwise.errors import AutomatonError, ConfigurationError, TickwiseError
from tickwise.logic.syntax import Verdict

AUTOMATON = build(CASE_STUDY)
SMALL = build(one("F", 1, 2))


@pytest.mark.parametrize("comparison", COMPARISONS)
def test_a_constraint_is_the_range_of_its_values(comparison):
    for value in range(4):
        constraint = ClockConstraint(0, comparison, value)
        low, high = constraint.interval
        satisfied = [COMPARE[comparison](v, value) for v in range(10)]
        assert satisfied == [low <= v <= high for v in range(10)]
        assert len(set(satisfied[constraint.ceiling :])) == 1
        assert high in (value - 1, value, UNBOUNDED)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, "==", 1), "comparison '==' is unknown"),
        ((-1, "<", 1), "clock -1 is out of range"),
        ((0, "<", -2), "constant of a clock constraint -2"),
        ((0, "<", 1.5), "constant of a clock constraint 1.5"),
        ((True, "<", 1), "clock True"),
    ],
)
def test_constraints_are_checked(arguments, message):
    with pytest.raises(AutomatonError, match=message):
        ClockConstraint(*arguments)


def test_an_edge_may_not_name_a_predicate_twice():
    with pytest.raises(AutomatonError, match="names predicate 1 twice"):
        Edge(0, ((1, True), (0, True), (1, False)), 0)


def test_letters_are_the_subsets_that_fit_the_literals():
    edge = Edge(0, ((1, True),), 0)
    assert AUTOMATON.letters(edge) == (0b10, 0b11)
    assert AUTOMATON.letters(Edge(0, ((0, False), (1, True)), 0)) == (0b10,)
    assert AUTOMATON.letters(Edge(0, (), 0)) == (0, 1, 2, 3)
    assert AUTOMATON.letters_count == 4
    assert [letter_text(letter, 2) for letter in range(4)] == ["{}", "{ρ1}", "{ρ2}", "{ρ1, ρ2}"]


LITERALS = st.lists(st.tuples(st.integers(0, 2), st.booleans()), max_size=2, unique_by=lambda pair: pair[0])
GUARDS = st.lists(
    st.builds(ClockConstraint, st.integers(0, 1), st.sampled_from(COMPARISONS), st.integers(0, 3)), max_size=3
)
EDGES = st.builds(
    Edge,
    st.integers(0, 1),
    LITERALS.map(tuple),
    st.integers(0, 1),
    GUARDS.map(tuple),
    st.frozensets(st.integers(0, 1)),
)


def an_automaton(edges: tuple[Edge, ...]) -> TimedAutomaton:
    """Two working locations, two clocks and three predicates."""
    parts = (replace(CASE_STUDY.primitives[0], predicate=Y), *CASE_STUDY.primitives[1:])
    third = replace(CASE_STUDY.primitives[1], window=type(parts[1].window)(50, 60))
    conjunction = replace(CASE_STUDY, primitives=(*parts, third))
    predicates = tuple(primitive.predicate for primitive in conjunction.primitives)
    active = (frozenset({0, 1}),) * 2
    nothing: frozenset[int] = frozenset()
    return TimedAutomaton(predicates, ("a", "b"), 0, ("c1", "c2"), nothing, nothing, edges, (0, 0), active, conjunction)


@settings(max_examples=300)
@given(st.lists(EDGES, min_size=2, max_size=3).map(tuple))
def test_determinism_is_decided_exactly(edges):
    """Constants are at most 3, so that valuations up to 4 show every difference."""
    clash = any(
        first.source == second.source and first.enabled(letter, valuation) and second.enabled(letter, valuation)
        for first, second in combinations(edges, 2)
        for letter in range(8)
        for valuation in product(range(5), repeat=2)
    )
    if clash:
        with pytest.raises(AutomatonError, match="not deterministic: two edges of"):
            an_automaton(edges)
    else:
        assert an_automaton(edges).edges == edges


@settings(max_examples=300)
@given(st.lists(EDGES, max_size=4).map(tuple))
def test_a_clock_is_live_where_a_path_reads_it_before_a_reset(edges):
    live = live_clocks(edges, 2)
    for location, clock in product(range(2), range(2)):
        seen, todo, read = set(), [location], False
        while todo:
            place = todo.pop()
            seen.add(place)
            for edge in edges:
                if edge.source == place:
                    read = read or any(atom.clock == clock for atom in edge.guard)
                    if clock not in edge.resets and edge.target not in seen:
                        todo.append(edge.target)
        assert (clock in live[location]) == read


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"predicates": (Y,)}, "predicates are not the conjunction's"),
        ({"locations": ("q0", "acc", "acc")}, "two locations are called 'acc'"),
        ({"locations": ("q0", "", "rej1")}, "location name ''"),
        ({"clocks": ("c1", "c1")}, "two clocks are called 'c1'"),
        ({"initial": 3}, "initial location 3 is out of range"),
        ({"accepting": frozenset({7})}, "accepting or rejecting location 7"),
        ({"accepting": frozenset({1, 2})}, "'rej1' is both accepting and rejecting"),
        ({"stages": (0, 0)}, "3 locations, but 2 stages and 3 sets"),
        ({"stages": (0, 1, 0)}, "stage 1 is out of range"),
        ({"active": (frozenset({3}),) * 3}, "active clock 3 is out of range"),
        ({"active": (frozenset(),) * 3}, "clock 'c1' matters in 'q0' but is not active"),
        ({"edges": (Edge(9, (), 0),)}, "source location of edge 0 9 is out of range"),
        ({"edges": (Edge(0, (), -1),)}, "target location of edge 0 -1"),
        ({"edges": (Edge(0, ((1, True),), 0),)}, "predicate of edge 0 1"),
        ({"edges": (Edge(0, (), 0, (ClockConstraint(1, "<", 1),)),)}, "clock of edge 0 1"),
        ({"edges": (Edge(0, (), 0, (), frozenset({2})),)}, "clock of edge 0 2"),
        ({"edges": (Edge(1, (), 0),)}, "edge 0 leaves 'acc'"),
        ({"edges": (Edge(0, (), 0), Edge(0, ((0, True),), 1))}, "not deterministic: two edges of 'q0'"),
    ],
)
def test_a_malformed_automaton_names_the_culprit(changes, message):
    with pytest.raises(AutomatonError, match=message) as caught:
        replace(SMALL, **changes)
    assert isinstance(caught.value, TickwiseError)
    assert isinstance(caught.value, ValueError)
    assert "\n" not in str(caught.value)


def test_unreachable_locations_are_no_error():
    replace(SMALL, edges=(Edge(0, (), 0),))


def test_automata_are_frozen_values():
    assert build(CASE_STUDY) == AUTOMATON
    assert hash(build(CASE_STUDY)) == hash(AUTOMATON)
    with pytest.raises(FrozenInstanceError):
        AUTOMATON.initial = 1  # type: ignore[misc]


def test_the_outcome_of_locations():
    outcomes = [AUTOMATON.outcome(location) for location in range(6)]
    assert outcomes == [Verdict.UNKNOWN] * 3 + [Verdict.TRUE] + [Verdict.FALSE] * 2


def test_the_listing_is_readable():
    assert str(SMALL).splitlines() == [
        f"timed automaton of {SMALL.conjunction}",
        f"ρ1 = {SMALL.predicates[0]}",
        "q0 (stage 1, initial)",
        "  ¬ρ1, c1 < 2 → q0",
        "  ρ1, c1 < 1 → q0",
        "  ρ1, c1 >= 1, c1 <= 2 → acc",
        "  ¬ρ1, c1 >= 2 → rej1",
        "acc (stage 1, accepting)",
        "  any letter → acc",
        "rej1 (stage 1, rejecting)",
        "  any letter → rej1",
    ]
    assert "  ρ1, c1 >= 1 → q1, c2 := 0" in str(AUTOMATON).splitlines()


def test_an_unknown_format_lists_those_there_are():
    with pytest.raises(ConfigurationError, match="'png' is unknown; use one of dot, json, mermaid"):
        AUTOMATON.to("png")
