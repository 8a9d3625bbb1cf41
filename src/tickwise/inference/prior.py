"""Prior distributions G_L over trajectories (Section III-A), as chains that dynamic programming can walk.

Every prior answers two questions. ``chain(predicates)`` gives a small weighted graph whose states carry the
truth of the predicates; it is what the reference computation walks. ``arrays(variables)`` gives plain
arrays for the compiled search, in which the predicates change at every evaluation.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tickwise._arrays import read_only
from tickwise.errors import ConfigurationError, DataError, UnknownVariableError
from tickwise.inference.kernels import PriorArrays
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Box, Not


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """A distribution over state paths of L+1 states, normalised at every tick so that nothing overflows.

    The probability that a path passes tick t in state s after the weight ``f`` (a product of ``initial`` and of
    steps ``weights / scale``) is ``f * backward[t, s]``; at any tick these sum to one.

    Attributes:
        initial: Weight of each state at tick 0, shape ``(states,)``.
        indptr: CSR row pointers, shape ``(states + 1,)``.
        indices: CSR successors.
        weights: CSR weights of the steps.
        scale: What a step's weight is divided by at each tick, shape ``(horizon,)``.
        backward: Weight of all continuations up to the horizon, shape ``(horizon + 1, states)``; 1 at the horizon.
        letters: Truth of the predicates in each state: bit j is set iff predicate j holds, shape ``(states,)``.
    """

    initial: NDArray[np.float64]
    indptr: NDArray[np.int64]
    indices: NDArray[np.int64]
    weights: NDArray[np.float64]
    scale: NDArray[np.float64]
    backward: NDArray[np.float64]
    letters: NDArray[np.int64]

    @property
    def horizon(self) -> int:
        """The last tick L."""
        return len(self.scale)


class Prior(Protocol):
    """What the information gain needs of a prior distribution."""

    @property
    def horizon(self) -> int:
        """The last tick L of a trajectory of L+1 states."""
        ...

    def chain(self, predicates: Sequence[Box | Not]) -> Chain:
        """The chain with the letters of these predicates."""
        ...

    def arrays(self, variables: Sequence[str]) -> PriorArrays:
        """Plain arrays for the compiled kernels, coordinates in the order of ``variables``."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class _Graph:
    """Initial weights and a CSR step matrix over states with coordinates."""

    initial: NDArray[np.float64]
    indptr: NDArray[np.int64]
    indices: NDArray[np.int64]
    weights: NDArray[np.float64]
    coordinates: NDArray[np.float64]
    variables: tuple[str, ...]
    scale: NDArray[np.float64]
    backward: NDArray[np.float64]
    forward: NDArray[np.float64]
    most: float

    def chain(self, predicates: Sequence[Box | Not]) -> Chain:
        letters = np.zeros(len(self.initial), dtype=np.int64)
        for bit, predicate in enumerate(predicates):
            _require(predicate.variables, self.variables)
            letters |= holds(predicate, self.coordinates, self.variables).astype(np.int64) << bit
        return Chain(self.forward[0], self.indptr, self.indices, self.weights, self.scale, self.backward, letters)

    def arrays(self, variables: Sequence[str]) -> PriorArrays:
        _require(variables, self.variables)
        columns = [self.variables.index(name) for name in variables]
        none = np.zeros(0)
        arrays: tuple[NDArray[Any], ...] = (
            np.ascontiguousarray(self.coordinates[:, columns]), self.indptr, self.indices, self.weights, self.scale,
            self.backward, self.forward, none, none,
        )  # fmt: skip
        return PriorArrays(False, len(self.scale), self.most, *map(read_only, arrays))


def _require(wanted: Sequence[str], known: Sequence[str]) -> None:
    for name in wanted:
        if name not in known:
            raise UnknownVariableError(f"the prior has no variable {name!r}; it has {', '.join(known)}")


def _check_horizon(horizon: int) -> None:
    if isinstance(horizon, bool) or not isinstance(horizon, (int, np.integer)) or horizon < 1:
        raise ConfigurationError(f"a prior's horizon is {horizon!r}; use a whole number of ticks, 1 or more")


