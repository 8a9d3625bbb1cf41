"""Exact search of a primitive: the greatest J over all boxes, windows and durations in Υ_z, proved by branch and bound.

A node of the search is a range of boxes of one polarity under ◇ and ◇□ or under □ and □◇; `scan.bound` bounds J over
all of it, windows and durations included. The node with the greatest bound is split until a single box is on top. Its
windows and durations that can still win get their information gain exactly. The search ends when the best primitive
found is worth at least every bound left: it is then proved to be the best.

Of primitives of equal J (to 12 decimals) the first wins by: the fewest closed sides of continuous variables; ◇ and □
before ◇□ and □◇; the plain box before its complement; the tightest predicate, variable by variable; ◇ and ◇□ before □
and □◇; the tightest times, the duration first and then the window's start.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError
from tickwise.inference.bounding import BATCH, TIE, Bounded, Bounds, Clock
from tickwise.inference.boxes import (
    Node,
    box_of,
    first_key,
    outermost,
    ranges,
    root,
    single,
    split,
    tighter,
)
from tickwise.inference.gains import gain_bound
from tickwise.inference.kernels import EVENTUALLY_ALWAYS, Shape
from tickwise.inference.levels import WORD, Coded, Levels
from tickwise.inference.prior import Prior
from tickwise.inference.scan import Worth, candidates
from tickwise.inference.signals import weigh
from tickwise.inference.slot import Slot
from tickwise.inference.space import OPERATORS, Gaps, to_formula
from tickwise.inference.support import lasting
from tickwise.logic.sdnf import Operator, Primitive

_FEW = 1000  # trajectories that are weighed sooner than a probability is computed
_DIVES = 32  # batches that also look at a box of the best node, so that a search that is stopped has something good

KINDS = tuple(itertools.product((True, False), (False, True)))
"""Whether the operator is ◇ or ◇□, and whether the box is complemented."""


@dataclass(frozen=True, slots=True)
class ExactSettings:
    """The limits of an exact search; within them the result is proved.

    Attributes:
        levels: The most thresholds of a continuous variable.
        seconds: The most time one search may take; None for as long as it takes.
        nodes: The most nodes it may hold at a time, some 300 bytes each.
        threads: Threads that bound nodes side by side; the result does not depend on it.
        joint: Whether all primitives of a formula are found together (see `tickwise.inference.growth`), rather than one
            after the other by the greedy tree of Algorithm 1.
        certificate: How long a fit of a structure of several primitives may try to prove that no other parameters are
            better, in seconds (see `tickwise.inference.certificate`); 0 leaves it out.

    Raises:
        ConfigurationError: If a limit is out of its range.
    """

    levels: int = 32
    seconds: float | None = None
    nodes: int = 2_000_000
    threads: int = 1
    joint: bool = False
    certificate: float = 0.0

    def __post_init__(self) -> None:
        for name in ("levels", "nodes", "threads"):
            if getattr(self, name) < 1:
                raise ConfigurationError(f"exact setting {name} is {getattr(self, name)}; use 1 or more")
        if self.seconds is not None and not self.seconds > 0:
            raise ConfigurationError(f"exact setting seconds is {self.seconds}; use a number above 0, or None")
        if not self.certificate >= 0:
            raise ConfigurationError(f"exact setting certificate is {self.certificate}; use 0 seconds or more")


@dataclass(frozen=True, slots=True)
class ExactResult(Bounded):
    """What an exact search found.

    Attributes:
        primitive: The best primitive.
        objective: J of the formula with it.
        rate: Its classification rate CR.
        gain: Its information gain I.
        value: J less the cost of a nested operator, which the search maximises.
        bound: No primitive of the space is worth more than this.
        nodes: How many nodes were bounded.
        interrupted: Whether Ctrl-C ended the search.
    """

    primitive: Primitive
    objective: float
    rate: float
    gain: float
    value: float
    bound: float
    nodes: int
    interrupted: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ExactProblem:
    """What an exact search looks for.

    Attributes:
        coded: The trajectories that the primitive decides on.
        levels: The levels of the box sides.
        prior: The prior G_L.
        gaps: Free intervals of ticks, so that θ is in Υ_z.
        worth: What counts beside the trajectories.
        kinds: Pairs of `KINDS` that are allowed.
        slot: The formula that the primitive is part of; None for the primitive alone.
        supported: Whether each trajectory with label 1 is known to be possible under the prior.
    """

    coded: Coded
    levels: Levels
    prior: Prior
    gaps: Gaps
    worth: Worth
    kinds: Sequence[tuple[bool, bool]] = KINDS
    slot: Slot | None = None
    supported: bool = False


def worth_of(
    coded: Coded, information_weight: float, nesting_cost: float = 0.0, operators: Sequence[Operator] = OPERATORS
) -> Worth:
    """What counts where the primitive decides on all trajectories.

    Args:
        coded: The trajectories.
        information_weight: λ.
        nesting_cost: What ◇□ and □◇ cost, in units of J.
        operators: The operators that are allowed.

    Returns:
        The constants of `ExactProblem`.
    """
    nested = {operator.nested for operator in operators}
    return Worth(0.0, float(coded.weights.sum()), False in nested, True in nested, nesting_cost, information_weight)


def exact_search(problem: ExactProblem, settings: ExactSettings) -> ExactResult:
    """Find the best primitive: line 11 of Algorithm 1, exactly.

    Args:
        problem: What to look for.
        settings: The limits.

    Returns:
        The best primitive; see `ExactResult.proved`. Ctrl-C, once there is a primitive, ends the search with the
        best so far.

    Raises:
        ConfigurationError: If no gap has room for a window.
        UnknownVariableError: If the prior lacks a variable.
    """
    if not any(high - low >= (1 if problem.worth.plain else 2) for low, high in problem.gaps):
        raise ConfigurationError("no gap has room for a window of two ticks; use a longer horizon")
    found = _Search(problem, settings, -math.inf).run()
    if found is None:
        raise ConfigurationError("no box has a side; give levels that tell the values of a variable apart")
    return found


def improve(problem: ExactProblem, settings: ExactSettings, least: float) -> ExactResult | None:
    """Find the best primitive of those that are worth at least so much, sooner than `exact_search` finds the best.

    Args:
        problem: What to look for.
        settings: The limits.
        least: The least worth, in units of J.

    Returns:
        The best primitive; None if none is worth so much, or none was found within the limits. Ctrl-C ends the search
        with the best so far, once there is one.
    """
    return _Search(problem, settings, least).run()


@dataclass(slots=True)
class _Best:
    """The best primitive so far; the key says which of equal ones is first."""

    value: float
    key: tuple[float, ...] = (math.inf,)
    node: Node | None = None
    times: NDArray[np.int64] = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    weight: float = 0.0
    logarithm: float = 0.0

    def beaten_by(self, value: float, key: tuple[float, ...]) -> bool:
        """Whether a primitive of this value and key comes before it."""
        return value > self.value + TIE or (value >= self.value - TIE and key < self.key)


class _Search:
    def __init__(self, problem: ExactProblem, settings: ExactSettings, least: float) -> None:
        self.problem, self.settings = problem, settings
        self.sides, _ = problem.levels.arrays()
        self.prior = problem.prior.arrays(problem.levels.variables)
        self.slot = problem.slot or Slot.alone(len(problem.levels.variables))
        limits = gain_bound(self.prior, problem.levels, problem.slot)
        self.bounds = Bounds(problem.coded, problem.gaps, problem.worth, limits, settings.threads)
        self.rejected = float(problem.coded.weights[~self._decided()].sum())
        self.best = _Best(least)
        self.heap: list[tuple[float, tuple[float, ...], int, Node]] = []
        self.order = itertools.count()
        self.nodes = 0

    def run(self) -> ExactResult | None:
        clock, interrupted, bound = Clock(self.settings.seconds), False, math.inf
        with self.bounds:
            try:
                self._push([root(self.problem.levels, *kind) for kind in self.problem.kinds])
                batches = 0
                while self.heap:
                    bound = -self.heap[0][0]  # of all that is left, also while some of it is taken off the heap
                    full = len(self.heap) > self.settings.nodes
                    if (full or clock.over) and self._started:
                        break
                    self._step(dive=batches < _DIVES)
                    batches += 1
                else:
                    bound = -math.inf
            except KeyboardInterrupt:
                if self.best.node is None:
                    raise
                interrupted = True
        return None if self.best.node is None else self._result(max(bound, self.best.value), interrupted)

    @property
    def _started(self) -> bool:
        return math.isfinite(self.best.value)

    def _step(self, *, dive: bool) -> None:
        """Take the nodes with the greatest bounds: split ranges, look at single boxes."""
        children: list[Node] = []
        for _ in range(BATCH):
            self._drop_beaten()
            if not self.heap:
                break
            node = self.heap[0][-1]
            if single(node):
                if children:  # one of them may come before it
                    break
                self._look(node)
            else:
                if dive and not children:
                    self._look(outermost(node))
                children += split(node)
            heapq.heappop(self.heap)
        self._push(children)

    def _drop_beaten(self) -> None:
        """Take nodes off the top that the best so far comes before."""
        while self.heap and not self.best.beaten_by(-self.heap[0][0], self.heap[0][1]):
            if -self.heap[0][0] < self.best.value - TIE:  # as are all after it
                self.heap.clear()
            else:
                heapq.heappop(self.heap)

    def _push(self, nodes: list[Node]) -> None:
        for node, bound in zip(nodes, self.bounds(nodes), strict=True):
            key = first_key(node, self.problem.levels, nested=not self.problem.worth.plain)
            if self.best.beaten_by(bound, key):
                heapq.heappush(self.heap, (-round(bound, 13), key, next(self.order), node))
        self.nodes += len(nodes)

    def _look(self, node: Node) -> None:
        """Give the windows and durations of a single box that can win their exact value."""
        problem, worth, best = self.problem, self.problem.worth, self.best
        lower, upper = box_of(node, self.sides)
        if not (np.isfinite(lower) | np.isfinite(upper)).any():
            return  # it says nothing
        floor = self._floor(node)
        enough = best.value - TIE
        found = candidates(problem.coded, node, *self.bounds.arguments, enough, floor)
        informed = worth.information_weight > 0
        few = len(problem.coded.positive) <= _FEW
        near_ones = tighter(node, problem.levels) if informed and few and best.node is not None else ()
        neighbours = [(near, self._floor(near)) for near in near_ones]
        for k in np.argsort(-found[2], kind="stable"):
            times, weight, most = found[0][k], float(found[1][k]), float(found[2][k])
            if most < best.value - TIE:
                break
            if any(self._weigh(near, times) >= max(weight, np.nextafter(least, np.inf)) for near, least in neighbours):
                continue
            logarithm = self._log_probability(node, times, lower, upper) if informed else 0.0
            value = self._value(times, weight, logarithm)
            key = (*first_key(node, problem.levels, nested=times[2] > 0), *_times_key(node, times))
            if best.beaten_by(value, key):
                best = self.best = _Best(value, key, node, times, weight, logarithm)

    def _value(self, times: NDArray[np.int64], weight: float, logarithm: float) -> float:
        worth = self.problem.worth
        rate = (worth.base + weight) / worth.total
        cost = worth.nesting_cost if times[2] else 0.0
        return rate + worth.information_weight * self._gain(logarithm) - cost

    def _gain(self, logarithm: float) -> float:
        return 0.0 if math.isinf(logarithm) else -logarithm / self.problem.prior.horizon + 0.0

    def _weigh(self, node: Node, times: NDArray[np.int64]) -> float:
        return float(weigh(self.problem.coded, node[0] == 1, node[1] == 1, ranges(node)[:, 0].reshape(-1), times))

    def _decided(self) -> NDArray[np.bool_]:
        """The trajectories with label 1 that do not end before the formula's last tick."""
        ends = np.delete(self.slot.times[:, 1] + self.slot.times[:, 2], self.slot.index)
        last = max(*(high for _, high in self.problem.gaps), 0, *ends.tolist())
        word, bit = last // WORD, np.uint64(1 << last % WORD)
        alive: NDArray[np.bool_] = (self.problem.coded.alive[:, word] & bit) != 0
        return alive & self.problem.coded.positive

    def _floor(self, node: Node) -> float:
        """The weight above which all of a box's primitives are known to have a positive probability."""
        if self.problem.worth.information_weight == 0:
            return -math.inf
        if len(self.slot.shape.operators) == 1 and lasting(self.prior, *box_of(node, self.sides), bool(node[1])):
            return -math.inf
        # one that is right of more than these is satisfied by a possible trajectory, and not for its early end
        return self.rejected if self.problem.supported else math.inf

    def _log_probability(
        self,
        node: Node,
        times: NDArray[np.int64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
    ) -> float:
        operator = _operator(node, times)
        return self.slot.log_probability(self.prior, operator, bool(node[1]), times, lower, upper)

    def _result(self, bound: float, interrupted: bool) -> ExactResult:
        best, worth = self.best, self.problem.worth
        assert best.node is not None
        lower, upper = box_of(best.node, self.sides)
        shape = Shape(np.array([0, 1]), np.array([_operator(best.node, best.times)]), np.array([best.node[1] == 1]))
        formula = to_formula(self.problem.levels.variables, shape, best.times[None], lower[None], upper[None])
        rate, logarithm = (worth.base + best.weight) / worth.total, best.logarithm
        if worth.information_weight == 0:
            logarithm = self._log_probability(best.node, best.times, lower, upper)
        gain = self._gain(logarithm)
        objective = rate + worth.information_weight * gain
        return ExactResult(
            formula.disjuncts[0].primitives[0], objective, rate, gain, best.value, bound, self.nodes, interrupted
        )


def _times_key(node: Node, times: NDArray[np.int64]) -> tuple[int, ...]:
    """The tightest times first: the longest run wanted of ◇ and ◇□, the shortest of □ and □◇."""
    start, end, duration = times.tolist()
    return (-duration, -start, end) if node[0] else (duration, start, -end)


def _operator(node: Node, times: NDArray[np.int64]) -> int:
    """The compiled code of ◇, □, ◇□ or □◇."""
    return (0 if node[0] else 1) + (EVENTUALLY_ALWAYS if times[2] else 0)
