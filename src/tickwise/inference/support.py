"""What a prior can do at all: whether a predicate can hold for ever, and whether it can give the trajectories."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.inference.kernels import PriorArrays, inside


@njit
def lasting(prior: PriorArrays, lower: NDArray[np.float64], upper: NDArray[np.float64], complemented: bool) -> bool:
    """Whether a predicate holds at all ticks with a positive probability: then P > 0 for each of its primitives.

    Args:
        prior: The prior's arrays.
        lower: Lower box sides, shape ``(variables,)``.
        upper: Upper box sides, shape ``(variables,)``.
        complemented: Whether the predicate is the complement of the box.

    Returns:
        Whether some states, or draws, with the predicate can follow each other for ever.
    """
    if prior.independent:
        measure = 1.0
        for variable in range(len(lower)):
            width = prior.high[variable] - prior.low[variable]
            low, high = max(prior.low[variable], lower[variable]), min(prior.high[variable], upper[variable])
            measure *= max(high - low, 0.0) / width
        return measure < 1.0 if complemented else measure > 0.0
    stays = np.empty(len(prior.coordinates), dtype=np.bool_)
    for state in range(len(stays)):
        stays[state] = inside(prior.coordinates[state], lower, upper) != complemented
    changed = True
    while changed:  # the greatest set in which each state has a successor
        changed = False
        for state in range(len(stays)):
            if stays[state]:
                found = False
                for edge in range(prior.indptr[state], prior.indptr[state + 1]):
                    found = found or (prior.weights[edge] > 0 and stays[prior.indices[edge]])
                if not found:
                    stays[state] = False
                    changed = True
    return bool(np.any(stays & (prior.forward[0] > 0)))


def possible(prior: PriorArrays, values: NDArray[np.float64], lengths: NDArray[np.int64]) -> bool:
    """Whether a prior can give every one of some trajectories.

    Args:
        prior: The prior's arrays, coordinates in the order of the trajectories' variables.
        values: States, shape ``(n, ticks, variables)``.
        lengths: Number of states of each trajectory, shape ``(n,)``.

    Returns:
        Whether each is a path of the chain, or lies in the range of the independent draws.
    """
    alive = np.arange(values.shape[1]) < lengths[:, None]
    if prior.independent:
        states = values[alive]
        return bool(((states >= prior.low) & (states <= prior.high)).all())
    places, at = np.unique(prior.coordinates, axis=0, return_inverse=True)
    numbers = {tuple(place): number for number, place in enumerate(places.tolist())}
    wanted = np.full(alive.shape, -1)
    wanted[alive] = [numbers.get(tuple(state), -2) for state in values[alive].tolist()]
    return bool(_walks(prior, at.reshape(-1).astype(np.int64), wanted))


@njit
def _walks(prior: PriorArrays, places: NDArray[np.int64], wanted: NDArray[np.int64]) -> bool:
    """Whether for each row there is a path of the chain through the wanted places; -1 is the end."""
    for i in range(len(wanted)):
        here = np.empty(len(places), dtype=np.bool_)
        for state in range(len(places)):
            here[state] = prior.forward[0, state] > 0 and places[state] == wanted[i, 0]
        for tick in range(1, wanted.shape[1]):
            if wanted[i, tick] == -1:
                break
            there = np.zeros(len(places), dtype=np.bool_)
            for source in np.flatnonzero(here):
                for edge in range(prior.indptr[source], prior.indptr[source + 1]):
                    successor = prior.indices[edge]
                    if prior.weights[edge] > 0 and places[successor] == wanted[i, tick]:
                        there[successor] = True
            here = there
        if not here.any():
            return False
    return True
