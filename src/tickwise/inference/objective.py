"""The objective J = CR + λ I of the search (Equation obj), compiled for whole swarms at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import read_only
from tickwise._jit import njit
from tickwise.errors import ConfigurationError
from tickwise.inference.counting import log_probability
from tickwise.inference.kernels import (
    EVENTUALLY_ALWAYS,
    PriorArrays,
    Shape,
    formula_satisfied,
    satisfied,
)
from tickwise.inference.prior import Prior
from tickwise.inference.space import Gaps, SearchSpace, SpaceArrays, decode, to_arrays
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF

ClassWeight = str | Mapping[int, float] | None

_MOST_DISJUNCTS = 12  # a tick of the exact probability looks at all combinations of their letters
_LARGEST_PRODUCT = 2**62  # their joint clock valuations are numbered
_REMEMBERED = 1 << 14  # rows of the memory of probabilities; a converging swarm asks for the same ones again


class _Data(NamedTuple):
    values: NDArray[np.float64]
    lengths: NDArray[np.int64]
    positive: NDArray[np.bool_]
    weights: NDArray[np.float64]


def trajectory_weights(labels: NDArray[np.int8], class_weight: ClassWeight) -> NDArray[np.float64]:
    """The weight of each trajectory in the classification rate, shape ``(n,)``.

    Args:
        labels: 1 or -1, shape ``(n,)``.
        class_weight: None for equal weights, ``"balanced"`` for the same total weight of both labels, or a mapping
            from label to weight.

    Raises:
        ConfigurationError: If the class weight is none of these, or a weight is not positive.
    """
    if class_weight is None:
        return np.ones(len(labels))
    if isinstance(class_weight, str):
        if class_weight != "balanced":
            raise ConfigurationError(f"class_weight is {class_weight!r}; use None, 'balanced' or a mapping")
        positives = np.count_nonzero(labels == 1)
        return len(labels) / (2.0 * np.where(labels == 1, positives, len(labels) - positives))
    unknown = set(class_weight) - {1, -1}
    if unknown or any(weight <= 0 for weight in class_weight.values()):
        raise ConfigurationError(f"class_weight is {dict(class_weight)!r}; map the labels 1 and -1 to weights above 0")
    return np.array([float(class_weight.get(int(label), 1.0)) for label in labels])


class _Memory(NamedTuple):
    """A direct-mapped table from a formula's parameters, as integers, to log P; it never changes a result."""

    keys: NDArray[np.int64]
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Objective:
    """CR(S, φ) + λ I(φ) of the formulas at many positions; a function of positions that the swarm maximises.

    Attributes:
        data: The trajectories S.
        weights: Weight of each trajectory in the classification rate, shape ``(n,)``.
        prior: The prior G_L.
        space: The search space.
        shape: Operators and polarities, which stay fixed.
        gaps: Free intervals of ticks, so that θ is in Υ_z.
        information_weight: λ.
    """

    data: LabelledTrajectories
    weights: NDArray[np.float64]
    prior: Prior
    space: SearchSpace
    shape: Shape
    gaps: Gaps
    information_weight: float
    _compiled: tuple[_Data, PriorArrays, SpaceArrays, NDArray[np.int64], _Memory] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        product = 1
        for low, high in zip(self.shape.starts[:-1], self.shape.starts[1:], strict=True):
            nested = int(np.count_nonzero(self.shape.operators[low:high] >= EVENTUALLY_ALWAYS))
            product *= self.space.horizon * nested + int(high - low) + 1
        disjuncts = len(self.shape.starts) - 1
        if disjuncts > _MOST_DISJUNCTS or product > _LARGEST_PRODUCT:
            raise ConfigurationError(
                f"{disjuncts} disjuncts over {self.space.horizon} ticks make {product:.0e} clock "
                "valuations; use a smaller size or a shorter horizon"
            )
        data = self.data
        arrays = _Data(data.values, data.lengths, data.labels == 1, self.weights)
        gaps = np.array(self.gaps, dtype=np.int64).reshape(-1, 2)
        width = len(self.shape.operators) * (3 + 2 * len(data.variables))
        memory = _Memory(np.full((_REMEMBERED, width), -1, dtype=np.int64), np.zeros(_REMEMBERED))
        compiled = (arrays, self.prior.arrays(data.variables), self.space.arrays(), gaps, memory)
        object.__setattr__(self, "_compiled", compiled)

    def __call__(self, positions: NDArray[np.float64], incumbents: NDArray[np.float64]) -> NDArray[np.float64]:
        """J at each position, or -inf where J cannot be greater than the incumbent.

        Args:
            positions: One row per particle, shape ``(particles, dimensions)``.
            incumbents: The value that each particle has to beat, shape ``(particles,)``.

        Returns:
            Values, shape ``(particles,)``.
        """
        data, prior, space, gaps, memory = self._compiled
        return _evaluate(data, prior, space, self.shape, gaps, memory, self.information_weight, positions, incumbents)

    def value(self, position: NDArray[np.float64]) -> float:
        """J at one position."""
        return float(self(position[None, :], np.array([-np.inf]))[0])

    def formula(self, position: NDArray[np.float64]) -> SDNF:
        """The formula at a position."""
        return self.space.decode(position, self.shape, self.gaps)

    def parts(self, formula: SDNF) -> tuple[float, float]:
        """Classification rate and information gain of a formula on this data and prior."""
        signature = formula_signature(formula, self.data)
        correct = signature == (self.data.labels == 1)
        rate = float(self.weights[correct].sum() / self.weights.sum())
        shape, times, lower, upper = to_arrays(formula, self.data.variables)
        logarithm = log_probability(self.prior.arrays(self.data.variables), shape, times, lower, upper)
        return rate, 0.0 if np.isinf(logarithm) else -logarithm / self.prior.horizon


