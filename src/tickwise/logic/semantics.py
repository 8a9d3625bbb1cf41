"""What a finite trajectory says of a formula: three-valued verdicts and robustness (Section II-A).

A predicate past a trajectory's last tick is UNKNOWN, and ¬, ∧, ∨, ◇ and □ follow Kleene's rules, which are
minus, min and max on -1, 0 and 1. Robustness is the usual quantitative semantics: for a box the least signed
distance to a side (strictness plays no part), min and max for the connectives. Past the last tick a
predicate's robustness is only known to lie in [-inf, inf], and both ends of that interval are carried
upwards.

Both are one recursion over signals of shape (layers, n, ticks). A verdict has one layer; robustness has two,
the lower and the upper end, so that negation is minus with the layers reversed in either case. A signal's
last column stands for every tick past the data, where all predicates are unknown for ever, so a horizon
beyond the data costs nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import UnknownVariableError
from tickwise.logic.batch import Batch, Trajectories, as_batch
from tickwise.logic.syntax import Always, And, Box, Constant, Eventually, Formula, Interval, Not, Or, Verdict

__all__ = ["Batch", "Trajectories", "as_batch", "holds", "robustness", "verdict"]

Number = TypeVar("Number", np.int8, np.float64)
_Combine = Callable[[NDArray[Number], NDArray[Number]], NDArray[Number]]


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
    batch = _up_to_horizon(formula, as_batch(X, formula.variables, variables=variables, lengths=lengths))
    answers = _verdicts(formula, batch)
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
    names = formula.variables
    batch = _up_to_horizon(formula, as_batch(X, names, variables=variables, lengths=lengths))
    signals = _Signals(
        atom=lambda box: _distances(box, batch.values, names),
        lengths=batch.lengths,
        unknown=np.array([-math.inf, math.inf]),
        top=np.float64(math.inf),
    )
    lower, upper = signals.at_start(formula)
    verdicts = _verdicts(formula, batch)
    answers = np.select([verdicts > 0, verdicts < 0], [lower, upper], math.nan)
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


def _distances(box: Box, values: NDArray[np.float64], variables: Sequence[str]) -> NDArray[np.float64]:
    """The least signed distance to a side of a box, positive inside: shape (..., ticks)."""
    sides = []
    for bound in box.bounds:
        value = _column(bound.variable, values, variables)
        if not math.isinf(bound.lower):
            sides.append(value - bound.lower)
        if not math.isinf(bound.upper):
            sides.append(bound.upper - value)
    return reduce(np.minimum, sides)


def _column(name: str, values: NDArray[np.float64], variables: Sequence[str]) -> NDArray[np.float64]:
    if name not in variables:
        there = ", ".join(map(repr, variables)) or "nothing"
        raise UnknownVariableError(f"the predicate names {name!r}, which the data does not have; it has {there}")
    return values[..., list(variables).index(name)]


def _up_to_horizon(formula: Formula, batch: Batch) -> Batch:
    """The ticks that the formula can depend on, which are those up to its end-effect time (Definition 4)."""
    ticks = formula.end_effect + 1
    return replace(batch, values=batch.values[:, :ticks], lengths=np.minimum(batch.lengths, ticks))


def _verdicts(formula: Formula, batch: Batch) -> NDArray[np.int8]:
    names = formula.variables
    signals = _Signals(
        atom=lambda box: 2 * holds(box, batch.values, names).astype(np.int8) - 1,
        lengths=batch.lengths,
        unknown=np.zeros(1, dtype=np.int8),
        top=np.int8(1),
    )
    answers: NDArray[np.int8] = signals.at_start(formula)[0]
    return answers


class _Signals:
    """The signals of a formula's nodes over one batch, shape (layers, n, count), at ticks 0 to count - 1."""

    def __init__(
        self,
        atom: Callable[[Box], NDArray[Any]],
        lengths: NDArray[np.int64],
        unknown: NDArray[Any],
        top: Any,
    ) -> None:
        self._atom = atom
        self._lengths = lengths
        self._unknown = unknown
        self._top = top
        # ticks 0 to ticks-1 have data in some trajectory; column `ticks` stands for all later ones
        self._ticks = int(lengths.max(initial=0))

    def at_start(self, formula: Formula) -> NDArray[Any]:
        """The values at tick 0, shape (layers, n)."""
        return self._signal(formula, 1)[..., 0]

    def _signal(self, node: Formula, count: int) -> NDArray[Any]:
        if isinstance(node, Box):
            return self._box(node, count)
        if isinstance(node, Constant):
            shape = (len(self._unknown), len(self._lengths), count)
            return np.full(shape, self._top if node.value else -self._top)
        if isinstance(node, Not):
            return -self._signal(node.operand, count)[::-1]
        if isinstance(node, And):
            return reduce(np.minimum, (self._signal(child, count) for child in node.operands))
        if isinstance(node, Or):
            return reduce(np.maximum, (self._signal(child, count) for child in node.operands))
        if isinstance(node, Eventually):
            return self._window(np.maximum, node.interval, node.operand, count)
        if isinstance(node, Always):
            return self._window(np.minimum, node.interval, node.operand, count)
        raise TypeError(f"{type(node).__name__} is not a formula node of this library")

    def _box(self, box: Box, count: int) -> NDArray[Any]:
        signal = np.empty((len(self._unknown), len(self._lengths), count), dtype=self._unknown.dtype)
        known = min(count, self._ticks)
        signal[..., :known] = self._atom(box)[:, :known]
        signal[..., known:] = self._unknown[:, None, None]
        past = np.arange(known) >= self._lengths[:, None]
        signal[..., :known] = np.where(past, self._unknown[:, None, None], signal[..., :known])
        return signal

    def _window(self, combine: _Combine[Any], interval: Interval, operand: Formula, count: int) -> NDArray[Any]:
        # a tick past the data reads like any other one, so windows may be cut there
        start, end = min(interval.start, self._ticks), min(interval.end, self._ticks)
        need = count + end
        signal = self._signal(operand, min(need, self._ticks + 1))
        if signal.shape[-1] < need:
            signal = np.pad(signal, [(0, 0), (0, 0), (0, need - signal.shape[-1])], mode="edge")
        return sliding(combine, signal[..., start:], end - start + 1)


def sliding(combine: _Combine[Number], signal: NDArray[Number], width: int) -> NDArray[Number]:
    """The min or max of every window along the last axis, by doubling: O(ticks log width) in all.

    Args:
        combine: ``np.minimum`` or ``np.maximum``.
        signal: Shape (..., ticks).
        width: The number of ticks of a window, from 1 to ticks.

    Returns:
        Shape (..., ticks - width + 1); entry t is over ticks t to t + width - 1.
    """
    covered = 1
    while 2 * covered <= width:
        signal = combine(signal[..., :-covered], signal[..., covered:])
        covered *= 2
    rest = width - covered
    return combine(signal[..., : signal.shape[-1] - rest], signal[..., rest:])
