"""What a formula does to labelled trajectories: how many each of its parts keeps, which it gets wrong, and why."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, astuple, dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.render import to_english, to_text, to_unicode
from tickwise.logic.syntax import And, Formula, Or, Verdict


@dataclass(frozen=True, slots=True)
class Confusion:
    """How many trajectories of each label are predicted to have which.

    Attributes:
        true_positives: Label 1, predicted 1.
        false_negatives: Label 1, predicted -1.
        false_positives: Label -1, predicted 1.
        true_negatives: Label -1, predicted -1.
    """

    true_positives: int
    false_negatives: int
    false_positives: int
    true_negatives: int

    @classmethod
    def of(cls, labels: NDArray[Any], predicted: NDArray[Any]) -> Confusion:
        """Count labels against predictions, both 1 or -1 and of shape ``(n,)``."""
        positive, kept = np.asarray(labels) == 1, np.asarray(predicted) == 1
        cells = (positive & kept, positive & ~kept, ~positive & kept, ~positive & ~kept)
        return cls(*(int(np.count_nonzero(cell)) for cell in cells))

    @classmethod
    def pooled(cls, parts: Iterable[Confusion]) -> Confusion:
        """The sum of the counts of some parts."""
        return cls(*map(sum, zip(*(astuple(part) for part in parts), strict=True)))

    @property
    def count(self) -> int:
        """All trajectories."""
        return self.true_positives + self.false_negatives + self.false_positives + self.true_negatives

    @property
    def wrong(self) -> int:
        """Those predicted wrongly."""
        return self.false_negatives + self.false_positives

    @property
    def error(self) -> float:
        """The share predicted wrongly, every trajectory counting the same."""
        return self.wrong / self.count

    def document(self) -> dict[str, int]:
        """The four counts by name."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Separation:
    """What one part of a formula, as a rule a primitive, does to the trajectories.

    A pair counts those with label 1, then those with label -1. A part keeps a trajectory unless its verdict is FALSE.

    Attributes:
        disjunct: The number of its disjunct, from 1.
        position: Its number within that disjunct, from 1.
        formula: The part.
        alone: How many of all it keeps.
        reaching: How many the parts before it in the disjunct keep.
        keeping: How many of these it keeps.
    """

    disjunct: int
    position: int
    formula: Formula
    alone: tuple[int, int]
    reaching: tuple[int, int]
    keeping: tuple[int, int]

    @property
    def removing(self) -> tuple[int, int]:
        """How many of those that reach it the part removes."""
        return self.reaching[0] - self.keeping[0], self.reaching[1] - self.keeping[1]

    @property
    def name(self) -> str:
        """A short name: ``1`` is the first part of the first disjunct, ``2.1`` that of the second."""
        return f"{self.disjunct}.{self.position}"

    def document(self) -> dict[str, Any]:
        """The facts, as JSON has them."""
        pairs = {
            kind: {"positives": pair[0], "negatives": pair[1]}
            for kind, pair in (
                ("alone", self.alone), ("reaching", self.reaching), ("keeping", self.keeping),
                ("removing", self.removing),
            )
        }  # fmt: skip
        return {"disjunct": self.disjunct, "position": self.position, "formula": to_text(self.formula), **pairs}


@dataclass(frozen=True, slots=True)
class Mistake:
    """A trajectory that is predicted wrongly.

    Attributes:
        row: Its row in the data.
        id: Its name.
        label: Its label.
        predicted: The other one.
        why: Which parts of the formula are to blame, in words.
        symbols: The same with the formula's symbols, for a page.
    """

    row: int
    id: str
    label: int
    predicted: int
    why: str
    symbols: str

    def document(self) -> dict[str, Any]:
        """The facts, as JSON has them."""
        return {"id": self.id, "label": self.label, "predicted": self.predicted, "why": self.why}


@dataclass(frozen=True, slots=True)
class Explanation:
    """A formula on labelled trajectories.

    Attributes:
        formula: The formula; None predicts -1 for every trajectory.
        english: The formula as a sentence; empty where there is none.
        predicted: 1 where the verdict is not FALSE (the weak view), else -1; shape ``(n,)``.
        confusion: Labels against predictions.
        separations: What each part does, disjunct by disjunct.
        mistakes: The trajectories that are predicted wrongly, in the order of the data.
    """

    formula: Formula | None
    english: str
    predicted: NDArray[np.int8]
    confusion: Confusion
    separations: tuple[Separation, ...]
    mistakes: tuple[Mistake, ...]

    def document(self) -> dict[str, Any]:
        """What JSON says of it."""
        return {
            "confusion": self.confusion.document(),
            "primitives": [separation.document() for separation in self.separations],
            "misclassified": [mistake.document() for mistake in self.mistakes],
        }


def parts_of(formula: Formula) -> tuple[tuple[Formula, ...], ...]:
    """The parts that a formula is read by: for each disjunct at its top, the conjuncts at the top of that.

    Of a formula in SDNF they are its primitives; any other has parts too, at least itself.
    """
    disjuncts = formula.children if isinstance(formula, Or) else (formula,)
    return tuple(each.children if isinstance(each, And) else (each,) for each in disjuncts)


