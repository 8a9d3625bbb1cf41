from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.twins import CASE_STUDY, G, kleene, one, walk, words
from tests.strategies import sequential_conjunctions
from tickwise.automata import ticks
from tickwise.automata.build import build
from tickwise.automata.model import live_clocks
from tickwise.automata.ticks import compile_table, is_complete
from tickwise.errors import AutomatonError, ConfigurationError, DataError
from tickwise.logic.sdnf import Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Interval


def test_the_table_of_a_small_formula_by_hand():
    """F[1,2] p: wait at ticks 0 and 1, decide at the latest at tick 2."""
    table = build(one("F", 1, 2)).compile()
    # 0 the start; 1 waiting after tick 0; 2 waiting after tick 1; 3 accepted; 4 rejected
    np.testing.assert_array_equal(table.delta, [[1, 1], [2, 3], [4, 3], [3, 3], [4, 4]])
    np.testing.assert_array_equal(table.location, [0, 0, 0, 1, 2])
    np.testing.assert_array_equal(table.clocks[:, 0], [0, 0, 1, 0, 0])
    np.testing.assert_array_equal(table.verdict, [0, 0, 0, 1, -1])
    np.testing.assert_array_equal(table.stage, 0)
    assert (table.delta.dtype, table.location.dtype, table.verdict.dtype) == (np.int32, np.int16, np.int8)


def test_the_size_of_the_table_of_case_study_1_by_hand():
    """The start; q0 after ticks 0-14; q1 entered at 1-15, staying 0-3 ticks; q2 after 5-38; three sinks."""
    table = build(CASE_STUDY).compile()
    assert len(table) == 1 + 15 + 15 * 4 + 34 + 3
    assert np.bincount(table.location).tolist() == [1 + 15, 60, 34, 1, 1, 1]


@settings(max_examples=200)
@given(st.data())
def test_the_table_is_the_walk(data):
    conjunction = data.draw(sequential_conjunctions())
    automaton = build(conjunction)
    word = data.draw(words(conjunction))
    end = conjunction.primitives[-1].end
    horizon = end + data.draw(st.integers(0, 4))
    reduced, full = automaton.compile(), automaton.compile(horizon, reduce=False)
    small, large = reduced.run(np.array(word)), full.run(np.array(word))
    for tick, (location, valuation) in enumerate(walk(automaton, word)):
        u, w = small[tick], large[tick]
        assert reduced.location[u] == full.location[w] == location
        assert reduced.stage[u] == full.stage[w] == automaton.stages[location]
        assert reduced.verdict[u] == full.verdict[w] == kleene(conjunction, word[: tick + 1])
        assert full.clocks[w].tolist() == [min(value, horizon) for value in valuation]
        active = automaton.active[location]
        held = [min(value, end) if clock in active else 0 for clock, value in enumerate(valuation)]
        assert reduced.clocks[u].tolist() == held


@settings(max_examples=200)
@given(sequential_conjunctions(), st.booleans())
def test_states_are_different_reachable_pairs(conjunction, reduce):
    table = build(conjunction).compile(reduce=reduce)
    pairs = np.column_stack([table.location, table.clocks])[1:]
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    # breadth first: each state but the start is first reached from an earlier one
    reached, first = np.unique(table.delta.ravel(), return_index=True)
    assert reached.tolist() == list(range(1, len(table)))
    assert (np.diff(first) > 0).all()
    decided = np.flatnonzero(table.verdict)
    after = table.verdict[table.delta[decided]]
    assert (after == table.verdict[decided, None]).all()


@settings(max_examples=100)
@given(st.data())
def test_a_batch_runs_as_its_rows_do(data):
    conjunction = data.draw(sequential_conjunctions())
    table = build(conjunction).compile()
    rows = np.array([data.draw(words(conjunction)) for _ in range(3)])
    lengths = np.array([data.draw(st.integers(1, rows.shape[1])) for _ in range(3)])
    ended = np.where(np.arange(rows.shape[1]) < lengths[:, None], rows, -1)
    states = table.run(ended, lengths)
    for row, length, ours in zip(rows, lengths, states, strict=True):
        alone = table.run(row[:length])
        np.testing.assert_array_equal(ours[:length], alone)
        np.testing.assert_array_equal(ours[length:], alone[-1])
    np.testing.assert_array_equal(
        table.verdicts(ended, lengths),
        [kleene(conjunction, row[:length]) for row, length in zip(rows.tolist(), lengths, strict=True)],
    )


