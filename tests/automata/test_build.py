from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.twins import CASE_STUDY, kleene, one, walk, words
from tests.strategies import VARIABLES, batches, primitives, sdnfs, sequential_conjunctions, trajectories
from tickwise.automata.build import build, timed_automata
from tickwise.automata.model import ClockConstraint, Edge
from tickwise.automata.ticks import is_complete
from tickwise.logic import semantics
from tickwise.logic.sdnf import Primitive, SequentialConjunction
from tickwise.logic.syntax import Interval, Verdict

C1, C2 = 0, 1


def less(clock, value):
    return ClockConstraint(clock, "<", value)


def from_(clock, value):
    return ClockConstraint(clock, ">=", value)


def test_the_automaton_of_case_study_1_written_by_hand():
    """Fig. 4 (a): wait for G, stay in G, reach Y, done; and, not in the figure, a sink a primitive."""
    q0, q1, q2, acc, rej1, rej2 = range(6)
    not_g, g, not_y, y = ((0, False),), ((0, True),), ((1, False),), ((1, True),)
    automaton = build(CASE_STUDY)
    assert automaton.locations == ("q0", "q1", "q2", "acc", "rej1", "rej2")
    assert automaton.clocks == ("c1", "c2")
    assert automaton.initial == q0
    assert automaton.accepting == {acc}
    assert automaton.rejecting == {rej1, rej2}
    assert automaton.stages == (0, 0, 1, 1, 0, 1)
    assert automaton.active == ({C1}, {C1, C2}, {C1}, set(), set(), set())
    assert automaton.predicates == tuple(primitive.predicate for primitive in CASE_STUDY.primitives)
    assert set(automaton.edges) == {
        Edge(q0, not_g, q0, (less(C1, 15),)),
        Edge(q0, g, q0, (less(C1, 1),)),
        Edge(q0, g, q1, (from_(C1, 1),), frozenset({C2})),
        Edge(q0, not_g, rej1, (from_(C1, 15),)),
        Edge(q1, g, q1, (less(C2, 4),)),
        Edge(q1, g, q2, (from_(C2, 4),)),
        Edge(q1, not_g, q0, (less(C1, 15),)),
        Edge(q1, not_g, rej1, (from_(C1, 15),)),
        Edge(q2, not_y, q2, (less(C1, 39),)),
        Edge(q2, y, q2, (less(C1, 21),)),
        Edge(q2, y, acc, (from_(C1, 21), ClockConstraint(C1, "<=", 39))),
        Edge(q2, not_y, rej2, (from_(C1, 39),)),
        *(Edge(sink, (), sink) for sink in (acc, rej1, rej2)),
    }
    assert len(automaton.edges) == 15


@pytest.mark.parametrize(("kind", "clocks"), [("F", 1), ("G", 1), ("FG", 2), ("GF", 2)])
def test_every_word_of_every_small_primitive_gets_the_verdict_as_early_as_it_is_determined(kind, clocks):
    durations = (1, 2) if clocks == 2 else (0,)
    for start, width, duration in product(range(3), range(3), durations):
        conjunction = one(kind, start, start + width, duration)
        automaton = build(conjunction)
        assert len(automaton.clocks) == clocks
        for word in product((0, 1), repeat=conjunction.primitives[0].end + 2):
            for tick, (location, _) in enumerate(walk(automaton, word)):
                assert automaton.outcome(location) == kleene(conjunction, word[: tick + 1])


@settings(max_examples=300)
@given(st.data())
def test_the_verdict_is_kleenes_at_every_prefix(data):
    conjunction = data.draw(sequential_conjunctions(most=3))
    automaton = build(conjunction)
    word = data.draw(words(conjunction))
    for tick, (location, _) in enumerate(walk(automaton, word)):
        assert automaton.outcome(location) == kleene(conjunction, word[: tick + 1])