def explain(formula: Formula | None, data: LabelledTrajectories) -> Explanation:
    """Say what a formula does to labelled trajectories.

    Args:
        formula: The formula; None for none, which predicts -1 always.
        data: The trajectories; both labels need not occur.

    Returns:
        The explanation.

    Raises:
        UnknownVariableError: If the formula names a variable that the data does not have.
    """
    if formula is None:
        predicted = np.full(len(data), -1, dtype=np.int8)
        why = "no formula was found, so all are predicted -1"
        mistakes = _mistakes(data, predicted, dict.fromkeys(np.flatnonzero(data.labels == 1).tolist(), (why, why)))
        return Explanation(None, "", predicted, Confusion.of(data.labels, predicted), (), mistakes)
    parts = parts_of(formula)
    verdicts = [[_verdicts(part, data) for part in conjunction] for conjunction in parts]
    # Kleene's connectives are min and max on the verdicts' numbers
    whole = reduce(np.maximum, (reduce(np.minimum, row) for row in verdicts))
    predicted = np.where(whole != Verdict.FALSE, 1, -1).astype(np.int8)
    separations = tuple(
        separation
        for number, (conjunction, row) in enumerate(zip(parts, verdicts, strict=True), 1)
        for separation in _separations(number, conjunction, row, data.labels)
    )
    reasons = {
        row: tuple(_why(row, parts, verdicts, data, write) for write in (to_text, to_unicode))
        for row in np.flatnonzero(predicted != data.labels).tolist()
    }
    confusion = Confusion.of(data.labels, predicted)
    mistakes = _mistakes(data, predicted, reasons)
    return Explanation(formula, to_english(formula), predicted, confusion, separations, mistakes)


def _verdicts(formula: Formula, data: LabelledTrajectories) -> NDArray[np.int8]:
    return np.atleast_1d(formula.verdict(data.values, variables=data.variables, lengths=data.lengths))


def _mistakes(
    data: LabelledTrajectories, predicted: NDArray[np.int8], reasons: Mapping[int, tuple[str, ...]]
) -> tuple[Mistake, ...]:
    return tuple(
        Mistake(row, data.ids[row], int(data.labels[row]), int(predicted[row]), *why) for row, why in reasons.items()
    )


def _separations(
    number: int, conjunction: tuple[Formula, ...], verdicts: list[NDArray[np.int8]], labels: NDArray[np.int8]
) -> list[Separation]:
    found, reached = [], np.ones(len(labels), dtype=np.bool_)
    for position, (part, verdict) in enumerate(zip(conjunction, verdicts, strict=True), 1):
        kept = verdict != Verdict.FALSE
        pairs = (_pair(mask, labels) for mask in (kept, reached, reached & kept))
        found.append(Separation(number, position, part, *pairs))
        reached &= kept
    return found


def _pair(mask: NDArray[np.bool_], labels: NDArray[np.int8]) -> tuple[int, int]:
    return int(np.count_nonzero(mask & (labels == 1))), int(np.count_nonzero(mask & (labels == -1)))


def _why(
    row: int,
    parts: tuple[tuple[Formula, ...], ...],
    verdicts: list[list[NDArray[np.int8]]],
    data: LabelledTrajectories,
    write: Callable[[Formula], str],
) -> str:
    """Which part fails first in each disjunct or, where the formula is not violated, which disjunct admits the row."""
    reasons = []
    for conjunction, row_verdicts in zip(parts, verdicts, strict=True):
        failing = [
            part for part, verdict in zip(conjunction, row_verdicts, strict=True) if verdict[row] == Verdict.FALSE
        ]
        if failing:
            reasons.append((False, f"violates {write(failing[0])}{_margin(failing[0], row, data)}"))
            continue
        open_parts = [part for part, verdict in zip(conjunction, row_verdicts, strict=True) if not verdict[row]]
        if open_parts:
            last = int(data.lengths[row]) - 1
            reasons.append((True, f"ends at tick {last}, before {write(open_parts[0])} is decided"))
            continue
        tightest = min(conjunction, key=lambda part: abs(_robustness(part, row, data)))
        reasons.append((True, f"satisfies {' and '.join(map(write, conjunction))}{_margin(tightest, row, data)}"))
    admitted = [text for holds, text in reasons if holds]
    return admitted[0] if admitted else "; ".join(dict.fromkeys(text for _, text in reasons))


def _robustness(part: Formula, row: int, data: LabelledTrajectories) -> float:
    states = data.values[row, : data.lengths[row]]
    return float(part.robustness(states, variables=data.variables))


def _margin(part: Formula, row: int, data: LabelledTrajectories) -> str:
    """By how much a part is satisfied or violated; nothing where no number says."""
    margin = abs(_robustness(part, row, data))
    return f", by {margin:.3g}" if math.isfinite(margin) else ""
