"""Algorithm 2: the transfer of extended Q-functions based on logical transferability."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.mapping import Bijections, bijections
from tickwise.automata.ticks import TickTable
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import AutomatonError, DataError
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Predicate
from tickwise.rl.states import Memory


def transfer_q(
    source_mdp: TabularMDP,
    source_memory: Memory,
    source_q: NDArray[np.float32],
    target_mdp: TabularMDP,
    target_memory: Memory,
    initial: float,
    landmarks: tuple[Sequence[NDArray[np.float64]], Sequence[NDArray[np.float64]]] | None = None,
) -> NDArray[np.float32]:
    """Transfer an extended Q-function from the source to the target task (Algorithm 2).

    Args:
        source_mdp: The source's world.
        source_memory: The source's extended states, made of the tick tables of φ^S.
        source_q: Q̄^S*, shape ``(source memory states, source states, actions)``.
        target_mdp: The target's world; it has the source's actions.
        target_memory: The target's extended states, made of the tick tables of φ^T.
        initial: The value of table states that no episode learns in (the start, before the first letter).
        landmarks: What states are compared relative to in the source and in the target, for each disjunct an array of
            shape ``(primitives, variables)`` as `tickwise.transfer.landmarks` gives it; by default the regions'
            centroids within the worlds' limits, as in the paper.

    Returns:
        Q̄^T, shape ``(target memory states, target states, actions)``.

    Raises:
        DataError: If the worlds' actions, coordinates or orientations differ in number, or a memory is not one of
            extended states.
        AutomatonError: If φ^T is not structurally transferable from φ^S.
    """
    check_transfer(source_mdp, source_memory, source_q, target_mdp, target_memory)  # line 1
    shape = (target_memory.n_states, target_mdp.n_states, target_mdp.n_actions)
    target_q = np.full(shape, initial, dtype=np.float32)
    for i, target in enumerate(target_memory.tables):  # line 2
        i_hat = i % len(source_memory.tables)  # line 4
        source = source_memory.tables[i_hat]
        xi = bijections(target.automaton, source.automaton)
        near = centroids(source, source_mdp) if landmarks is None else landmarks[0][i_hat]
        far = centroids(target, target_mdp) if landmarks is None else landmarks[1][i]
        pairs = zip(source.automaton.predicates, target.automaton.predicates, strict=True)
        states = [
            similar_states(source_mdp, rho_source, near[j], target_mdp, rho_target, far[j])
            for j, (rho_source, rho_target) in enumerate(pairs)
        ]
        similar_u = similar_valuations(source, target, xi)
        for u in range(1, len(target)):  # line 2: every location and valuation
            j = target.stage[u]  # line 3: the primitive that is still to be satisfied; ξ_Σ is by position (line 5)
            learned = source_q[source_memory.offsets[i_hat] + similar_u[u]]
            target_q[target_memory.offsets[i] + u] = learned[states[j]]  # line 12
    return target_q  # line 14


def centroids(table: TickTable, mdp: TabularMDP) -> NDArray[np.float64]:
    """Cr(ρ) of each primitive's region, shape ``(primitives, variables)``."""
    primitives = table.automaton.conjunction.primitives
    return np.array([primitive.box.centroid(mdp.variables, mdp.limits) for primitive in primitives])