def formula_signature(formula: SDNF, data: LabelledTrajectories) -> NDArray[np.bool_]:
    """Whether each trajectory's weak verdict is not FALSE (g = 1), shape ``(n,)``."""
    return satisfied(read_only(data.values), read_only(data.lengths), *to_arrays(formula, data.variables))


@njit
def _evaluate(
    data: _Data,
    prior: PriorArrays,
    space: SpaceArrays,
    shape: Shape,
    gaps: NDArray[np.int64],
    memory: _Memory,
    information_weight: float,
    positions: NDArray[np.float64],
    incumbents: NDArray[np.float64],
) -> NDArray[np.float64]:
    n, width = len(shape.operators), len(space.low)
    times = np.zeros((n, 3), dtype=np.int64)
    lower, upper = np.empty((n, width)), np.empty((n, width))
    total = data.weights.sum()
    result = np.empty(len(positions))
    most = information_weight * prior.most if information_weight > 0 else 0.0
    for particle in range(len(positions)):
        decode(space, shape, gaps, positions[particle], times, lower, upper)
        # the bound is for pruning only; the slack keeps a rounding error from cutting off an improvement
        enough = incumbents[particle] - most - 1e-9
        correct, lost = 0.0, 0.0
        for i in range(len(data.values)):
            if formula_satisfied(data.values[i], data.lengths[i], shape, times, lower, upper) == data.positive[i]:
                correct += data.weights[i]
            else:
                lost += data.weights[i]
                if (total - lost) / total < enough:
                    break
        rate = correct / total
        if (total - lost) / total < enough:
            result[particle] = -np.inf
        elif information_weight == 0:
            result[particle] = rate
        else:
            if len(shape.starts) > 2 and np.isfinite(incumbents[particle]):
                # a disjunction is at least as probable as each disjunct, whose own P is quick and often known
                gain = _gain_bound(memory, prior, shape, times, lower, upper)
                if rate + information_weight * gain < incumbents[particle] - 1e-9:
                    result[particle] = -np.inf
                    continue
            logarithm = _remembered(memory, prior, shape, times, lower, upper, times)
            gain = 0.0 if np.isinf(logarithm) else -logarithm / prior.horizon
            result[particle] = rate + information_weight * gain
    return result


@njit
def _gain_bound(
    memory: _Memory,
    prior: PriorArrays,
    shape: Shape,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> float:
    """The least information gain of a disjunct alone, an upper bound on that of the disjunction."""
    bound = np.inf
    for i in range(len(shape.starts) - 1):
        low, high = shape.starts[i], shape.starts[i + 1]
        alone = Shape(np.array([0, high - low]), shape.operators[low:high], shape.complemented[low:high])
        masked = np.full_like(times, -2 - i)  # the memory's key: no formula has such times
        masked[low:high] = times[low:high]
        logarithm = _remembered(memory, prior, alone, times[low:high], lower[low:high], upper[low:high], masked)
        bound = min(bound, -logarithm / prior.horizon)
    return bound


@njit
def _remembered(
    memory: _Memory,
    prior: PriorArrays,
    shape: Shape,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    key: NDArray[np.int64],
) -> float:
    """The log P of a formula, from memory if it is there; ``key`` stands for its times."""
    row = _find(memory.keys, key, lower, upper)
    if row < 0:
        row = -1 - row
        memory.values[row] = log_probability(prior, shape, times, lower, upper)
    return float(memory.values[row])


@njit
def _find(
    keys: NDArray[np.int64], times: NDArray[np.int64], lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> int:
    """The row of a formula in the memory; or, if it is not there, -1 - row after taking the row for it."""
    parts = (times.reshape(-1), lower.view(np.int64).reshape(-1), upper.view(np.int64).reshape(-1))
    mixed = np.int64(0)
    for part in parts:
        for number in part:
            mixed = (mixed ^ (number >> 29) ^ number) * np.int64(0x5851F42D4C957F2D)
            mixed ^= mixed >> 32
    row = int(mixed & (len(keys) - 1))
    known, at = True, 0
    for part in parts:
        for number in part:
            known = known and keys[row, at] == number
            keys[row, at] = number
            at += 1
    while at < keys.shape[1]:  # a disjunct alone has a shorter key
        known = known and keys[row, at] == -1
        keys[row, at] = -1
        at += 1
    return row if known else -1 - row
