"""The regions of a formula as propositions p1, p2, …, for tools that know names and no numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError
from tickwise.logic.semantics import Trajectories, as_batch, holds, robustness
from tickwise.logic.syntax import Box, Formula


def propositions(phi: Formula) -> dict[str, Box]:
    """The different boxes of a formula, named ``p1``, ``p2``, … in order of appearance."""
    found = dict.fromkeys(_boxes(phi))
    return {f"p{number}": box for number, box in enumerate(found, start=1)}


def signals(
    phi: Formula, X: Trajectories, *, variables: Sequence[str] | None = None, quantitative: bool = False
) -> dict[str, list[tuple[int, Any]]]:
    """What one trajectory says of a formula's regions at every tick, in the form that `mtl` evaluates.

    Args:
        phi: A formula.
        X: One trajectory, an array (ticks, variables) or a data frame.
        variables: The names of the columns; by default the formula's, in order of appearance.
        quantitative: Whether to give the robustness of each region instead of whether it holds.

    Returns:
        For each region of `propositions` the pairs (tick, value), values being Python's own.

    Raises:
        DataError: If the trajectory is malformed, or a batch was given.
    """
    batch = as_batch(X, phi.variables, variables=variables)
    if not batch.single:
        raise DataError(f"signals are of one trajectory, but a batch of {len(batch.values)} was given; index it")
    values = batch.values[0, : batch.lengths[0]]
    return {name: list(enumerate(_values(box, values, phi, quantitative))) for name, box in propositions(phi).items()}


def _values(box: Box, values: NDArray[np.float64], phi: Formula, quantitative: bool) -> list[Any]:
    if quantitative:
        # a predicate's robustness is that of a trajectory of one tick
        answers: NDArray[Any] = np.asarray(robustness(box, values[:, np.newaxis], variables=phi.variables))
    else:
        answers = holds(box, values, phi.variables)
    return [answer.item() for answer in answers]


def _boxes(node: Formula) -> Iterator[Box]:
    if isinstance(node, Box):
        yield node
    for child in node.children:
        yield from _boxes(child)