def _graph(
    initial: NDArray[np.float64],
    csr: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]],
    coordinates: ArrayLike,
    variables: Sequence[str],
    horizon: int,
) -> _Graph:
    _check_horizon(horizon)
    indptr, indices, weights = csr
    places = np.array(coordinates, dtype=np.float64)
    if places.shape != (len(initial), len(variables)) or not np.isfinite(places).all():
        raise DataError(
            f"coordinates have shape {places.shape} for {len(initial)} states and {len(variables)} variables; "
            "give one finite row per state"
        )
    sources = np.repeat(np.arange(len(initial)), np.diff(indptr))
    backward = np.ones((horizon + 1, len(initial)))
    scale = np.ones(horizon)
    costs = np.zeros(len(initial))
    for tick in range(horizon - 1, -1, -1):
        step = weights * backward[tick + 1, indices]
        row = np.bincount(sources, weights=step, minlength=len(initial))
        if not row.any():
            raise DataError(f"the prior has no path of {horizon + 1} states; add steps, or use a shorter horizon")
        scale[tick] = row.max()
        backward[tick] = row / scale[tick]
        with np.errstate(divide="ignore"):
            # the cost -log of the least probable path from each state, in units of the scaled weights
            step_costs = np.where(step > 0, costs[indices] - np.log(weights) + np.log(scale[tick]), -np.inf)
        costs = np.full(len(initial), -np.inf)
        np.maximum.at(costs, sources, step_costs)
    total = float(initial @ backward[0])
    if total <= 0:
        raise DataError(f"no path of {horizon + 1} states starts with a positive weight; change the initial weights")
    forward = np.empty((horizon + 1, len(initial)))
    forward[0] = initial / total
    for tick in range(horizon):
        step = weights * forward[tick, sources] / scale[tick]
        forward[tick + 1] = np.bincount(indices, weights=step, minlength=len(initial))
    started = initial > 0
    most = float((costs[started] - np.log(forward[0][started])).max()) / horizon
    graph = _Graph(initial, indptr, indices, weights, places, tuple(variables), scale, backward, forward, most)
    for array in (initial, indptr, indices, weights, places, scale, backward, forward):
        array.flags.writeable = False
    return graph


def _csr(matrix: Any, what: str) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """CSR of a dense matrix, a CSR pair ``(indptr, indices)`` or a triple with weights."""
    if isinstance(matrix, tuple):
        indptr, indices = (np.array(part, dtype=np.int64) for part in matrix[:2])
        weights = np.array(matrix[2], dtype=np.float64) if len(matrix) == 3 else np.ones(len(indices))
        states = len(indptr) - 1
        good = states > 0 and indptr[0] == 0 and indptr[-1] == len(indices) == len(weights)
        if not (good and (np.diff(indptr) >= 0).all() and ((indices >= 0) & (indices < states)).all()):
            raise DataError(f"the {what} is not a CSR matrix; give (indptr, indices) of a square matrix")
    else:
        dense = np.asarray(matrix, dtype=np.float64)
        if dense.ndim != 2 or dense.shape[0] != dense.shape[1] or not len(dense):
            raise DataError(f"the {what} has shape {dense.shape}; use a square matrix")
        rows, indices = (part.astype(np.int64) for part in np.nonzero(dense))
        indptr = np.searchsorted(rows, np.arange(len(dense) + 1)).astype(np.int64)
        weights = dense[rows, indices]
    rows = np.repeat(np.arange(len(indptr) - 1), np.diff(indptr))
    order = np.lexsort((indices, rows))  # the kernels rely on sorted successors
    indices, weights = indices[order], weights[order]
    if not (np.isfinite(weights) & (weights >= 0)).all():
        raise DataError(f"the {what} has a weight that is negative or not finite; use weights of 0 or more")
    return indptr, indices, weights


@dataclass(frozen=True, slots=True, eq=False)
class PathPrior:
    """The uniform distribution over all paths of a support graph (the paper's choice of G_L).

    Attributes:
        adjacency: Which steps are possible: a dense 0/1 matrix, shape ``(states, states)``, or a CSR pair
            ``(indptr, indices)``.
        coordinates: Where each state lies, shape ``(states, variables)``, in world units.
        variables: Names of the coordinates.
        horizon: The last tick L; a path has L+1 states and may start anywhere.

    Raises:
        DataError: If a shape does not fit or there is no path that long.
        ConfigurationError: If the horizon is less than 1.
    """

    adjacency: Any
    coordinates: ArrayLike
    variables: Sequence[str] = ("x", "y")
    horizon: int = 40
    _graph: _Graph = field(init=False, repr=False)

    def __post_init__(self) -> None:
        indptr, indices, weights = _csr(self.adjacency, "adjacency")
        kept = np.ones(len(weights)) if (weights == 1).all() else None
        if kept is None:
            raise DataError("the adjacency has entries other than 0 and 1; use MarkovPrior for weighted steps")
        initial = np.ones(len(indptr) - 1)
        graph = _graph(initial, (indptr, indices, kept), self.coordinates, self.variables, self.horizon)
        object.__setattr__(self, "_graph", graph)

    def chain(self, predicates: Sequence[Box | Not]) -> Chain:
        """The chain over the graph's states, with backward path counts."""
        return self._graph.chain(predicates)

    def arrays(self, variables: Sequence[str]) -> PriorArrays:
        """Plain arrays for the compiled kernels."""
        return self._graph.arrays(variables)


