"""MITL_f formulas as frozen nodes (the paper's Section II-A).

A state predicate is a `Box` over named variables, or its complement ``Not(box)``; a comparison such as
``x > 3`` is a box with one side open. Formulas combine with ``&``, ``|`` and ``~``; ``str`` gives text that
parses back to an equal formula.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import FormulaError

if TYPE_CHECKING:
    from tickwise.logic.semantics import Trajectories


class Verdict(IntEnum):
    """What a finite trajectory says of a formula; Kleene's connectives are min, max and minus on these numbers."""

    FALSE = -1
    UNKNOWN = 0
    TRUE = 1


class Formula:
    """The base of all nodes. Concrete nodes are final, frozen and hashable."""

    __slots__ = ()

    def __and__(self, other: Formula) -> And:
        return And((self, other))

    def __or__(self, other: Formula) -> Or:
        return Or((self, other))

    def __invert__(self) -> Formula:
        return self.operand if isinstance(self, Not) else Not(self)

    def __str__(self) -> str:
        from tickwise.logic.render import to_text

        return to_text(self)

    @property
    def children(self) -> tuple[Formula, ...]:
        """The direct subformulas, in order."""
        return ()

    @property
    def variables(self) -> tuple[str, ...]:
        """The names of the variables, in order of first appearance."""
        found = dict.fromkeys(name for child in self.children for name in child.variables)
        return tuple(found)

    @property
    def start_effect(self) -> int:
        """The start-effect time t_s in ticks (Definition 4)."""
        return min((child.start_effect for child in self.children), default=0)

    @property
    def end_effect(self) -> int:
        """The end-effect time t_e in ticks (Definition 4): the last tick that the verdict can depend on."""
        return max((child.end_effect for child in self.children), default=0)

    def verdict(
        self, X: Trajectories, *, variables: Sequence[str] | None = None, lengths: NDArray[Any] | None = None
    ) -> Verdict | NDArray[np.int8]:
        """The three-valued verdict at tick 0; see `tickwise.logic.semantics.verdict`."""
        from tickwise.logic import semantics

        return semantics.verdict(self, X, variables=variables, lengths=lengths)

    def robustness(
        self, X: Trajectories, *, variables: Sequence[str] | None = None, lengths: NDArray[Any] | None = None
    ) -> float | NDArray[np.float64]:
        """The robustness at tick 0; see `tickwise.logic.semantics.robustness`."""
        from tickwise.logic import semantics

        return semantics.robustness(self, X, variables=variables, lengths=lengths)

    def to(self, dialect: str, *, period: float = 1.0) -> str:
        """The formula for another tool, such as ``rtamt``; see `tickwise.logic.dialects.translate`."""
        from tickwise.logic.dialects import translate

        return translate(self, dialect, period=period)


@dataclass(frozen=True, slots=True)
class Interval:
    """A closed interval of ticks [start, end].

    Raises:
        FormulaError: If a bound is not a whole number, is negative, or the bounds are reversed.
    """

    start: int
    end: int

    def __post_init__(self) -> None:
        for bound in (self.start, self.end):
            if isinstance(bound, bool) or not isinstance(bound, int):
                raise FormulaError(f"interval bound {bound!r} is not a whole number of ticks; round it")
        if self.start < 0:
            raise FormulaError(f"interval [{self.start},{self.end}] starts before tick 0; use a start of 0 or more")
        if self.start > self.end:
            raise FormulaError(f"interval [{self.start},{self.end}] is reversed; write [{self.end},{self.start}]")

    def __str__(self) -> str:
        return f"[{self.start},{self.end}]"


@dataclass(frozen=True, slots=True)
class Bound:
    """The range of one variable in a box; a side at infinity is open.

    Raises:
        FormulaError: If a number is NaN, the range is empty or unbounded on both sides.
    """

    variable: str
    lower: float = -math.inf
    upper: float = math.inf
    lower_strict: bool = False
    upper_strict: bool = False

    def __post_init__(self) -> None:
        if math.isnan(self.lower) or math.isnan(self.upper):
            raise FormulaError(f"a bound of {self.variable!r} is NaN; use a number")
        if self.lower > self.upper:
            raise FormulaError(
                f"the range of {self.variable!r} is empty: {self.lower:g} > {self.upper:g}; swap the bounds"
            )
        if self.lower == self.upper and (self.lower_strict or self.upper_strict):
            raise FormulaError(f"the range of {self.variable!r} is empty: both bounds are {self.lower:g}; use <= or >=")
        if math.isinf(self.lower) and math.isinf(self.upper):
            raise FormulaError(f"the range of {self.variable!r} has no bound; leave the variable out")
        # an infinite side has no strictness: keep one form, so that equal ranges are equal
        if math.isinf(self.lower) and self.lower_strict:
            object.__setattr__(self, "lower_strict", False)
        if math.isinf(self.upper) and self.upper_strict:
            object.__setattr__(self, "upper_strict", False)


