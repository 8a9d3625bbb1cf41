"""Formulas of one structure that agree best with what was seen so far: a sample of the version space.

Step 2 of Section IV-B asks for one formula. While trajectories still come, the many that agree with them say more: what
all of them accept is sure, and where they differ is what to try next. A sample of them is kept, drawn anew near the
source's formula and near what trajectories did, and varied; those with the fewest errors stay.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError
from tickwise.inference.kernels import EVENTUALLY_ALWAYS, Shape
from tickwise.inference.objective import Objective, formula_signature
from tickwise.inference.prior import Prior
from tickwise.inference.space import Gaps, SearchSpace, shape_of
from tickwise.inference.starts import sampled_starts
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF, Primitive

_NEAR = 0.8  # the share of draws whose windows are near the source's
_TIE = 1e-9
_SLACK = 1e-8  # more than what rounding hides
_PURE = 200  # conjunctions that a disjunction is put together from


def structure_shape(formula: SDNF, copies: int = 1) -> Shape:
    """The operators and polarities of a formula, or of several copies of it joined by ∨."""
    pairs = [[(p.operator, p.complemented) for p in disjunct.primitives] for disjunct in formula.disjuncts]
    return shape_of(pairs * copies)


@dataclass(slots=True, eq=False)
class Hypotheses:
    """A sample of the formulas of a structure that agree best with labelled trajectories.

    Attributes:
        source: The formula whose structure is taken, φ^S; windows, durations and the sizes of regions begin near its.
        space: What boxes and times may be chosen.
        prior: The prior of the information gain.
        count: How many are kept while nothing was good; then a tenth, since good trajectories tell much more.
        rng: The source of all randomness.
        copies: How many copies of the structure are joined by ∨ (Definition 7).
        positions: Their positions in the space, shape ``(n, dimensions)``.
        errors: The weighted share of trajectories that each misclassifies, shape ``(n,)``.

    Raises:
        ConfigurationError: If the structure does not fit into the space's horizon.
    """

    source: SDNF
    space: SearchSpace
    prior: Prior
    count: int
    rng: np.random.Generator
    copies: int = 1
    positions: NDArray[np.float64] = field(init=False)
    errors: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        if not self.space.room(self.shape, self._gaps):
            longest = max(len(disjunct.primitives) for disjunct in self.source.disjuncts)
            raise ConfigurationError(
                f"{longest} primitives one after the other do not fit into {self.space.horizon} ticks; "
                "use a longer horizon"
            )
        self.positions = self._drawn(self.count)
        self.errors = np.zeros(self.count)

    @property
    def shape(self) -> Shape:
        """Operators and polarities."""
        return structure_shape(self.source, self.copies)

    @property
    def best(self) -> NDArray[np.float64]:
        """The positions with the fewest errors, shape ``(survivors, dimensions)``."""
        return np.asarray(self.positions[self.errors <= self.errors.min() + _TIE])

    def formula(self, position: NDArray[np.float64]) -> SDNF:
        """The formula at a position."""
        return self.space.decode(position, self.shape)

    def update(self, data: LabelledTrajectories, weights: NDArray[np.float64], rounds: int = 1) -> None:
        """Keep those that agree best with the trajectories, among the old ones, new draws and variations.

        Args:
            data: All trajectories so far.
            weights: What an error in each costs, shape ``(n,)``.
            rounds: How often to vary and select.
        """
        parts = [self.positions, self._drawn(2 * self._kept(data))]
        if not data.positives:
            # variations of what was not contradicted would drift to what is never put to the test
            self._select(np.concatenate(parts), data, weights)
            return
        parts.append(sampled_starts(data, self.space, self.shape, self._kept(data), self.rng))
        self.positions = self.positions[: self._kept(data)]
        for _ in range(rounds):
            parts += [self._varied(self.positions), self._varied(self._crossed(self.positions))]
            self._select(np.concatenate(parts), data, weights)
            parts = [self.positions]

    def grow(self, data: LabelledTrajectories, weights: NDArray[np.float64]) -> None:
        """Go on with one more copy of the structure, put together from conjunctions that let no negative through.

        Half of them, for two copies, are those that say most of the positives, and half those that say most of what the
        best of these leaves; and so on for more copies. Those that say most are otherwise all much the same.

        Raises:
            DataError: If a label is missing.
        """
        data.require_both_classes()
        width = self.positions.shape[1] // self.copies
        single = [self.positions[:, i * width : (i + 1) * width] for i in range(self.copies)]
        alone = structure_shape(self.source)
        pool = np.concatenate([*single, sampled_starts(data, self.space, alone, 4 * self.count, self.rng)])

        def right(members: NDArray[np.bool_]) -> NDArray[np.float64]:
            some = data.select(members)
            objective = Objective(some, weights[members], self.prior, self.space, alone, self._gaps, 0.0)
            return objective(pool, np.full(len(pool), -np.inf))

        pure, left = np.round(right(data.labels < 0), 2), data.labels > 0
        self.copies += 1
        chosen: list[NDArray[np.float64]] = []
        while left.any() and len(chosen) < self.copies:
            order = np.lexsort((-right(left), -pure))
            chosen.append(pool[order[: _PURE // self.copies]])
            left = left & ~formula_signature(self.space.decode(chosen[-1][0], alone), data)
        parts = np.concatenate(chosen)
        picked = self.rng.integers(len(parts), size=(4 * self.count, self.copies))
        self.positions = parts[picked].reshape(4 * self.count, -1)
        self._select(self.positions, data, weights)

    def shrink(self, data: LabelledTrajectories, weights: NDArray[np.float64], rounds: int = 1) -> None:
        """Go on with fewer copies of the structure, as long as that does as well: a copy too many says nothing true.

        Args:
            data: All trajectories so far.
            weights: What an error in each costs, shape ``(n,)``.
            rounds: How often to vary and select what is left, before it is compared.
        """
        while self.copies > 1:
            before = self.copies, self.positions, self.errors
            blocks = self.positions.reshape(len(self.positions), self.copies, -1)
            left = [np.delete(blocks, copy, axis=1).reshape(len(blocks), -1) for copy in range(self.copies)]
            self.copies -= 1
            self.positions = np.concatenate(left)
            self._select(self.positions, data, weights)
            self.update(data, weights, rounds)
            if self.errors.min() > before[2].min() + _TIE:
                self.copies, self.positions, self.errors = before
                return

    def mass(self, trajectories: LabelledTrajectories, among: NDArray[np.float64]) -> float:
        """The mean share of some formulas that trajectories satisfy: the probability that they are good.

        Args:
            trajectories: Trajectories, all with label 1.
            among: The formulas' positions.
        """
        weights = np.ones(len(trajectories))
        objective = Objective(trajectories, weights, self.prior, self.space, self.shape, self._gaps, 0.0)
        return float(objective(among, np.full(len(among), -np.inf)).mean())

    @property
    def _gaps(self) -> Gaps:
        return ((0, self.space.horizon),)

    def _select(
        self, candidates: NDArray[np.float64], data: LabelledTrajectories, weights: NDArray[np.float64]
    ) -> None:
        """Keep those with the fewest errors of some candidates, which hold the present positions."""
        heaviest, kept = np.argsort(-weights, kind="stable"), self._kept(data)  # what settles most of them comes first
        data, weights = data.select(heaviest), weights[heaviest]
        objective = Objective(data, weights, self.prior, self.space, self.shape, self._gaps, 0.0)
        # who is worse than each of so many others will not be kept, and need not be measured to the end
        others, enough = self._distinct(self.positions[:kept]), -np.inf
        if len(others) == kept:
            enough = float(objective(others, np.full(kept, -np.inf)).min()) - _SLACK
        candidates = self._distinct(candidates)
        errors = np.round(1 - objective(candidates, np.full(len(candidates), enough)), 9)
        order = np.lexsort((self.rng.random(len(errors)), errors))[:kept]
        self.positions, self.errors = candidates[order], errors[order]

    def _distinct(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.unique(np.rint(positions) if not any(self.space.continuous) else positions, axis=0)

    def _kept(self, data: LabelledTrajectories) -> int:
        return max(self.count // 10, 1) if data.positives else self.count

    def _varied(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Each with a number or two changed by one or two steps."""
        changed = self.rng.random(positions.shape) < 1.5 / positions.shape[1]
        steps = self.rng.integers(-2, 3, positions.shape)
        return np.asarray(positions + changed * steps * self.space.units(self.shape))

    def _crossed(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Each with some of its primitives from another one, in the same place."""
        other = positions[self.rng.permutation(len(positions))]
        widths = [2 * len(self.space.variables) + 2 + nested for nested in self.shape.operators >= EVENTUALLY_ALWAYS]
        swapped = np.repeat(self.rng.random((len(positions), len(widths))) < 0.5, widths, axis=1)
        return np.asarray(np.where(swapped, other, positions))

    def _drawn(self, count: int) -> NDArray[np.float64]:
        """New ones: regions anywhere, as large as the source's or smaller; mostly with times near the source's."""
        primitives = [p for disjunct in self.source.disjuncts for p in disjunct.primitives] * self.copies
        return np.concatenate([self._drawn_block(primitive, count) for primitive in primitives], axis=1)

    def _drawn_block(self, primitive: Primitive, count: int) -> NDArray[np.float64]:
        columns = []
        ranges = {bound.variable: (bound.lower, bound.upper) for bound in primitive.box.bounds}
        for name, edges, continuous in zip(self.space.variables, self.space.edges, self.space.continuous, strict=True):
            low, high = ranges.get(name, (edges[0], edges[-1]))
            span = (edges[-1] - edges[0]) if continuous else len(edges) - 1.0
            width = (min(high, edges[-1]) - max(low, edges[0])) / (edges[-1] - edges[0]) * span
            columns += self._drawn_sides(width, span, continuous, primitive.complemented, count, edges[0])
        near = self.rng.random(count) < _NEAR
        window = [primitive.window.start, primitive.window.end]
        around = np.array(window)[:, None] + self.rng.integers(-3, 4, (2, count))
        anywhere = self.rng.integers(0, self.space.horizon + 1, (2, count))
        columns += list(np.sort(np.where(near, around, anywhere), axis=0).astype(float))
        if primitive.operator.nested:
            columns.append(np.maximum(primitive.duration + self.rng.integers(-2, 3, count), 1).astype(float))
        return np.stack(columns, axis=1)

    def _drawn_sides(
        self, width: float, span: float, continuous: bool, complemented: bool, count: int, origin: float
    ) -> list[NDArray[np.float64]]:
        """The two sides of a box in one variable."""
        if continuous:
            widths = np.clip(width * self.rng.uniform(0.3, 1.5, count), 0, span)
            low = origin + self.rng.random(count) * (span - widths)
            return [low, low + widths]
        widths = np.clip(np.rint(width) + self.rng.integers(-2, 2, count), 1, span)
        if not complemented:  # who satisfies a small region satisfies all that hold it
            widths = np.where(self.rng.random(count) < 0.5, 1, widths)
        low = np.floor(self.rng.random(count) * (span - widths + 1))
        return [low, low + widths]
