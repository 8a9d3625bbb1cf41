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
