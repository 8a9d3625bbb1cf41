"""Where a primitive comes true: the counterpart of a region's centroid for what a region leaves open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.run import letters_of
from tickwise.automata.ticks import TickTable
from tickwise.errors import DataError
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import Primitive


def landmarks(table: TickTable, data: LabelledTrajectories) -> NDArray[np.float64]:
    """A place for each primitive that states can be compared relative to (Algorithm 2, line 6).

    Where a region is closed to both sides in a variable, it is the centroid Cr(ρ), as in the paper. Elsewhere, as for
    "the key is carried", which says nothing of a position, it is the mean over the trajectories with label 1 that
    satisfy the conjunction, at the tick at which they have done with the primitive.

    Args:
        table: The tick table of a sequential conjunctive subformula.
        data: Trajectories of its task.

    Returns:
        Landmarks in the units of the data, shape ``(primitives, variables)``.

    Raises:
        DataError: If no trajectory with label 1 satisfies the conjunction.
        UnknownVariableError: If the formula names a variable that the data do not have.
    """
    good = data.labels > 0
    letters = letters_of(table.automaton, data.values[good], variables=data.variables, lengths=data.lengths[good])
    states = np.atleast_2d(table.run(letters, data.lengths[good]))
    accepted = table.verdict[states[:, -1]] > 0
    if not accepted.any():
        raise DataError(
            f"no trajectory with label 1 satisfies {table.automaton.conjunction}, so that it has no landmarks; "
            "give trajectories of its own task"
        )
    states, values = states[accepted], data.values[good][accepted]
    primitives = table.automaton.conjunction.primitives
    rows = []
    for stage, primitive in enumerate(primitives):
        done = (table.stage[states] > stage) | (table.verdict[states] > 0)
        place = values[np.arange(len(values)), done.argmax(axis=1)].mean(axis=0)
        rows.append(_closed(primitive, data.variables, place))
    return np.array(rows)


def _closed(primitive: Primitive, variables: tuple[str, ...], place: NDArray[np.float64]) -> NDArray[np.float64]:
    """The centre of the region in the variables in which it is closed, and the place in the others."""
    landmark = place.copy()
    for bound in primitive.box.bounds:
        if np.isfinite(bound.lower) and np.isfinite(bound.upper):
            landmark[variables.index(bound.variable)] = (bound.lower + bound.upper) / 2
    return landmark
