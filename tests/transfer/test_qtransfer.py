from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import equivalents, sequential_conjunctions, transferable_pairs
from tickwise.automata.build import build
from tickwise.automata.mapping import bijections
from tickwise.automata.ticks import TickTable
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import AutomatonError, DataError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Primitive, to_sdnf
from tickwise.rl.states import Memory, automaton_memory, tau_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.qtransfer import similar_states, similar_valuations, transfer_q

SOURCE = "F[0,5] G[0,2] (1 <= x <= 2 & 1 <= y <= 2) & F[9,12] (3 <= x <= 4 & 0 <= y <= 2)"
TARGET = "F[1,6] G[0,3] (3 <= x <= 4 & 3 <= y <= 4) & F[11,14] (0 <= x <= 2 & 4 <= y <= 5)"


def tables(text: str, horizon: int = 14) -> tuple[TickTable, ...]:
    return tick_tables(to_sdnf(parse(text)), horizon)


def memories(source: str, target: str, sizes: tuple[int, int]) -> tuple[TabularMDP, Memory, TabularMDP, Memory]:
    worlds = [GridWorld(size).mdp() for size in sizes]
    return (
        worlds[0], automaton_memory(worlds[0], tables(source)),
        worlds[1], automaton_memory(worlds[1], tables(target)),
    )  # fmt: skip


def recognisable(memory: Memory, mdp: TabularMDP) -> np.ndarray:
    """A Q-table in which every entry tells its own place."""
    shape = (memory.n_states, mdp.n_states, mdp.n_actions)
    return np.arange(np.prod(shape), dtype=np.float32).reshape(shape)


def place_ranks(
    source_mdp: TabularMDP, origin: TickTable, target_mdp: TabularMDP, table: TickTable, j: int, s: int
) -> list[tuple[float, bool, int]]:
    """The source's cells in the order of how alike they are: squared distance, whether truth differs, number."""
    rho, own = (each.automaton.conjunction.primitives[j] for each in (origin, table))
    here = target_mdp.coordinates[s]
    relative = here - own.box.centroid(target_mdp.variables, target_mdp.limits)
    centroid = rho.box.centroid(source_mdp.variables, source_mdp.limits)
    ranks = []
    for cell, there in enumerate(source_mdp.cell_coordinates):
        distance = round(float(np.sum((there - centroid - relative) ** 2)), 9)
        differs = contains(rho, source_mdp.variables, there) != contains(own, target_mdp.variables, here)
        ranks.append((distance, differs, cell))
    return sorted(ranks)


def algorithm_2(
    source_mdp: TabularMDP, source_memory: Memory, q: np.ndarray, target_mdp: TabularMDP, target_memory: Memory
) -> Iterator[tuple[int, int, np.ndarray]]:
    """Algorithm 2, line by line: a target memory state, a target state, and the values of all actions there.

    Correspondence is by position, and a world's states are four headings a cell.
    """
    for i, target in enumerate(target_memory.tables):  # line 2; i counts from 0, so that i mod m is right
        i_hat = i % len(source_memory.tables)  # line 4
        source = source_memory.tables[i_hat]

        @cache
        def similar_state(j: int, s: int, tables: tuple[TickTable, TickTable] = (source, target)) -> int:  # line 6
            return place_ranks(source_mdp, tables[0], target_mdp, tables[1], j, s)[0][2] * 4 + s % 4

        for u in range(1, len(target)):
            j = int(target.stage[u])  # line 3, and by position line 5
            there = [v for v in range(1, len(source)) if source.location[v] == target.location[u]]  # line 7
            apart = [  # lines 8 to 11
                (sum((int(a) - int(b)) ** 2 for a, b in zip(source.clocks[v], target.clocks[u], strict=True)), v)
                for v in there or [0]
            ]
            for s in range(target_mdp.n_states):  # line 12
                values = q[source_memory.offsets[i_hat] + min(apart)[1], similar_state(j, s)]
                yield target_memory.offsets[i] + u, s, values


def contains(rho: Primitive, variables: tuple[str, ...], point: np.ndarray) -> bool:
    """Whether a primitive's predicate holds at a point."""
    inside = True
    for bound in rho.box.bounds:
        value = point[variables.index(bound.variable)]
        above = value > bound.lower or (value == bound.lower and not bound.lower_strict)
        inside &= above and (value < bound.upper or (value == bound.upper and not bound.upper_strict))
    return inside != rho.complemented


@settings(max_examples=100)
@given(transferable_pairs(), st.integers(1, 4), st.integers(1, 4), st.booleans())
def test_transfer_is_algorithm_2(formulas: tuple[SDNF, SDNF], source_size: int, target_size: int, reduce: bool):
    """Every operator, complements, disjunctions of one to six, clocks of different range, worlds of any two sizes."""
    source_mdp, target_mdp = GridWorld(source_size).mdp(), GridWorld(target_size).mdp()
    source_memory, target_memory = (
        automaton_memory(mdp, tick_tables(formula, 4, reduce=reduce))
        for mdp, formula in zip((source_mdp, target_mdp), formulas, strict=True)
    )
    q = recognisable(source_memory, source_mdp)
    found = transfer_q(source_mdp, source_memory, q, target_mdp, target_memory, initial=-1.0)
    assert found.shape == (target_memory.n_states, target_mdp.n_states, 3)
    assert found.dtype == np.float32
    expected = np.full(found.shape, -1.0, dtype=np.float32)
    for u, s, values in algorithm_2(source_mdp, source_memory, q, target_mdp, target_memory):
        expected[u, s] = values
    np.testing.assert_array_equal(found, expected)


