"""A formula followed tick by tick through its timed automata, for one trajectory or many side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tickwise.automata.build import timed_automata
from tickwise.automata.ticks import TickTable
from tickwise.errors import DataError, UnknownVariableError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Formula


@dataclass(frozen=True, slots=True, eq=False)
class Monitor:
    """The automata of a formula's disjuncts, read side by side (Section IV-B, Step 3).

    It keeps no state itself: `start` and `advance` give states, whole numbers with a last axis of one entry for each
    disjunct, the number of a state of that disjunct's tick table. Any axes before it, such as that of a vector of
    environments, are kept.

    Attributes:
        sdnf: The formula in sequential disjunctive normal form.
        tables: The tick table of each disjunct.
        variables: The names of the features, in the order of their columns.
    """

    sdnf: SDNF
    tables: tuple[TickTable, ...]
    variables: tuple[str, ...]

    @classmethod
    def of(cls, formula: str | Formula | SDNF, variables: Sequence[str], *, reduce: bool = True) -> Monitor:
        """Build the automata of a formula.

        Args:
            formula: A formula, or its text.
            variables: The names of the features.
            reduce: Whether to hold clocks at 0 where their location does not use them (see `compile_table`).

        Returns:
            The monitor.

        Raises:
            FormulaError: If the text is no formula, or one without a sequential disjunctive normal form.
            UnknownVariableError: If the formula names a variable that is no feature.
        """
        sdnf = to_sdnf(parse(formula) if isinstance(formula, str) else formula)
        for name in _variables(sdnf):
            if name not in variables:
                raise UnknownVariableError(
                    f"the formula's variable {name!r} is no feature; the features are {', '.join(variables)}"
                )
        tables = tuple(automaton.compile(reduce=reduce) for automaton in timed_automata(sdnf))
        return cls(sdnf, tables, tuple(variables))

    def start(self, features: ArrayLike) -> NDArray[np.int64]:
        """The states after the letter of tick 0.

        Args:
            features: The features at tick 0, shape ``(..., variables)``.

        Returns:
            Table states, shape ``(..., disjuncts)``.

        Raises:
            DataError: If the features have another number of columns, or one is NaN.
        """
        values = self._checked(features)
        return self._advance(np.zeros((*values.shape[:-1], len(self.tables)), dtype=np.int64), values)

    def advance(self, states: NDArray[np.int64], features: ArrayLike) -> NDArray[np.int64]:
        """The states one tick later.

        Args:
            states: Table states, shape ``(..., disjuncts)``.
            features: The features of the tick that is read, shape ``(..., variables)``.

        Returns:
            Table states, of the same shape.

        Raises:
            DataError: As `start`.
        """
        return self._advance(states, self._checked(features))

    def verdict(self, states: NDArray[np.int64]) -> NDArray[np.int8]:
        """What states say of the whole formula: 1 true, 0 unknown, -1 false, shape ``(...)``."""
        said = [table.verdict[states[..., index]] for index, table in enumerate(self.tables)]
        return np.asarray(np.max(said, axis=0), dtype=np.int8)

    def choose(self, features: ArrayLike) -> NDArray[np.int64]:
        """The disjunct of Step 3 for features at tick 0: the one whose first region's centroid is nearest.

        A region that is open to a side in a variable has no centre there; how far outside it the feature lies counts
        instead. A variable that a region does not name does not count. Ties go to the lower index.

        Args:
            features: Features, shape ``(..., variables)``.

        Returns:
            Indices of disjuncts, shape ``(...)``.
        """
        values = self._checked(features)
        distances = [np.zeros(values.shape[:-1]) for _ in self.tables]
        for index, table in enumerate(self.tables):
            for bound in table.automaton.conjunction.primitives[0].box.bounds:
                value = values[..., self.variables.index(bound.variable)]
                if np.isfinite(bound.lower) and np.isfinite(bound.upper):
                    away = value - (bound.lower + bound.upper) / 2
                elif np.isfinite(bound.lower):
                    away = np.minimum(value - bound.lower, 0.0)
                else:
                    away = np.maximum(value - bound.upper, 0.0)
                distances[index] = distances[index] + away**2
        return np.asarray(np.argmin(np.sqrt(distances), axis=0), dtype=np.int64)

    def _advance(self, states: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.int64]:
        after = np.empty_like(states)
        for index, table in enumerate(self.tables):
            letter = np.zeros(values.shape[:-1], dtype=np.int64)
            for bit, predicate in enumerate(table.automaton.predicates):
                letter |= holds(predicate, values, self.variables).astype(np.int64) << bit
            after[..., index] = table.delta[states[..., index], letter]
        return after

    def _checked(self, features: ArrayLike) -> NDArray[np.float64]:
        values = np.asarray(features, dtype=np.float64)
        if values.ndim == 0 or values.shape[-1] != len(self.variables):
            raise DataError(f"features have shape {values.shape}; use (..., {len(self.variables)}), one a variable")
        if np.isnan(values).any():
            column = int(np.argwhere(np.isnan(values))[0][-1])
            raise DataError(f"the feature {self.variables[column]!r} is NaN; a predicate needs a number at every tick")
        return values


def _variables(sdnf: SDNF) -> list[str]:
    boxes = [primitive.box for disjunct in sdnf.disjuncts for primitive in disjunct.primitives]
    return list(dict.fromkeys(name for box in boxes for name in box.variables))
