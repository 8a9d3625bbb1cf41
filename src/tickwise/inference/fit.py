"""A formula that was fitted to data, and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass

from tickwise.inference.bounding import TIE
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.sdnf import SDNF


@dataclass(frozen=True, slots=True)
class Fit:
    """A formula with the parameters that a search found best.

    Attributes:
        formula: The formula.
        objective: J = CR + λ I, with class weights in CR.
        rate: The classification rate CR.
        gain: The information gain I.
        satisfying: Whether it is a satisfying formula (Problem 1).
        bound: No formula of the structure, its box sides among the levels of the search, has a greater J; None where
            it was not looked for.
        interrupted: Whether Ctrl-C ended the search, and this is the best so far.
    """

    formula: SDNF
    objective: float
    rate: float
    gain: float
    satisfying: bool
    bound: float | None = None
    interrupted: bool = False

    @property
    def size(self) -> int:
        """The size ϱ(φ)."""
        return self.formula.size

    @property
    def gap(self) -> float | None:
        """How much better the best formula of the structure can be at most, in units of J; None where not known."""
        return None if self.bound is None else max(self.bound - self.objective, 0.0)

    @property
    def proved(self) -> bool:
        """Whether the formula is proved to be the best of its structure."""
        return self.gap is not None and self.gap <= TIE

    @classmethod
    def of(
        cls,
        formula: SDNF,
        rate: float,
        gain: float,
        settings: InferenceSettings,
        bound: float | None = None,
        *,
        interrupted: bool = False,
    ) -> Fit:
        """The fit of a formula whose classification rate and information gain are known."""
        objective = rate + settings.information_weight * gain
        satisfying = rate >= settings.rate and formula.size <= settings.size
        return cls(formula, objective, rate, gain, satisfying, bound, interrupted)
