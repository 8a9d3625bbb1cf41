"""Which of the source's extended states a target's is most like, among those that were visited or among all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.mapping import bijections
from tickwise.automata.ticks import TickTable
from tickwise.envs.tabulate import TabularMDP
from tickwise.logic.semantics import holds
from tickwise.transfer.progress import progress_valuations
from tickwise.transfer.qtransfer import members, orientations


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One disjunct of a task: its world, its tick table, and what places are compared relative to.

    Attributes:
        mdp: The world.
        table: The tick table.
        landmarks: A place for each primitive, in world units, shape ``(primitives, variables)``.
    """

    mdp: TabularMDP
    table: TickTable
    landmarks: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """What the states of a target are like, all with one memory state.

    Attributes:
        memory: The source's table states, shape ``(target states, layers)``; one layer for each action, or one for all.
        state: The source's states, of the same shape.
        distance: How far each is off, of the same shape: the root of the sum of squares over the coordinates, relative
            to the landmarks and in world units, and over the clocks, in ticks.
    """

    memory: NDArray[np.int64]
    state: NDArray[np.int64]
    distance: NDArray[np.float64]


def matches(
    source: Side, target: Side, known: NDArray[np.bool_], *, progress: bool = False, travel: bool = False
) -> Iterator[tuple[int, Match]]:
    """For each table state of the target after the start, what the target's states are most like there.

    The location is ξ_Q's and a state's orientation in its cell is kept. Of what is known there, the nearest in
    position relative to the landmarks comes first; of places that are equally far, one in which the predicate has the
    truth value that it has in the target, then the lower number; of one place, the nearest clock values, then the
    lower number. Where nothing is known in the location, all counts as known. With all known it is Algorithm 2.

    Args:
        source: The source's disjunct.
        target: The target's disjunct.
        known: What may be taken, shape ``(source table states, source states, layers)``.
        progress: Whether clocks are compared by their progress; see `progress_valuations`.
        travel: Whether a place that is off by a way counts as the place it is like, so many ticks later as the way
            takes at the greatest speed in the target's world; only whole ticks count.

    Yields:
        The target's table state and the match.

    Raises:
        AutomatonError: If the automata are not isomorphic.
    """
    xi = bijections(target.table.automaton, source.table.automaton)
    clocks = source.table.clocks[:, xi.clocks].astype(np.float64)
    wanted = progress_valuations(source.table, target.table) if progress else target.table.clocks.astype(np.float64)
    speed = _speed(target.mdp) if travel else np.inf
    for location in np.unique(target.table.location[1:]):
        there = np.flatnonzero(source.table.location == xi.locations[location])
        there = there[there > 0] if there[-1] > 0 else there
        own = np.flatnonzero(target.table.location == location)
        state, gap, usable = _places(source, target, int(target.table.automaton.stages[location]), known[there])
        delays, late = np.unique(np.floor(np.round(np.sqrt(gap) / speed, 9)), return_inverse=True)
        late = late.reshape(gap.shape)
        for u in own[own > 0]:
            aim = np.repeat(wanted[u][None, None], len(delays), axis=0)
            aim[..., 0] += delays[:, None]
            apart = np.round(((clocks[there] - aim) ** 2).sum(axis=2), 9)  # for each delay and table state
            choice = np.where(usable, apart[late], np.inf)
            nearest = choice.argmin(axis=2)
            yield int(u), Match(there[nearest], state, np.sqrt(gap + choice.min(axis=2)))


def _places(
    source: Side, target: Side, stage: int, known: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """What the target's states are most like in position, how far that is off, squared, and what is known there.

    Shapes ``(target states, layers)`` twice, and ``(target states, layers, source table states)``.
    """
    near, far = (side.mdp.cell_coordinates for side in (source, target))
    predicates = [side.table.automaton.predicates[stage] for side in (source, target)]
    truth = holds(predicates[0], near, source.mdp.variables), holds(predicates[1], far, target.mdp.variables)
    differs = np.not_equal.outer(truth[1], truth[0])
    offsets = (far - target.landmarks[stage])[:, None, :] - (near - source.landmarks[stage])[None, :, :]
    distance = np.round((offsets**2).sum(axis=2), 9)
    order = np.lexsort((differs, distance), axis=1)[target.mdp.cell]
    orientation = orientations(target.mdp)[:, None]
    somewhere = np.asarray(known.any(axis=0))[members(source.mdp)]
    layers = np.arange(known.shape[2])
    found = np.stack([somewhere[order, orientation, layer] for layer in layers], axis=2)
    cell = np.take_along_axis(order, found.argmax(axis=1), axis=1)
    state = members(source.mdp)[cell, orientation]
    usable = known.transpose(1, 2, 0)[state, layers] | ~np.asarray(found.any(axis=1))[..., None]
    return state, distance[target.mdp.cell[:, None], cell], usable


def _speed(mdp: TabularMDP) -> float:
    """The farthest that one tick can lead, in world units; infinite where nothing moves."""
    ways = np.linalg.norm(mdp.coordinates[mdp.successor] - mdp.coordinates[:, None, None, :], axis=3)
    return float(ways[mdp.probability > 0].max()) or np.inf
