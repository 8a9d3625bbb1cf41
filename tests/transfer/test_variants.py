"""Transfer beyond Algorithm 2: when it is Algorithm 2, when it is the identity, and a slow twin of all switches."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.rl.twins import random_problem
from tests.strategies import predicates, sdnfs, transferable_pairs
from tests.transfer.test_qtransfer import place_ranks, recognisable, tables
from tickwise.automata.ticks import TickTable
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import AutomatonError, ConfigurationError, DataError
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import automaton_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.qtransfer import transfer_q
from tickwise.transfer.variants import Confidence, Transfer, transfer

SOURCE = "F[0,5] G[0,2] (1 <= x <= 2 & 1 <= y <= 2) & F[9,12] (3 <= x <= 4 & 0 <= y <= 2)"
TRUST = Confidence(most=4.0, visits=3.0, reach=2.0)

switches = st.builds(
    Transfer,
    visited=st.booleans(),
    within=st.sampled_from([0.0, 1.0, 2.5, math.inf]),
    progress=st.booleans(),
    travel=st.booleans(),
    confidence=st.sampled_from([None, TRUST]),
)


def problem(formula: SDNF | str, size: int, reduce: bool = True) -> Problem:
    """A world with a formula's extended states; transfer asks nothing of the task."""
    mdp = GridWorld(size).mdp()
    compiled = tables(formula) if isinstance(formula, str) else tick_tables(formula, 4, reduce=reduce)
    return Problem(mdp, random_problem(0).task, automaton_memory(mdp, compiled))


def algorithm_2(source: Problem, q: NDArray[np.float32], target: Problem) -> NDArray[np.float32]:
    return transfer_q(source.mdp, source.memory, q, target.mdp, target.memory, initial=-1.0)


@settings(max_examples=60, deadline=None)
@given(transferable_pairs(), st.integers(1, 3), st.integers(1, 3), st.booleans())
def test_without_switches_and_with_all_visited_it_is_algorithm_2(
    formulas: tuple[SDNF, SDNF], source_size: int, target_size: int, reduce: bool
):
    source, target = (
        problem(formula, size, reduce) for formula, size in zip(formulas, (source_size, target_size), strict=True)
    )
    q = recognisable(source.memory, source.mdp)
    expected = algorithm_2(source, q, target)
    everything = np.ones(q.shape, dtype=np.uint32)
    for how, visits in (
        (None, None),
        (Transfer(visited=True), everything),
        (Transfer(visited=True, within=0.0), 0 * everything),
    ):
        found = transfer(source, q, visits, target, -1.0, how)
        np.testing.assert_array_equal(found.q, expected)
        assert (found.confidence == 0).all()


@settings(max_examples=60, deadline=None)
@given(st.data(), st.integers(1, 3), st.integers(1, 3))
def test_with_the_same_windows_progress_is_algorithm_2(data: st.DataObject, source_size: int, target_size: int):
    formula = data.draw(sdnfs(most=2, disjuncts=2, longest=3))
    other = SDNF(
        tuple(
            SequentialConjunction(
                tuple(replace(each, predicate=data.draw(predicates())) for each in disjunct.primitives)
            )
            for disjunct in formula.disjuncts
        )
    )
    source, target = problem(formula, source_size), problem(other, target_size)
    q = recognisable(source.memory, source.mdp)
    found = transfer(source, q, None, target, -1.0, Transfer(progress=True))
    np.testing.assert_array_equal(found.q, algorithm_2(source, q, target))


@settings(max_examples=60, deadline=None)
@given(sdnfs(most=2, disjuncts=2, longest=3), st.integers(1, 3), switches)
def test_transfer_to_the_same_task_is_the_identity(formula: SDNF, size: int, how: Transfer):
    """But for the starts, in which nothing is learned; the confidence is that of distance 0."""
    same = problem(formula, size)
    q = recognisable(same.memory, same.mdp)
    visits = np.full(q.shape, 6, dtype=np.uint32)
    found = transfer(same, q, visits, same, -1.0, how)
    learned = np.ones(len(q), dtype=bool)
    learned[list(same.memory.offsets)] = False
    np.testing.assert_array_equal(found.q[learned], q[learned])
    # 6 visits of 3: two thirds of 4
    expected = np.float32(4 * 6 / 9 if how.confidence else 0)
    assert found.confidence[learned] == pytest.approx(expected)


