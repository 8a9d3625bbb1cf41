"""How much better a formula of the same structure can be at most: branch and bound over all its parameters together.

The ascent of `tickwise.inference.joint` changes one primitive at a time; nothing says that its formula is the best.
Here rectangles of parameters of all primitives (see `tickwise.inference.rectangles`) are split, the one with the
greatest bound first, until no bound is above the best formula known, or time is up. Either way no formula of the
structure, its box sides among the levels, is worth more than the greatest bound that is left.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.bounding import BATCH, TIE, Bounded, Clock
from tickwise.inference.draft import Draft, Drafter, Structure, draft_of
from tickwise.inference.gains import gain_bound
from tickwise.inference.rectangles import LEAST, Formulas, Rectangle, bound, everything, expand, is_single, tighten
from tickwise.inference.space import shape_of, to_formula


@dataclass(frozen=True, slots=True)
class Certificate(Bounded):
    """What is known of the best formula of a structure.

    Attributes:
        draft: The best formula known.
        value: What it is worth, as `Drafter.value` has it.
        bound: No formula of the structure is worth more than this.
        rectangles: How many rectangles were bounded.
        interrupted: Whether Ctrl-C ended the search.
    """

    draft: Draft
    value: float
    bound: float
    rectangles: int
    interrupted: bool = False


def certify(drafter: Drafter, structure: Structure, draft: Draft, seconds: float | None = None) -> Certificate:
    """Bound what any formula of a structure is worth, and look for one that is worth more than the best known.

    Args:
        drafter: The data and what counts; its limits say how many rectangles may be held at a time.
        structure: The structure, one operator and one polarity in every place.
        draft: The best formula known.
        seconds: How long to look at most; None for as long as it takes.

    Returns:
        The bound, and the best formula.
    """
    return _Search(drafter, structure, draft).run(seconds)


class _Search:
    def __init__(self, drafter: Drafter, structure: Structure, draft: Draft) -> None:
        self.drafter, self.draft, self.value = drafter, draft, drafter.value(draft)
        self.shape = shape_of([[(choice.operators[0], choice.polarities[0]) for choice in row] for row in structure])
        levels, horizon = drafter.levels, drafter.space.horizon
        prior = drafter.prior.arrays(levels.variables)
        self.formulas = Formulas(
            drafter.coded, self.shape, levels.arrays()[0], horizon, prior, gain_bound(prior, levels),
            float(drafter.information_weight),
        )  # fmt: skip
        self.cost = drafter.cost(draft)  # of the structure, whatever its parameters
        self.heap: list[tuple[float, int, Rectangle]] = []
        self.order, self.seen = itertools.count(), 0
        whole = everything(levels, self.shape, horizon)
        if tighten(whole, self.formulas):
            self._take(whole[None], np.array([bound(self.formulas, whole, self._enough)]))

    def run(self, seconds: float | None) -> Certificate:
        clock, most, interrupted = Clock(seconds), math.inf, False
        try:
            while self.heap:
                most = -self.heap[0][0]  # of all that is left, also while some of it is taken off the heap
                if clock.over or len(self.heap) > self.drafter.settings.nodes:
                    break
                self._take(*expand(self.formulas, np.array(self._next()), self._enough))
            else:
                most = -math.inf
        except KeyboardInterrupt:
            interrupted = True
        return Certificate(self.draft, self.value, max(most, self.value), self.seen, interrupted)

    @property
    def _enough(self) -> float:
        """The J that a better formula has to have."""
        return self.value + self.cost + TIE

    def _next(self) -> list[Rectangle]:
        """The rectangles with the greatest bounds."""
        return [heapq.heappop(self.heap)[-1] for _ in range(min(BATCH, len(self.heap)))]

    def _take(self, rectangles: Rectangle, bounds: NDArray[np.float64]) -> None:
        """Keep the rectangles that may hold something better; where one of them is a single formula, it is."""
        self.seen += len(bounds)
        for rectangle, most in zip(rectangles, bounds.tolist(), strict=True):
            if most <= self._enough:
                continue
            if is_single(rectangle):
                self.draft = self._draft(rectangle)
                self.value = self.drafter.value(self.draft)
                self._drop()
            else:
                heapq.heappush(self.heap, (self.cost - most, next(self.order), rectangle))

    def _drop(self) -> None:
        """Leave out what the best formula is worth at least as much as."""
        self.heap = [entry for entry in self.heap if -entry[0] > self.value + TIE]
        heapq.heapify(self.heap)

    def _draft(self, rectangle: Rectangle) -> Draft:
        numbers = rectangle[:, :, LEAST]
        variables = self.drafter.levels.variables
        columns = np.arange(len(variables))
        lower, upper = (self.formulas.sides[columns, sides] for sides in np.split(numbers[:, :-3], 2, axis=1))
        return draft_of(to_formula(variables, self.shape, numbers[:, -3:], lower, upper))
