"""A formula whose primitives are searched exactly one at a time, the others held."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.bounding import TIE
from tickwise.inference.counting import log_probability
from tickwise.inference.exact import ExactProblem, ExactResult, ExactSettings, improve
from tickwise.inference.kernels import Shape
from tickwise.inference.levels import Coded, Levels, code
from tickwise.inference.objective import formula_signature
from tickwise.inference.prior import Prior
from tickwise.inference.scan import Worth
from tickwise.inference.slot import Slot
from tickwise.inference.space import OPERATORS, SearchSpace, least_span, shape_of, to_arrays
from tickwise.inference.support import possible
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction

_ROUNDS = 50  # of the ascent; each round but the last makes the formula better or simpler


@dataclass(frozen=True, slots=True)
class Choice:
    """What the primitive in one place of a formula may be.

    Attributes:
        operators: The operators: one, or all four.
        polarities: Whether its box may be complemented.
    """

    operators: tuple[Operator, ...] = OPERATORS
    polarities: tuple[bool, ...] = (False, True)

    @property
    def kinds(self) -> list[tuple[bool, bool]]:
        """The pairs of `exact.KINDS` that are allowed."""
        existential = dict.fromkeys(
            operator in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS) for operator in self.operators
        )
        return list(itertools.product(existential, self.polarities))

    @property
    def span(self) -> int:
        """Ticks that it needs at least."""
        return min(least_span(operator.nested) for operator in self.operators) + 1


FREE = Choice()
"""Any primitive."""

Structure = tuple[tuple[Choice, ...], ...]
Draft = tuple[tuple[Primitive | None, ...], ...]
"""For each disjunct its primitives in order, None in the places that are not filled yet."""


def filled(draft: Draft, i: int, j: int, primitive: Primitive | None) -> Draft:
    """The draft with a primitive in place j of disjunct i."""
    row = (*draft[i][:j], primitive, *draft[i][j + 1 :])
    return (*draft[:i], row, *draft[i + 1 :])


def structure_of(pairs: Sequence[Sequence[tuple[Operator, bool]]]) -> Structure:
    """The structure whose operators and polarities are given, a row of pairs a disjunct."""
    return tuple(tuple(Choice((operator,), (flag,)) for operator, flag in row) for row in pairs)


def draft_of(formula: SDNF) -> Draft:
    """The draft of a formula."""
    return tuple(tuple(disjunct.primitives) for disjunct in formula.disjuncts)


def formula_of(draft: Draft) -> SDNF:
    """The formula of a draft, places that are not filled left out."""
    rows = [tuple(primitive for primitive in row if primitive is not None) for row in draft]
    return SDNF(tuple(SequentialConjunction(row) for row in rows if row))


@dataclass(slots=True)
class Interruption:
    """Whether Ctrl-C has ended a search; one for all that work on the same formula."""

    happened: bool = False


@dataclass(eq=False)
class Drafter:
    """Fills and improves the places of drafts.

    Attributes:
        data: The labelled trajectories.
        weights: The weight of each in the classification rate, shape ``(n,)``.
        prior: The prior G_L.
        space: What boxes and times may be chosen.
        information_weight: λ.
        nesting_cost: What each nested operator costs where operators are free, in units of J.
        settings: The limits of each exact search.
        interruption: Whether Ctrl-C has ended a search: then all that follow are left out.
    """

    data: LabelledTrajectories
    weights: NDArray[np.float64]
    prior: Prior
    space: SearchSpace
    information_weight: float
    nesting_cost: float
    settings: ExactSettings
    interruption: Interruption = field(default_factory=Interruption)
    _signatures: dict[Primitive, NDArray[np.bool_]] = field(default_factory=dict, repr=False)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C has ended a search."""
        return self.interruption.happened

    @cached_property
    def levels(self) -> Levels:
        """The levels of the box sides."""
        return Levels.of(self.space, self.data, self.settings.levels)

    @cached_property
    def coded(self) -> Coded:
        """The trajectories, coded by the levels."""
        return code(self.data, self.weights, self.levels, self.space.horizon)

    @cached_property
    def supported(self) -> bool:
        """Whether all trajectories with label 1 are possible under the prior."""
        good = self.data.labels == 1
        arrays = self.prior.arrays(self.data.variables)
        return not good.any() or possible(arrays, self.data.values[good], self.data.lengths[good])

    def part(self, mask: NDArray[np.bool_], negatives: float) -> Drafter:
        """The same for some of the trajectories, those with label -1 weighing so many times what they did.

        An error and an information gain are worth to each other what they were.
        """
        weights = np.where(self.data.labels == 1, 1.0, negatives)[mask] * self.weights[mask]
        share = float(self.weights.sum() / weights.sum())
        weight, cost = self.information_weight * share, self.nesting_cost * share
        part = self.data.select(mask)
        return Drafter(part, weights, self.prior, self.space, weight, cost, self.settings, self.interruption)

    def signature(self, primitive: Primitive) -> NDArray[np.bool_]:
        """Whether each trajectory satisfies a primitive (the weak view), shape ``(n,)``."""
        if primitive not in self._signatures:
            whole = SDNF((SequentialConjunction((primitive,)),))
            self._signatures[primitive] = formula_signature(whole, self.data)
        return self._signatures[primitive]

    def value(self, draft: Draft) -> float:
        """J of a draft whose places are all filled, less what its nested operators cost."""
        if self.information_weight == 0:
            return self.rate(draft) - self.cost(draft)
        rate, gain = self.parts(draft)
        return rate + self.information_weight * gain - self.cost(draft)

    def parts(self, draft: Draft) -> tuple[float, float]:
        """Classification rate and information gain of a draft whose places are all filled."""
        arrays = to_arrays(formula_of(draft), self.data.variables)
        logarithm = float(log_probability(self.prior.arrays(self.data.variables), *arrays))
        return self.rate(draft), 0.0 if math.isinf(logarithm) else -logarithm / self.prior.horizon + 0.0

    @cached_property
    def alike(self) -> float:
        """The classification rate of the best formula that classifies all trajectories alike."""
        good = float(self.weights[self.data.labels == 1].sum() / self.weights.sum())
        return max(good, 1.0 - good)

    @cached_property
    def trivial(self) -> float:
        """What a formula has to be worth at least to be better than one that classifies all trajectories alike."""
        most = self.prior.arrays(self.data.variables).most
        return self.alike + TIE + (self.information_weight * most if math.isfinite(most) else 0.0)

    def satisfied(self, draft: Draft) -> NDArray[np.bool_]:
        """Whether each trajectory satisfies a draft, empty places left out (the weak view), shape ``(n,)``."""
        result: NDArray[np.bool_] = np.logical_or.reduce([self._all_of(row) for row in draft])
        return result

    def rate(self, draft: Draft) -> float:
        """The classification rate of a draft."""
        right = self.satisfied(draft) == (self.data.labels == 1)
        return float(self.weights[right].sum() / self.weights.sum())

    def place(
        self,
        draft: Draft,
        structure: Structure,
        i: int,
        j: int,
        *,
        positives: float = 1.0,
        least: float = -math.inf,
    ) -> ExactResult | None:
        """The best primitive for place j of disjunct i, all others held.

        Args:
            draft: The draft; what is in the place is not read.
            structure: What each place may hold.
            i: The disjunct.
            j: The place in it.
            positives: How many times their weight trajectories with label 1 count; more than once where other
                places are still empty, since what one primitive of a conjunction rejects no other gets back.
            least: The least `value` of the draft with it.

        Returns:
            What the exact search found; None if there is no room, or nothing that is worth so much, or Ctrl-C came
            before there was anything.
        """
        choice = structure[i][j]
        gap = self._gap(draft, structure, i, j)
        if self.interrupted or gap[1] - gap[0] + 1 < choice.span:
            return None
        others = self._all_of(filled(draft, i, j, None)[i])
        elsewhere = np.zeros(len(self.data), dtype=np.bool_)
        for k, row in enumerate(draft):
            if k != i and None not in row:
                elsewhere |= self._all_of(row)
        matters = others & ~elsewhere
        good = self.data.labels == 1
        weights = np.where(good, positives, 1.0) * self.weights
        share = float(self.weights.sum() / weights.sum())
        nested = {operator.nested for operator in choice.operators}
        worth = Worth(
            float(weights[~matters & (elsewhere == good)].sum()), float(weights.sum()), False in nested, True in nested,
            self.nesting_cost * share, self.information_weight * share,
        )  # fmt: skip
        coded = self.coded._replace(weights=weights).select(matters)
        problem = ExactProblem(
            coded, self.levels, self.prior, (gap,), worth, choice.kinds, self._slot(draft, i, j), self.supported
        )
        try:
            found = improve(problem, self.settings, least + self.cost(filled(draft, i, j, None)))
        except KeyboardInterrupt:
            self.interruption.happened = True
            return None
        self.interruption.happened = found is not None and found.interrupted
        return found

    def ascend(self, draft: Draft, structure: Structure) -> tuple[Draft, float]:
        """Search each primitive anew with the others held, until none gets better, or as good and simpler.

        A formula that is not better than a trivial one is left as it is: there are too many such.

        Returns:
            The draft and its `value`.
        """
        value = self.value(draft)
        places = [(i, j) for i, row in enumerate(draft) for j in range(len(row))]
        last, at = len(places), 0
        for step in range(_ROUNDS * len(places)):
            i, j = places[at]
            found = self.place(draft, structure, i, j, least=max(value, self.trivial))
            if found is not None and found.primitive != draft[i][j]:
                better = filled(draft, i, j, found.primitive)
                gained = self.value(better) - value
                if gained > TIE or (gained >= -TIE and _sides(better) < _sides(draft)):
                    draft, value, last = better, value + gained, step + len(places)
            if step >= last:
                break
            at = (at + 1) % len(places)
        return draft, value

    def _all_of(self, row: Sequence[Primitive | None]) -> NDArray[np.bool_]:
        result = np.ones(len(self.data), dtype=np.bool_)
        for primitive in row:
            if primitive is not None:
                result &= self.signature(primitive)
        return result

    def cost(self, draft: Draft) -> float:
        """What the nested operators of a draft cost."""
        return self.nesting_cost * sum(p is not None and p.operator.nested for row in draft for p in row)

    def _gap(self, draft: Draft, structure: Structure, i: int, j: int) -> tuple[int, int]:
        """The ticks between the neighbours of a place, with room left for places between that are not filled yet."""
        low, high = 0, self.space.horizon
        for k in range(j):
            primitive = draft[i][k]
            low = low + structure[i][k].span if primitive is None else primitive.end + 1
        for k in range(len(draft[i]) - 1, j, -1):
            primitive = draft[i][k]
            high = high - structure[i][k].span if primitive is None else primitive.start - 1
        return low, high

    def _rows(self, primitive: Primitive) -> tuple[Shape, NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        shape, times, lower, upper = to_arrays(SDNF((SequentialConjunction((primitive,)),)), self.data.variables)
        return shape, times[0], lower[0], upper[0]

    def _slot(self, draft: Draft, i: int, j: int) -> Slot:
        """The formula without the places that are not filled yet."""
        width, index, pairs = len(self.data.variables), 0, []
        times, lower, upper = list[NDArray[np.int64]](), list[NDArray[np.float64]](), list[NDArray[np.float64]]()
        for row, primitives in enumerate(draft):
            kept = []
            for column, primitive in enumerate(primitives):
                if (row, column) == (i, j):
                    index = len(times)
                    kept.append((Operator.EVENTUALLY, False))
                    times.append(np.zeros(3, np.int64))
                    lower.append(np.zeros(width))
                    upper.append(np.zeros(width))
                elif primitive is not None:
                    kept.append((primitive.operator, primitive.complemented))
                    _, when, low, high = self._rows(primitive)
                    times.append(when)
                    lower.append(low)
                    upper.append(high)
            if kept:
                pairs.append(kept)
        return Slot(shape_of(pairs), np.array(times), np.array(lower), np.array(upper), index)


def _sides(draft: Draft) -> int:
    """How many sides of boxes are closed."""
    bounds = [bound for row in draft for p in row if p is not None for bound in p.box.bounds]
    return sum(math.isfinite(bound.lower) + math.isfinite(bound.upper) for bound in bounds)


def coarser(drafter: Drafter, levels: int) -> Drafter:
    """The same with fewer levels of continuous variables; itself where there are none."""
    if not any(drafter.space.continuous) or drafter.settings.levels <= levels:
        return drafter
    return replace(drafter, settings=replace(drafter.settings, levels=levels), _signatures=drafter._signatures)
