"""A formula that was fitted to data, and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass

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
    """

    formula: SDNF
    objective: float
    rate: float
    gain: float
    satisfying: bool

    @property
    def size(self) -> int:
        """The size ϱ(φ)."""
        return self.formula.size

    @classmethod
    def of(cls, formula: SDNF, rate: float, gain: float, settings: InferenceSettings) -> Fit:
        """The fit of a formula whose classification rate and information gain are known."""
        objective = rate + settings.information_weight * gain
        return cls(formula, objective, rate, gain, rate >= settings.rate and formula.size <= settings.size)
