from __future__ import annotations

import itertools

import numpy as np
import pytest

from tickwise.automata.mapping import bijections
from tickwise.automata.ticks import TickTable
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import AutomatonError, DataError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
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


def slow_transfer(source: str, target: str, sizes: tuple[int, int], q: np.ndarray) -> dict[tuple, np.ndarray]:
    """Algorithm 2 written out with loops, for automata whose clocks and locations correspond by position."""
    source_mdp, target_mdp = (GridWorld(size).mdp() for size in sizes)
    source_tables, target_tables = tables(source), tables(target)
    offsets = np.cumsum([0, *map(len, source_tables)])
    result = {}
    for i, table in enumerate(target_tables):
        i_hat = i % len(source_tables)
        other = source_tables[i_hat]
        for u, s in itertools.product(range(1, len(table)), range(target_mdp.n_states)):
            j = table.stage[u]
            regions = [
                t.automaton.conjunction.primitives[j].box.centroid(("x", "y"), m.limits)
                for t, m in ((other, source_mdp), (table, target_mdp))
            ]
            inside = [
                lambda point, rho=t.automaton.conjunction.primitives[j]: (
                    all(low.lower <= value <= low.upper for low, value in zip(rho.box.bounds, point, strict=True))
                    != rho.complemented
                )
                for t in (other, table)
            ]
            best = None
            for cell in range(source_mdp.n_cells):
                here, there = source_mdp.cell_coordinates[cell], target_mdp.coordinates[s]
                distance = round(float(np.sum(((here - regions[0]) - (there - regions[1])) ** 2)), 9)
                rank = (distance, inside[0](here) != inside[1](there), cell)
                best = rank if best is None else min(best, rank)
            assert best is not None
            similar_s = best[2] * 4 + s % 4
            choices = [
                (float(np.sum((other.clocks[v].astype(int) - table.clocks[u].astype(int)) ** 2)), v)
                for v in range(1, len(other))
                if other.location[v] == table.location[u]
            ]
            result[i, u, s] = q[offsets[i_hat] + min(choices)[1], similar_s]
    return result


@pytest.mark.parametrize(
    ("source", "target", "sizes"),
    [
        (SOURCE, TARGET, (4, 5)),
        (SOURCE, f"({TARGET}) | ({SOURCE})", (4, 5)),
        ("G[0,6] F[0,2] (1 <= x <= 2 & 0 <= y <= 1)", "G[0,9] F[0,3] !(0 <= x <= 2 & 0 <= y <= 2)", (3, 5)),
    ],
)
def test_transfer_is_algorithm_2(source: str, target: str, sizes: tuple[int, int]):
    source_mdp, source_memory, target_mdp, target_memory = memories(source, target, sizes)
    q = recognisable(source_memory, source_mdp)
    found = transfer_q(source_mdp, source_memory, q, target_mdp, target_memory, initial=-1.0)
    assert found.dtype == np.float32
    for offset in target_memory.offsets:
        assert (found[offset] == -1.0).all()
    for (i, u, s), values in slow_transfer(source, target, sizes, q).items():
        assert (found[target_memory.offsets[i] + u, s] == values).all()


def test_transfer_to_the_same_task_is_the_identity():
    mdp, memory, *_ = memories(SOURCE, SOURCE, (4, 4))
    q = recognisable(memory, mdp)
    found = transfer_q(mdp, memory, q, mdp, memory, initial=0.0)
    assert (found[1:] == q[1:]).all()


def test_similar_states_keep_the_heading_and_prefer_a_state_that_agrees_on_the_predicate():
    source = to_sdnf(parse("F[0,5] (3 <= x <= 4 & 3 <= y <= 5)")).disjuncts[0].primitives[0]
    target = to_sdnf(parse("F[0,5] (5 <= x <= 6 & 6 <= y <= 7)")).disjuncts[0].primitives[0]
    world = GridWorld(9)
    mdp = world.mdp()
    similar = similar_states(mdp, source, mdp, target)
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


def test_transfer_refuses_what_is_no_extended_q_function():
    mdp, memory, *_ = memories(SOURCE, SOURCE, (4, 4))
    q = recognisable(memory, mdp)
    with pytest.raises(DataError, match="timed automata"):
        transfer_q(mdp, tau_memory(mdp, 2), q, mdp, memory, initial=0.0)
    with pytest.raises(DataError, match="has shape"):
        transfer_q(mdp, memory, q[:-1], mdp, memory, initial=0.0)