@settings(max_examples=300)
@given(sequential_conjunctions(most=3), trajectories(longest=30))
def test_the_verdict_is_the_semantics_at_every_prefix(conjunction, values):
    automaton, formula = build(conjunction), conjunction.formula
    ticks = len(values)
    batch, lengths = np.repeat(values[None], ticks, axis=0), np.arange(1, ticks + 1)
    expected = semantics.verdict(formula, batch, variables=VARIABLES, lengths=lengths)
    np.testing.assert_array_equal(automaton.verdict(batch, variables=VARIABLES, lengths=lengths), expected)


@settings(max_examples=200)
@given(sdnfs(), batches(most=8, longest=30))
def test_a_formula_is_the_best_of_its_automata(phi, batch):
    """Kleene's or of the disjuncts' verdicts, which is their greatest, on trajectories that may end early."""
    values, lengths = batch
    ragged = {"variables": VARIABLES, "lengths": lengths}
    automata = timed_automata(phi)
    assert [automaton.conjunction for automaton in automata] == list(phi.disjuncts)
    verdicts = [automaton.verdict(values, **ragged) for automaton in automata]
    for disjunct, ours in zip(phi.disjuncts, verdicts, strict=True):
        np.testing.assert_array_equal(ours, semantics.verdict(disjunct.formula, values, **ragged))
    np.testing.assert_array_equal(np.max(verdicts, axis=0), semantics.verdict(phi.formula, values, **ragged))


@settings(max_examples=150)
@given(primitives(), batches(longest=15))
def test_the_automaton_of_a_negation_says_the_opposite(primitive, batch):
    values, lengths = batch
    ours, negated = (
        build(SequentialConjunction((one,))).verdict(values, variables=VARIABLES, lengths=lengths)
        for one in (primitive, primitive.negation)
    )
    np.testing.assert_array_equal(negated, -ours)


def test_a_formula_that_is_not_in_normal_form_is_brought_there():
    formula = CASE_STUDY.formula
    assert timed_automata(formula) == (build(CASE_STUDY),)


@settings(max_examples=200)
@given(sequential_conjunctions(most=3))
def test_every_automaton_is_complete_and_its_clocks_are_as_few_as_can_be(conjunction):
    automaton = build(conjunction)  # which is deterministic, or would not be there
    assert is_complete(automaton)
    assert len(automaton.clocks) == 1 + any(primitive.operator.nested for primitive in conjunction.primitives)
    assert len(automaton.accepting) == 1
    assert len(automaton.rejecting) == len(conjunction.primitives)


@settings(max_examples=200)
@given(sequential_conjunctions(most=3), st.integers(0, 9), st.integers(0, 5))
def test_the_numbers_change_only_the_constants(conjunction, shift, stretch):
    primitives = []
    for j, primitive in enumerate(conjunction.primitives):
        offset = shift + (j + 1) * 2 * stretch
        window = Interval(primitive.start + offset, primitive.window.end + offset + stretch)
        duration = primitive.duration + stretch if primitive.duration else 0
        primitives.append(Primitive(primitive.operator, window, duration, primitive.predicate))
    other = build(SequentialConjunction(tuple(primitives)))
    ours = build(conjunction)
    assert (ours.locations, ours.clocks, ours.stages) == (other.locations, other.clocks, other.stages)
    assert ours.active == other.active
    assert len(ours.edges) == len(other.edges)
    for one_edge, two in zip(ours.edges, other.edges, strict=True):
        assert (one_edge.source, one_edge.literals, one_edge.target) == (two.source, two.literals, two.target)
        shapes = [[(atom.clock, atom.comparison) for atom in edge.guard] for edge in (one_edge, two)]
        assert shapes[0] == shapes[1]


def test_accepting_is_what_the_weak_view_is_not():
    automaton = build(CASE_STUDY)
    stay = np.full((12, 2), 3.0)
    assert automaton.verdict(stay) is Verdict.UNKNOWN
    assert automaton.accepts(stay) is False
    goal = np.array([[7.0, 5.0]])
    assert automaton.accepts(np.concatenate([stay, np.repeat(goal, 28, axis=0)])) is True
    np.testing.assert_array_equal(automaton.accepts([stay, stay[:3]]), [False, False])