def test_the_papers_valuations_are_those_up_to_the_horizon():
    table = build(CASE_STUDY).compile(40, reduce=False)
    assert table.clocks.max(axis=0).tolist() == [40, 40]
    assert set(table.clocks[:, 0].tolist()) == set(range(41))


def test_many_states_need_a_search_with_more_room():
    conjunction = one("GF", 0, 60, 30)
    table = build(conjunction).compile(reduce=False)
    assert len(table) > 2000
    word = np.array([1] + [0] * 31 + [1] * 80)
    assert table.verdicts(word).tolist() == [kleene(conjunction, word.tolist())] == [-1]


def test_arrays_cannot_be_written():
    table = build(CASE_STUDY).compile()
    for array in (table.delta, table.location, table.clocks, table.stage, table.verdict):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_horizon_at_which_guards_differ_still_is_too_short():
    automaton = build(CASE_STUDY)
    with pytest.raises(ConfigurationError, match="horizon 20 is too short"):
        automaton.compile(20)
    assert len(automaton.compile(39)) == len(automaton.compile(1000)) == len(automaton.compile())


@settings(max_examples=200)
@given(st.data())
def test_a_horizon_is_refused_or_exact(data):
    conjunction = data.draw(sequential_conjunctions(most=2))
    automaton = build(conjunction)
    horizon = data.draw(st.integers(0, conjunction.primitives[-1].end))
    reduce = data.draw(st.booleans())
    try:
        table = automaton.compile(horizon, reduce=reduce)
    except ConfigurationError:
        return
    word = data.draw(words(conjunction))
    assert table.verdicts(np.array(word)).tolist() == [kleene(conjunction, word)]


@pytest.mark.parametrize("horizon", [-1, 40_000, True])
def test_a_horizon_out_of_range_is_refused(horizon):
    with pytest.raises(ConfigurationError, match="out of range"):
        build(CASE_STUDY).compile(horizon)


def test_too_many_states_are_refused(monkeypatch):
    monkeypatch.setattr(ticks, "MOST_ENTRIES", 512 * 4)
    assert len(build(CASE_STUDY).compile()) < 512
    with pytest.raises(ConfigurationError, match="more than 2048 entries, 4 letters"):
        build(CASE_STUDY).compile(reduce=False)


def test_too_many_predicates_are_refused():
    primitives = tuple(Primitive(Operator.EVENTUALLY, Interval(t, t), 0, G) for t in range(18))
    with pytest.raises(ConfigurationError, match="262144 letters"):
        build(SequentialConjunction(primitives)).compile()


def test_a_missing_edge_is_named():
    automaton = build(one("F", 1, 2))
    edges = automaton.edges[1:]  # without waiting on {}
    broken = replace(automaton, edges=edges, active=live_clocks(edges, 3))
    assert not is_complete(broken)
    with pytest.raises(AutomatonError, match=r"not complete: after 'q0' with c1=0 no edge .* on \{\}"):
        compile_table(broken)


@pytest.mark.parametrize(
    ("letters", "lengths", "message"),
    [
        ([0, 2, 0], None, "letter 2 at tick 1"),
        ([0, -1, 0], None, "letter -1 at tick 1"),
        ([0.5, 1.0], None, "whole numbers"),
        ([], None, "whole numbers"),
        ([[[0]]], None, "whole numbers"),
        ([[0, 1]], [3], "lengths"),
        ([[0, 1]], [0], "lengths"),
        ([[0, 1]], [1, 1], "lengths"),
    ],
)
def test_letters_and_lengths_are_checked(letters, lengths, message):
    table = build(one("F", 1, 2)).compile()
    with pytest.raises(DataError, match=message):
        table.run(np.array(letters), None if lengths is None else np.array(lengths))