@settings(max_examples=80, deadline=None)
@given(transferable_pairs(most=2, longest=3), st.integers(1, 3), st.integers(1, 3), switches, st.integers(0, 2**32 - 1))
def test_it_equals_its_twin(formulas: tuple[SDNF, SDNF], source_size: int, target_size: int, how: Transfer, seed: int):
    """With visits at random: of few entries, so that some locations have none, or of many."""
    source, target = problem(formulas[0], source_size), problem(formulas[1], target_size)
    rng = np.random.default_rng(seed)
    q = recognisable(source.memory, source.mdp)
    visits = np.where(rng.random(q.shape) < rng.random() ** 3, rng.integers(1, 20, q.shape), 0).astype(np.uint32)
    found = transfer(source, q, visits, target, -1.0, how)
    expected = np.full(found.q.shape, -1.0, dtype=np.float32)
    trust = np.zeros(found.q.shape)
    for entry, value, distance, count in slow_transfer(source, q, visits, target, how):
        expected[entry] = value
        if how.confidence is not None:
            trust[entry] = 4.0 * count / (count + 3.0) * 2.0 / (2.0 + distance)
    np.testing.assert_array_equal(found.q, expected)
    np.testing.assert_allclose(found.confidence, trust, rtol=1e-6)


Entry = tuple[int, int, int]


def slow_transfer(
    source: Problem, q: NDArray[np.float32], visits: NDArray[np.uint32], target: Problem, how: Transfer
) -> Iterator[tuple[Entry, float, float, int]]:
    """For each entry of the target its value, from how far that comes, and the source's visits of where it is from.

    Correspondence is by position, a world's states are four headings a cell, and one tick leads one cell far at most.
    """
    speed = 1.0 if target.mdp.n_cells > 1 else math.inf
    for i, table in enumerate(target.memory.tables):
        i_hat = i % len(source.memory.tables)
        origin, first = source.memory.tables[i_hat], source.memory.offsets[i_hat]
        for u in range(1, len(table)):
            j = int(table.stage[u])
            there = [v for v in range(1, len(origin)) if origin.location[v] == table.location[u]] or [0]
            aim = slow_progress(table, origin, u) if how.progress else [float(c) for c in table.clocks[u]]
            for s in range(target.mdp.n_states):
                ranks = place_ranks(source.mdp, origin, target.mdp, table, j, s)
                for action in range(q.shape[2]):

                    def seen(v: int, cell: int, s: int = s, action: int = action, first: int = first) -> bool:
                        return bool(visits[first + v, cell * 4 + s % 4, action])

                    def nearest(known: bool, aim: list[float] = aim, ranks=ranks, there=there, origin=origin):
                        pairs = [(r, v) for r in ranks for v in there if not known or seen(v, r[2])]
                        if not pairs:
                            return nearest(False)
                        rank = min(pairs)[0]
                        late = math.floor(round(math.sqrt(rank[0]) / speed, 9)) if how.travel else 0
                        apart = []
                        for r, v in pairs:
                            if r == rank:
                                clocks = [float(c) for c in origin.clocks[v]]
                                square = (clocks[0] - aim[0] - late) ** 2
                                square += sum((a - b) ** 2 for a, b in zip(clocks[1:], aim[1:], strict=True))
                                apart.append((round(square, 9), v))
                        square, v = min(apart)
                        return math.sqrt(rank[0] + square), v, rank[2]

                    distance, v, cell = nearest(False)
                    if how.visited:
                        other = nearest(True)
                        if not other[0] - distance > how.within:
                            distance, v, cell = other
                    where = (first + v, cell * 4 + s % 4, action)
                    yield (target.memory.offsets[i] + u, s, action), q[where], distance, int(visits[where])


def slow_progress(table: TickTable, origin: TickTable, u: int) -> list[float]:
    """The source's clock values that are as far as the target's."""
    automaton, j = table.automaton, int(table.stage[u])
    clocks = [float(c) for c in table.clocks[u]]
    if table.verdict[u]:
        return clocks
    own, other = (each.automaton.conjunction.primitives for each in (table, origin))
    if automaton.stages.index(j) == table.location[u]:
        return [as_far(clocks[0], own, other, j), *clocks[1:]]
    length = clocks[1] * other[j].duration / own[j].duration
    return [as_far(clocks[0] - clocks[1], own, other, j) + length, length]


def as_far(c: float, own: tuple[Primitive, ...], other: tuple[Primitive, ...], j: int) -> float:
    """A tick of the target's primitive as one of the source's."""
    begins = [0, 0] if j == 0 else [first_end(each[j - 1]) for each in (own, other)]
    (a, b), (a_other, b_other) = ((each[j].window.start, each[j].window.end) for each in (own, other))
    if c >= b:
        return b_other
    if c >= a:
        return a_other + (c - a) / (b - a) * (b_other - a_other)
    return begins[1] + (c - begins[0]) / (a - begins[0]) * (a_other - begins[1])


def first_end(primitive: Primitive) -> int:
    if primitive.operator is Operator.EVENTUALLY:
        return primitive.window.start
    if primitive.operator is Operator.EVENTUALLY_ALWAYS:
        return primitive.window.start + primitive.duration
    return primitive.window.end


def a_line(size: int) -> TabularMDP:
    """Cells 0 to size - 1 in a row; action 0 goes left, action 1 right."""
    cells = np.arange(size)
    after = np.clip(np.stack([cells - 1, cells + 1], axis=1), 0, size - 1)[:, :, None]
    return TabularMDP(
        after, np.ones(after.shape), np.full(size, 1 / size), cells, cells[:, None] + 0.5, ("x",), ((0.0, float(size)),)
    )