@dataclass(frozen=True, slots=True, eq=False)
class MarkovPrior:
    """The distribution of a Markov chain.

    Attributes:
        initial: Probability of each state at tick 0, shape ``(states,)``.
        transition: Step probabilities, a dense matrix with rows that sum to 1 or a CSR triple
            ``(indptr, indices, weights)``.
        coordinates: Where each state lies, shape ``(states, variables)``.
        variables: Names of the coordinates.
        horizon: The last tick L.

    Raises:
        DataError: If a shape does not fit, or probabilities do not sum to 1.
        ConfigurationError: If the horizon is less than 1.
    """

    initial: ArrayLike
    transition: Any
    coordinates: ArrayLike
    variables: Sequence[str] = ("x", "y")
    horizon: int = 40
    _graph: _Graph = field(init=False, repr=False)

    def __post_init__(self) -> None:
        csr = _csr(self.transition, "transition matrix")
        start = np.array(self.initial, dtype=np.float64)
        if start.shape != (len(csr[0]) - 1,) or not (start >= 0).all() or not math.isclose(start.sum(), 1.0):
            raise DataError(f"initial probabilities sum to {start.sum():g}; give one per state, with sum 1")
        sources = np.repeat(np.arange(len(start)), np.diff(csr[0]))
        sums = np.bincount(sources, weights=csr[2], minlength=len(start))
        if not np.allclose(sums, 1.0):
            row = int(np.argmax(~np.isclose(sums, 1.0)))
            raise DataError(f"row {row} of the transition matrix sums to {sums[row]:g}; make every row sum to 1")
        graph = _graph(start, csr, self.coordinates, self.variables, self.horizon)
        object.__setattr__(self, "_graph", graph)

    def chain(self, predicates: Sequence[Box | Not]) -> Chain:
        """The chain over the given states."""
        return self._graph.chain(predicates)

    def arrays(self, variables: Sequence[str]) -> PriorArrays:
        """Plain arrays for the compiled kernels."""
        return self._graph.arrays(variables)


@dataclass(frozen=True, slots=True, eq=False)
class BoxPrior:
    """Independent uniform draws from a box at every tick: a prior for continuous data.

    Attributes:
        bounds: The range ``(lo, hi)`` of each variable, in world units.
        horizon: The last tick L.

    Raises:
        DataError: If a range is empty, reversed or not finite, or there is none.
        ConfigurationError: If the horizon is less than 1.
    """

    bounds: Mapping[str, tuple[float, float]]
    horizon: int

    def __post_init__(self) -> None:
        _check_horizon(self.horizon)
        if not self.bounds:
            raise DataError("a box prior has no variable; give at least one range")
        ranges = {name: (float(low), float(high)) for name, (low, high) in self.bounds.items()}
        for name, (low, high) in ranges.items():
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise DataError(f"the prior's range of {name!r} is [{low:g},{high:g}]; use finite numbers, lo < hi")
        object.__setattr__(self, "bounds", ranges)

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the variables, in order."""
        return tuple(self.bounds)

    def chain(self, predicates: Sequence[Box | Not]) -> Chain:
        """The chain whose states are the joint truth assignments of the predicates that have a positive measure.

        The box is cut along every threshold; within a cell of this grid no predicate changes, so the measure of an
        assignment is the exact sum of its cells.
        """
        for predicate in predicates:
            _require(predicate.variables, self.variables)
        named = [name for name in self.variables if any(name in predicate.variables for predicate in predicates)]
        cuts = [self._cuts(name, predicates) for name in named]
        centres = [(edges[:-1] + edges[1:]) / 2 for edges in cuts]
        shares = [np.diff(edges) / (edges[-1] - edges[0]) for edges in cuts]
        points = np.array(list(itertools.product(*centres)), dtype=np.float64).reshape(-1, len(named))
        measure = np.array([math.prod(cell) for cell in itertools.product(*shares)])
        cells = np.zeros(len(points), dtype=np.int64)
        for bit, predicate in enumerate(predicates):
            cells |= holds(predicate, points, named).astype(np.int64) << bit
        letters, inverse = np.unique(cells, return_inverse=True)
        weights = np.bincount(inverse, weights=measure).astype(np.float64)
        n = len(letters)
        return Chain(
            weights, np.arange(n + 1) * n, np.tile(np.arange(n), n), np.tile(weights, n), np.ones(self.horizon),
            np.ones((self.horizon + 1, n)), letters,
        )  # fmt: skip

    def _cuts(self, name: str, predicates: Sequence[Box | Not]) -> NDArray[np.float64]:
        low, high = self.bounds[name]
        cuts = {low, high}
        for predicate in predicates:
            box = predicate.operand if isinstance(predicate, Not) else predicate
            if isinstance(box, Box):
                ends = (end for bound in box.bounds if bound.variable == name for end in (bound.lower, bound.upper))
                cuts.update(end for end in ends if low < end < high)
        return np.array(sorted(cuts))

    def arrays(self, variables: Sequence[str]) -> PriorArrays:
        """Plain arrays for the compiled kernels."""
        _require(variables, self.variables)
        low, high = (np.array([self.bounds[name][side] for name in variables]) for side in (0, 1))
        whole, real, grid = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 0))
        arrays: tuple[NDArray[Any], ...] = (grid, whole, whole, real, real, grid, grid, low, high)
        return PriorArrays(True, self.horizon, math.inf, *map(read_only, arrays))