@dataclass(frozen=True, slots=True)
class Box(Formula):
    """The predicate that every named variable lies in its range: an atomic predicate ρ of the paper.

    Raises:
        FormulaError: If there is no bound, or a variable occurs twice.
    """

    bounds: tuple[Bound, ...]

    def __post_init__(self) -> None:
        names = [bound.variable for bound in self.bounds]
        if not names:
            raise FormulaError("a box needs at least one bounded variable")
        if len(set(names)) < len(names):
            raise FormulaError(f"a box bounds a variable twice: {', '.join(names)}")

    @classmethod
    def of(cls, **ranges: tuple[float, float]) -> Box:
        """A closed box, for instance ``Box.of(x=(3, 4), y=(3, 5))``."""
        bounds = []
        for name, given in ranges.items():
            try:
                low, high = map(float, given)
            except (TypeError, ValueError):
                raise FormulaError(f"the range of {name!r} is {given!r}; give two numbers, such as (3, 4)") from None
            bounds.append(Bound(name, low, high))
        return cls(tuple(bounds))

    @property
    def variables(self) -> tuple[str, ...]:
        """The names of the variables, in order."""
        return tuple(bound.variable for bound in self.bounds)

    def centroid(self, variables: Sequence[str], limits: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
        """The centroid Cr(ρ) of the region within limits (Algorithm 2, line 6).

        Args:
            variables: Names of the coordinates, in the order wanted.
            limits: The world's range of each coordinate; closes open sides and unnamed variables.

        Returns:
            The centre, shape ``(len(variables),)``, in world units.
        """
        ranges = {bound.variable: bound for bound in self.bounds}
        centre = []
        for name, (low, high) in zip(variables, limits, strict=True):
            bound = ranges.get(name)
            lower = low if bound is None else max(low, bound.lower)
            upper = high if bound is None else min(high, bound.upper)
            centre.append((lower + upper) / 2)
        return np.array(centre, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Constant(Formula):
    """⊤ (true) or ⊥ (false)."""

    value: bool


@dataclass(frozen=True, slots=True)
class Not(Formula):
    """Negation; of a box it is the complement region."""

    operand: Formula

    @property
    def children(self) -> tuple[Formula, ...]:
        """The direct subformulas, in order."""
        return (self.operand,)


@dataclass(frozen=True, slots=True)
class _Connective(Formula):
    operands: tuple[Formula, ...]

    def __post_init__(self) -> None:
        if len(self.operands) < 2:
            raise FormulaError("a conjunction or disjunction needs at least two operands")

    @property
    def children(self) -> tuple[Formula, ...]:
        """The direct subformulas, in order."""
        return self.operands


@dataclass(frozen=True, slots=True)
class And(_Connective):
    """Conjunction of two or more formulas."""


@dataclass(frozen=True, slots=True)
class Or(_Connective):
    """Disjunction of two or more formulas."""


@dataclass(frozen=True, slots=True)
class _Temporal(Formula):
    interval: Interval
    operand: Formula

    @property
    def children(self) -> tuple[Formula, ...]:
        """The direct subformulas, in order."""
        return (self.operand,)

    @property
    def start_effect(self) -> int:
        """The start-effect time t_s in ticks (Definition 4)."""
        return self.operand.start_effect + self.interval.start

    @property
    def end_effect(self) -> int:
        """The end-effect time t_e in ticks (Definition 4)."""
        return self.operand.end_effect + self.interval.end


@dataclass(frozen=True, slots=True)
class Eventually(_Temporal):
    """◇_I φ: φ holds at some tick of the interval."""


@dataclass(frozen=True, slots=True)
class Always(_Temporal):
    """□_I φ: φ holds at every tick of the interval."""


Predicate = Box | Not
"""A state predicate: a box, or the complement ``Not(box)`` of one."""