def on_a_line(text: str, size: int) -> Problem:
    return Problem(a_line(size), random_problem(0).task, automaton_memory(a_line(size), tables(text)))


def valuation(a_problem: Problem, clock: int) -> int:
    """The state of the only table that waits with a clock at a value."""
    (table,) = a_problem.memory.tables
    (u,) = np.flatnonzero((table.location == 0) & (table.clocks[:, 0] == clock) & (np.arange(len(table)) > 0))
    return int(u)


def test_travel_by_hand():
    """From the leftmost of 3 cells to the leftmost of 6, with the region at the right end: 3 cells farther off.

    Cell 1 of 6 is like cell 0 of 3 but 2 cells farther away: at tick 4, cell 0 at tick 6. What is at most as far off as
    the source's border stays as it was; at tick 9 it would be tick 11, but the last that waits is 9.
    """
    source, target = on_a_line("F[0,10] (2 <= x <= 3)", 3), on_a_line("F[0,10] (5 <= x <= 6)", 6)
    q = recognisable(source.memory, source.mdp)
    found = transfer(source, q, None, target, -1.0, Transfer(travel=True)).q
    for tick, cell, like_tick, like_cell in ((4, 1, 6, 0), (4, 0, 7, 0), (4, 3, 4, 0), (4, 5, 4, 2), (9, 1, 9, 0)):
        expected = q[valuation(source, like_tick), like_cell]
        np.testing.assert_array_equal(found[valuation(target, tick), cell], expected)


def test_visits_by_hand():
    """4 cells, the region at the right end: action 0 was tried in cell 0 at tick 1 and in cell 2 at ticks 3 and 7."""
    source = on_a_line("F[0,10] (3 <= x <= 4)", 4)
    q = recognisable(source.memory, source.mdp)
    visits = np.zeros(q.shape, dtype=np.uint32)
    for tick, cell in ((1, 0), (3, 2), (7, 2)):
        visits[valuation(source, tick), cell, 0] = 5
    found = transfer(source, q, visits, source, -1.0, Transfer(visited=True, confidence=Confidence(2.0, 5.0, 1.0)))
    for tick, cell, like_tick, like_cell in (
        (1, 0, 1, 0),
        (6, 0, 1, 0),
        (4, 2, 3, 2),
        (5, 2, 3, 2),
        (6, 2, 7, 2),
        (6, 3, 7, 2),
    ):
        here = (valuation(source, tick), cell, 0)
        assert found.q[here] == q[valuation(source, like_tick), like_cell, 0]
        # 5 visits are half of 2; a distance of d makes it 1 / (1 + d)
        assert found.confidence[here] == pytest.approx(1 / (1 + math.hypot(tick - like_tick, cell - like_cell)))
    # nobody ever tried action 1
    np.testing.assert_array_equal(found.q[1:, :, 1], q[1:, :, 1])
    assert (found.confidence[..., 1] == 0).all()
    near = transfer(source, q, visits, source, -1.0, Transfer(visited=True, within=2.0)).q
    assert near[valuation(source, 5), 2, 0] == q[valuation(source, 3), 2, 0]
    assert near[valuation(source, 6), 0, 0] == q[valuation(source, 6), 0, 0]


def test_given_landmarks_are_what_places_are_compared_relative_to():
    """With the target's landmark a cell to the right of the source's, everything is like the cell to its left."""
    same = on_a_line("F[0,10] (3 <= x <= 4)", 4)
    q = recognisable(same.memory, same.mdp)
    marks = ([np.array([[1.0]])], [np.array([[2.0]])])
    found = transfer(same, q, None, same, -1.0, landmarks=marks).q
    np.testing.assert_array_equal(found[1:, 1:], q[1:, :-1])


def test_what_it_refuses():
    source = on_a_line("F[0,10] (3 <= x <= 4)", 4)
    q = recognisable(source.memory, source.mdp)
    for how in (Transfer(visited=True), Transfer(confidence=Confidence())):
        with pytest.raises(DataError, match="give the visits"):
            transfer(source, q, None, source, 0.0, how)
    with pytest.raises(DataError, match="use the same"):
        transfer(source, q, np.zeros((2, 2, 2), dtype=np.uint32), source, 0.0)
    with pytest.raises(AutomatonError, match="isomorphic"):
        transfer(source, q, None, on_a_line("G[0,10] (3 <= x <= 4)", 4), 0.0)
    with pytest.raises(DataError, match="has shape"):
        transfer(source, q[:-1], None, source, 0.0)
    for within in (-1.0, math.nan):
        with pytest.raises(ConfigurationError, match="within is"):
            Transfer(within=within)
    for number in (0.0, math.inf):
        with pytest.raises(ConfigurationError, match="visits of a confidence"):
            Confidence(visits=number)
