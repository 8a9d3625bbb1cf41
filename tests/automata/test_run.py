from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.twins import CASE_STUDY, kleene, one, walk, words
from tests.strategies import VARIABLES, batches, sequential_conjunctions, trajectories
from tickwise.automata.build import build
from tickwise.automata.model import live_clocks
from tickwise.automata.run import EdgeStep, FlowStep, TimedWord, letters_of, run, run_on, timed_word
from tickwise.errors import AutomatonError, DataError
from tickwise.logic.semantics import holds


@given(st.lists(st.integers(0, 3), min_size=1, max_size=30))
def test_the_timed_word_has_the_first_tick_the_changes_and_the_last_tick(letters):
    word = timed_word(letters)
    assert list(word.letters) == letters
    (_, first), *rest = word.symbols
    last = len(letters) - 1
    assert first == 0
    assert word.symbols[-1][1] == last
    assert {tick for _, tick in rest} - {last} == {
        tick for tick in range(1, last) if letters[tick] != letters[tick - 1]
    }


def test_a_timed_word_by_hand():
    assert timed_word([0, 0, 1, 1, 1]).symbols == ((0, 0), (1, 2), (1, 4))
    assert timed_word([2, 0]).symbols == ((2, 0), (0, 1))
    assert timed_word(np.array([3])).symbols == ((3, 0),)


@pytest.mark.parametrize("symbols", [(), ((0, 1),), ((0, 0), (1, 0))])
def test_a_timed_words_ticks_increase_from_0(symbols):
    with pytest.raises(DataError, match="must increase from 0"):
        TimedWord(symbols)
    with pytest.raises(DataError, match="must increase"):
        timed_word([])


@settings(max_examples=100)
@given(sequential_conjunctions(), batches())
def test_a_letter_has_the_bits_of_the_predicates_that_hold(conjunction, batch):
    values, lengths = batch
    automaton = build(conjunction)
    letters = letters_of(automaton, values, variables=VARIABLES, lengths=lengths)
    for row, length, ours in zip(values, lengths, letters, strict=True):
        for j, primitive in enumerate(conjunction.primitives):
            expected = holds(primitive.predicate, row[:length], VARIABLES)
            np.testing.assert_array_equal(ours[:length] >> j & 1, expected)
        assert (ours[length:] == -1).all()
        alone = letters_of(automaton, row[:length], variables=VARIABLES)
        np.testing.assert_array_equal(alone, ours[:length])


def test_malformed_trajectories_are_refused():
    automaton = build(CASE_STUDY)
    with pytest.raises(DataError, match="NaN"):
        letters_of(automaton, np.full((3, 2), np.nan))
    with pytest.raises(DataError, match="batch of 2"):
        run(automaton, np.zeros((2, 3, 2)))


@settings(max_examples=200)
@given(st.data())
def test_a_run_is_the_walk_step_by_step(data):
    conjunction = data.draw(sequential_conjunctions())
    automaton = build(conjunction)
    word = data.draw(words(conjunction))
    trace = run_on(automaton, word)
    edges, flows = trace.steps[::2], trace.steps[1::2]
    assert all(isinstance(step, EdgeStep) for step in edges)
    assert all(isinstance(step, FlowStep) for step in flows)
    assert [(step.target, step.after) for step in edges] == walk(automaton, word)
    assert [step.letter for step in edges] == word
    assert [step.tick for step in edges] == list(range(len(word)))
    assert (edges[0].source, set(edges[0].before)) == (automaton.initial, {0})
    for edge, flow, after in zip(edges, flows, edges[1:], strict=False):
        assert (flow.location, flow.before) == (edge.target, edge.after)
        assert flow.after == tuple(value + 1 for value in flow.before)
        assert (flow.location, flow.after) == (after.source, after.before)
    assert trace.verdict == kleene(conjunction, word)


@settings(max_examples=100)
@given(sequential_conjunctions(), trajectories())
def test_the_run_on_a_trajectory_ends_in_its_verdict(conjunction, values):
    automaton = build(conjunction)
    assert run(automaton, values, variables=VARIABLES).verdict == automaton.verdict(values, variables=VARIABLES)


def test_a_run_prints_one_step_a_line():
    automaton = build(one("FG", 1, 3, 1))
    assert str(run_on(automaton, [0, 1, 1])).splitlines() == [
        "0: (q0, c1=0, c2=0) --{}--> (q0, c1=0, c2=0)",
        "0: (q0, c1=0, c2=0) ~1~> (q0, c1=1, c2=1)",
        "1: (q0, c1=1, c2=1) --{ρ1}--> (q1, c1=1, c2=0)",
        "1: (q1, c1=1, c2=0) ~1~> (q1, c1=2, c2=1)",
        "2: (q1, c1=2, c2=1) --{ρ1}--> (acc, c1=2, c2=1)",
    ]


def test_a_run_that_gets_stuck_says_where():
    automaton = build(one("F", 1, 2))
    edges = automaton.edges[1:]
    stuck = replace(automaton, edges=edges, active=live_clocks(edges, 3))
    with pytest.raises(AutomatonError, match=r"no edge of 'q0' can be taken at tick 1 on \{\}"):
        run_on(stuck, [1, 0])
