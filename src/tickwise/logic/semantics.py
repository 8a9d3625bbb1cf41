"""What a finite trajectory says of a formula: three-valued verdicts and robustness (Section II-A).

A predicate past a trajectory's last tick is UNKNOWN, and ¬, ∧, ∨, ◇ and □ follow Kleene's rules, which are
minus, min and max on -1, 0 and 1. Robustness is the usual quantitative semantics: for a box the least signed
distance to a side (strictness plays no part), min and max for the connectives. Past the last tick a
predicate's robustness is only known to lie in [-inf, inf], and both ends of that interval are carried
upwards.

A formula becomes a short program (`tickwise.logic.program`) that compiled kernels run on many trajectories at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import read_only
from tickwise.errors import UnknownVariableError
from tickwise.logic.batch import Batch, Trajectories, arranged, as_batch, require_no_nan
from tickwise.logic.program import Program, program, variables_of
from tickwise.logic.syntax import Box, Formula, Not, Verdict

__all__ = ["Batch", "Trajectories", "as_batch", "holds", "robustness", "verdict"]


def verdict(
    formula: Formula,
    X: Trajectories,
    *,
    variables: Sequence[str] | None = None,
    lengths: NDArray[Any] | None = None,
) -> Verdict | NDArray[np.int8]:
    """The three-valued verdict of a formula at tick 0.

    Args:
        formula: An MITL_f formula.
        X: One trajectory or a batch; see `as_batch` for the forms.
        variables: The names of the columns of `X`; by default, for bare arrays, the formula's variables in
            order of appearance.
        lengths: The number of states of each trajectory of an (n, ticks, variables) array, shape (n,).

    Returns:
        A `Verdict` for one trajectory; for a batch int8 numbers of shape (n,): 1 true, 0 unknown, -1 false.

    Raises:
        UnknownVariableError: If the formula names a variable that the data does not have.
        DataError: If the trajectories are malformed; see `as_batch`.
    """
    batch = arranged(X, variables_of(formula), variables=variables, lengths=lengths)
    answers = _verdicts(program(formula, batch.values.shape[1]), batch)
    return Verdict(int(answers[0])) if batch.single else answers


def robustness(
    formula: Formula,
    X: Trajectories,
    *,
    variables: Sequence[str] | None = None,
    lengths: NDArray[Any] | None = None,
) -> float | NDArray[np.float64]:
    """The robustness of a formula at tick 0, in the units of the variables.

    Its sign agrees with the verdict, except that it may be 0 under either. On a trajectory that ends before
    the formula's horizon it is what is certain of every continuation: a lower bound of the robustness where
    the verdict is TRUE, an upper bound where it is FALSE, and NaN where it is UNKNOWN. The constants have
    inf and -inf.

    Args:
        formula: An MITL_f formula.
        X: One trajectory or a batch; see `as_batch` for the forms.
        variables: The names of the columns of `X`; by default, for bare arrays, the formula's variables in
            order of appearance.
        lengths: The number of states of each trajectory of an (n, ticks, variables) array, shape (n,).

    Returns:
        A number for one trajectory; for a batch an array of shape (n,).

    Raises:
        UnknownVariableError: If the formula names a variable that the data does not have.
        DataError: If the trajectories are malformed; see `as_batch`.
    """
    batch = arranged(X, variables_of(formula), variables=variables, lengths=lengths)
    compiled = program(formula, batch.values.shape[1])
    answers, upper = _robustness(compiled, batch)
    if batch.lengths.min(initial=compiled.horizon + 1) <= compiled.horizon:
        # the numbers alone do not tell what is unknown where an end is 0
        verdicts = _verdicts(compiled, batch)
        answers = np.select([verdicts > 0, verdicts < 0], [answers, upper], math.nan)
    return float(answers[0]) if batch.single else answers


def holds(predicate: Box | Not, values: NDArray[np.float64], variables: Sequence[str]) -> NDArray[np.bool_]:
    """Where a predicate holds.

    Args:
        predicate: A box or its complement.
        values: The variables' values, shape (..., ticks, variables), without NaN where the answer matters.
        variables: The names of the last axis.

    Returns:
        Shape (..., ticks).

    Raises:
        UnknownVariableError: If the predicate names a variable that the data does not have.
    """
    if isinstance(predicate, Not):
        return ~_inside(predicate.operand, values, variables)
    return _inside(predicate, values, variables)


def _inside(box: Formula, values: NDArray[np.float64], variables: Sequence[str]) -> NDArray[np.bool_]:
    if not isinstance(box, Box):
        raise TypeError(f"{box} is not a predicate; give a box or its complement")
    inside = np.ones(values.shape[:-1], dtype=np.bool_)
    for bound in box.bounds:
        value = _column(bound.variable, values, variables)
        if not math.isinf(bound.lower):
            inside &= value > bound.lower if bound.lower_strict else value >= bound.lower
        if not math.isinf(bound.upper):
            inside &= value < bound.upper if bound.upper_strict else value <= bound.upper
    return inside


def _column(name: str, values: NDArray[np.float64], variables: Sequence[str]) -> NDArray[np.float64]:
    if name not in variables:
        there = ", ".join(map(repr, variables)) or "nothing"
        raise UnknownVariableError(f"the predicate names {name!r}, which the data does not have; it has {there}")
    return values[..., list(variables).index(name)]


def _verdicts(compiled: Program, batch: Batch) -> NDArray[np.int8]:
    from tickwise.logic import bits  # compiled code is loaded when it is first needed

    answers = np.empty(len(batch.values), dtype=np.int8)
    bad = bits.verdicts(_rows(batch), batch.lengths, answers, *compiled.for_verdicts)
    if bad >= 0:
        require_no_nan(batch, compiled.variables)
    return answers


def _robustness(compiled: Program, batch: Batch) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lower and the upper ends."""
    from tickwise.logic import extrema

    ends = np.empty((2, len(batch.values)))
    bad = extrema.robustness(_rows(batch), batch.lengths, *ends, *compiled.for_robustness)
    if bad >= 0:
        require_no_nan(batch, compiled.variables)
    return ends[0], ends[1]


def _rows(batch: Batch) -> NDArray[np.float64]:
    """The values of each trajectory in a row, shape (n, ticks * variables)."""
    count, ticks, columns = batch.values.shape
    return read_only(np.ascontiguousarray(batch.values).reshape(count, ticks * columns))
