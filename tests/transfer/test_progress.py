"""Clocks by their progress: by hand, and what leaves them as they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import equivalents, sequential_conjunctions
from tickwise.automata.build import build
from tickwise.automata.ticks import TickTable
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SequentialConjunction, to_sdnf
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.progress import progress_valuations


def table(text: str) -> TickTable:
    (found,) = tick_tables(to_sdnf(parse(text)), 40)
    return found


def moved(source: str, target: str, location: str) -> dict[tuple[int, ...], list[float]]:
    """For each valuation of a location the source's that is as far."""
    own = table(target)
    there = np.flatnonzero(own.location == own.automaton.locations.index(location))
    wanted = progress_valuations(table(source), own)
    return {tuple(own.clocks[u].tolist()): wanted[u].tolist() for u in there if u}


def test_before_a_window_and_in_it():
    """[4,8] is [2,12]: half of the way to 4 is half of the way to 2, and a quarter of a window a quarter."""
    found = moved("F[2,12] (x >= 1)", "F[4,8] (x >= 1)", "q0")
    assert found == {(c,): [v] for c, v in zip(range(8), (0.0, 0.5, 1.0, 1.5, 2.0, 4.5, 7.0, 9.5), strict=True)}


def test_the_way_to_a_later_window_begins_when_the_one_before_can_be_done_with():
    """◇[1,3] can be done with at tick 1, ◇[2,3] at tick 2: of the ways 1 to 5 and 2 to 10, 2 and 4 are a quarter."""
    found = moved("F[2,3] (x >= 1) & F[10,14] (x >= 2)", "F[1,3] (x >= 1) & F[5,7] (x >= 2)", "q1")
    assert found == {(1,): [2.0], (2,): [4.0], (3,): [6.0], (4,): [8.0], (5,): [10.0], (6,): [12.0]}


def test_a_stay_keeps_its_share_of_the_duration_and_the_tick_at_which_it_began():
    """From ◇[1,5]□[0,2] to ◇[2,10]□[0,4]: begun at 3, which is half of the window, is begun at 6; 1 of 2 is 2 of 4."""
    found = moved("F[2,10] G[0,4] (x >= 1)", "F[1,5] G[0,2] (x >= 1)", "q1")
    assert found[3, 0] == [6.0, 0.0]
    assert found[4, 1] == [8.0, 2.0]
    assert found[5, 0] == [10.0, 0.0]
    assert found[6, 1] == [12.0, 2.0]


def test_a_window_of_one_tick_is_its_source_s_end():
    """It is the last chance of a stay to begin; of the source's one tick, all is that tick."""
    assert moved("F[2,10] G[0,4] (x >= 1)", "F[3,3] G[0,2] (x >= 1)", "q1")[3, 0] == [10.0, 0.0]
    assert moved("F[3,3] G[0,2] (x >= 1)", "F[2,10] G[0,4] (x >= 1)", "q1")[6, 0] == [3.0, 0.0]


def test_a_verdict_leaves_the_clocks():
    assert set(map(tuple, moved("F[2,12] (x >= 1)", "F[4,8] (x >= 1)", "acc").values())) <= {(0.0,)}


@settings(max_examples=200)
@given(sequential_conjunctions(most=3), st.booleans())
def test_the_same_windows_leave_the_clocks(conjunction: SequentialConjunction, reduce: bool):
    one = build(conjunction).compile(reduce=reduce)
    np.testing.assert_allclose(progress_valuations(one, one), one.clocks, atol=1e-12)


@settings(max_examples=200)
@given(st.data())
def test_progress_stays_within_the_source_s_windows_and_in_order(data: st.DataObject):
    conjunction = data.draw(sequential_conjunctions(most=3))
    other = data.draw(equivalents(conjunction, longest=6))
    target, source = (build(each).compile() for each in (conjunction, other))
    wanted = progress_valuations(source, target)
    for location, stage in enumerate(target.automaton.stages[: -1 - len(conjunction.primitives)]):
        there = np.flatnonzero(target.location == location)
        window, duration = other.primitives[stage].window, other.primitives[stage].duration
        assert (wanted[there, 0] <= window.end + duration + 1e-9).all()
        if target.automaton.stages.index(stage) == location:
            order = np.argsort(target.clocks[there, 0], kind="stable")
            assert (np.diff(wanted[there, 0][order]) >= -1e-9).all()
        else:
            begun = wanted[there, 0] - wanted[there, 1]
            assert ((begun >= window.start - 1e-9) & (begun <= window.end + 1e-9)).all()
            assert wanted[there, 1] == pytest.approx(
                target.clocks[there, 1] / conjunction.primitives[stage].duration * duration
            )