def test_transfer_to_the_same_task_is_the_identity():
    mdp, memory, *_ = memories(SOURCE, SOURCE, (4, 4))
    q = recognisable(memory, mdp)
    found = transfer_q(mdp, memory, q, mdp, memory, initial=0.0)
    assert (found[1:] == q[1:]).all()


@settings(max_examples=100)
@given(st.data(), st.booleans())
def test_every_clock_gets_its_nearest_value_wherever_these_occur_together(data: st.DataObject, reduce: bool):
    """Line 10 to the letter; where they never occur together the location is still ξ_Q's."""
    conjunction = data.draw(sequential_conjunctions(most=2))
    source, target = (
        build(one).compile(reduce=reduce) for one in (conjunction, data.draw(equivalents(conjunction, longest=6)))
    )
    xi = bijections(target.automaton, source.automaton)
    similar = similar_valuations(source, target, xi)
    for u in range(1, len(target)):
        there = [v for v in range(1, len(source)) if source.location[v] == xi.locations[target.location[u]]]
        if not there:  # the source leaves its first location with the first letter
            assert similar[u] == 0
            continue
        assert similar[u] in there
        apart = np.abs(source.clocks[there][:, xi.clocks].astype(int) - target.clocks[u].astype(int))
        if (apart == apart.min(axis=0)).all(axis=1).any():
            assert (apart[there.index(similar[u])] == apart.min(axis=0)).all()


def test_similar_states_keep_the_heading_and_prefer_a_state_that_agrees_on_the_predicate():
    source = to_sdnf(parse("F[0,5] (3 <= x <= 4 & 3 <= y <= 5)")).disjuncts[0].primitives[0]
    target = to_sdnf(parse("F[0,5] (5 <= x <= 6 & 6 <= y <= 7)")).disjuncts[0].primitives[0]
    world = GridWorld(9)
    mdp = world.mdp()
    centres = [each.box.centroid(mdp.variables, mdp.limits) for each in (source, target)]
    similar = similar_states(mdp, source.predicate, centres[0], mdp, target.predicate, centres[1])
    # centroids (3.5, 4) and (5.5, 6.5): a target cell lies half a cell between two source cells, and the one that is
    # in the region iff the target cell is in its own is taken
    for heading in range(4):
        assert similar[world.state(5, 6, heading)] == world.state(3, 3, heading)
        assert similar[world.state(5, 7, heading)] == world.state(3, 5, heading)
        assert similar[world.state(5, 5, heading)] == world.state(3, 2, heading)
        # beyond the source's border the nearest cell is the last one
        assert similar[world.state(0, 6, heading)] == world.state(0, 3, heading)


def test_similar_valuations_take_the_nearest_clock_values():
    (source,), (target,) = tables("F[1,15] G[0,4] (x >= 1)", 40), tables("F[5,18] G[0,5] (x >= 1)", 40)
    similar = similar_valuations(source, target, bijections(target.automaton, source.automaton))
    staying = target.automaton.locations.index("q1")
    for u in range(1, len(target)):
        v = similar[u]
        assert source.location[v] == target.location[u]
        clock, stay = (int(value) for value in target.clocks[u])
        if target.location[u] == staying and 1 <= clock - stay <= 15 and stay <= 3:
            assert source.clocks[v].tolist() == [clock, stay]
        if target.location[u] == 0 and not target.verdict[u]:
            assert source.clocks[v][0] == min(clock, 14)  # at 15 the window ends


def test_transfer_needs_structurally_equivalent_conjunctions():
    source_mdp, source_memory, target_mdp, target_memory = memories(SOURCE, "F[0,5] (x >= 3)", (4, 5))
    q = recognisable(source_memory, source_mdp)
    with pytest.raises(AutomatonError, match="isomorphic"):
        transfer_q(source_mdp, source_memory, q, target_mdp, target_memory, initial=0.0)


def test_transfer_needs_a_whole_number_of_copies():
    """Two or three disjuncts of the source's make no target, even where each one has its like in the source."""
    one, two = "G[0,3] (x >= 1)", "F[0,3] (x >= 1)"
    for source, target in ((f"{one} | {two}", one), (f"{one} | {two}", f"{one} | {two} | {one}")):
        source_mdp, source_memory, target_mdp, target_memory = memories(source, target, (2, 3))
        q = recognisable(source_memory, source_mdp)
        with pytest.raises(AutomatonError, match="not structurally transferable"):
            transfer_q(source_mdp, source_memory, q, target_mdp, target_memory, initial=0.0)


def test_transfer_needs_worlds_with_as_many_coordinates():
    mdp, memory, *_ = memories(SOURCE, SOURCE, (4, 4))
    line = TabularMDP(
        mdp.successor, mdp.probability, mdp.initial, mdp.cell, mdp.cell_coordinates[:, :1], ("x",), ((0.0, 4.0),)
    )
    onto = automaton_memory(line, tables("F[0,5] G[0,2] (x >= 1) & F[9,12] (x <= 2)"))
    with pytest.raises(DataError, match="2 coordinates and the target's 1"):
        transfer_q(mdp, memory, recognisable(memory, mdp), line, onto, initial=0.0)


def test_transfer_refuses_what_is_no_extended_q_function():
    mdp, memory, *_ = memories(SOURCE, SOURCE, (4, 4))
    q = recognisable(memory, mdp)
    with pytest.raises(DataError, match="timed automata"):
        transfer_q(mdp, tau_memory(mdp, 2), q, mdp, memory, initial=0.0)
    with pytest.raises(DataError, match="has shape"):
        transfer_q(mdp, memory, q[:-1], mdp, memory, initial=0.0)