def similar_states(
    source_mdp: TabularMDP,
    source: Predicate,
    source_centre: NDArray[np.float64],
    target_mdp: TabularMDP,
    target: Predicate,
    target_centre: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Line 6: for each target state the source state that lies most alike relative to the region's centroid.

    A state's orientation in its cell is kept. Of source states at the same distance, one in which the predicate
    has the truth value that it has in the target state comes first, then the lower number: the paper leaves ties
    open, and without this rule a cell beside a region could be likened to one within it.

    Args:
        source_mdp: The source's world.
        source: The predicate ρ^S.
        source_centre: Its region's centroid, or another landmark, shape ``(variables,)``.
        target_mdp: The target's world.
        target: The predicate ρ^{j,T}.
        target_centre: Its region's centroid, or another landmark.

    Returns:
        Source states, shape ``(target states,)``.
    """
    source_cells, target_cells = source_mdp.cell_coordinates, target_mdp.cell_coordinates
    differs = (
        holds(target, target_cells, target_mdp.variables)[:, None]
        != holds(source, source_cells, source_mdp.variables)[None, :]
    )
    nearest = most_alike(source_cells - source_centre, target_cells - target_centre, differs)
    return members(source_mdp)[nearest[target_mdp.cell], orientations(target_mdp)]


def most_alike(
    source: NDArray[np.float64], target: NDArray[np.float64], differs: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """For each of the target's places the nearest of the source's, both relative to their landmarks.

    Args:
        source: Places, shape ``(source places, variables)``.
        target: Places, shape ``(target places, variables)``.
        differs: Where the predicates' truth values differ, shape ``(target places, source places)``; of places at the
            same distance, one where they do not comes first, then the lower number.

    Returns:
        Numbers of the source's places, shape ``(target places,)``.
    """
    distance = ((target[:, None, :] - source[None, :, :]) ** 2).sum(axis=2)
    # distances between grid points differ by far more than rounding does
    rank = np.lexsort((differs, np.round(distance, 9)), axis=1)
    return np.asarray(rank[:, 0], dtype=np.int64)


def similar_valuations(source: TickTable, target: TickTable, xi: Bijections) -> NDArray[np.int64]:
    """Lines 7 to 11: for each target table state the source's in location ξ_Q(q) with the nearest clock values.

    Every clock's value is brought as near as it can be; where the nearest values of two clocks do not occur
    together in the location, the valuation with the least sum of squared differences is taken. A source that leaves
    its first location with the first letter, at a window [0,0], has only the start there, where nothing is learned.

    Args:
        source: The tick table of φ_î^S.
        target: The tick table of φ_i^T.
        xi: The bijections between their automata.

    Returns:
        Source table states, shape ``(target table states,)``; 0 for the start.
    """
    similar = np.zeros(len(target), dtype=np.int64)
    for u in range(1, len(target)):  # line 8
        there = np.flatnonzero(source.location == xi.locations[target.location[u]])  # line 7
        there = there[there > 0] if there[-1] > 0 else there
        values = source.clocks[there][:, xi.clocks].astype(np.int64)  # line 9
        distance = ((values - target.clocks[u].astype(np.int64)) ** 2).sum(axis=1)
        similar[u] = there[distance.argmin()]  # line 10
    return similar


def check_copies(source: Sequence[TickTable], target: Sequence[TickTable]) -> None:
    """Line 1, in number: the target has as many disjuncts as the source, or several times as many (Definition 7).

    Raises:
        AutomatonError: If it has not.
    """
    if len(target) % len(source):
        raise AutomatonError(
            f"the target's formula has {len(target)} disjuncts and the source's {len(source)}, so it is not "
            "structurally transferable (Definition 7); use a multiple"
        )


def check_transfer(
    source_mdp: TabularMDP,
    source_memory: Memory,
    source_q: NDArray[np.float32],
    target_mdp: TabularMDP,
    target_memory: Memory,
) -> None:
    """Refuse what cannot be transferred; the arguments are `transfer_q`'s.

    Raises:
        DataError: As `transfer_q`.
        AutomatonError: If the numbers of disjuncts do not fit.
    """
    if not (source_memory.tables and target_memory.tables):
        raise DataError("extended Q-functions need memories made of timed automata; use automaton_memory")
    check_copies(source_memory.tables, target_memory.tables)
    if len(source_mdp.variables) != len(target_mdp.variables):
        raise DataError(
            f"the source's world has {len(source_mdp.variables)} coordinates and the target's "
            f"{len(target_mdp.variables)}; transfer compares positions, so use as many in both"
        )
    if source_mdp.n_actions != target_mdp.n_actions:
        raise DataError(
            f"the source has {source_mdp.n_actions} actions and the target {target_mdp.n_actions}; "
            "transfer needs the same set of actions"
        )
    wanted = (source_memory.n_states, source_mdp.n_states, source_mdp.n_actions)
    if source_q.shape != wanted:
        raise DataError(f"the source's Q-function has shape {source_q.shape}; use {wanted}")
    if members(source_mdp).shape[1] != members(target_mdp).shape[1]:
        raise DataError("the worlds have different numbers of orientations in a cell; transfer needs the same")


def orientations(mdp: TabularMDP) -> NDArray[np.int64]:
    """The number of each state among those of its cell, such as its heading, shape ``(states,)``."""
    order = np.argsort(mdp.cell, kind="stable")
    first = np.searchsorted(mdp.cell[order], np.arange(mdp.n_cells))
    orientation = np.empty(mdp.n_states, dtype=np.int64)
    orientation[order] = np.arange(mdp.n_states) - first[mdp.cell[order]]
    return orientation


def members(mdp: TabularMDP) -> NDArray[np.int64]:
    """The states of each cell in order, shape ``(cells, orientations)``."""
    counts = np.bincount(mdp.cell, minlength=mdp.n_cells)
    if (counts != counts[0]).any():
        raise DataError("the cells have different numbers of states; transfer needs the same in each")
    return np.argsort(mdp.cell, kind="stable").reshape(mdp.n_cells, counts[0])
