"""The error on trajectories that a formula was not inferred from: a held-out share, or cross-validation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from tickwise._seeding import generator
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.explanation import Confusion, Explanation, Mistake, explain
from tickwise.inference.trajectories import LabelledTrajectories

CONFIDENCE = 0.95
"""The confidence of every interval."""


def error_interval(wrong: int, count: int) -> tuple[float, float]:
    """The Wilson interval of an error, with `CONFIDENCE`; it stays telling where nothing is wrong.

    Args:
        wrong: How many predictions are wrong.
        count: Of how many.

    Returns:
        The ends, as shares in [0, 1].
    """
    ends = binomtest(wrong, count).proportion_ci(CONFIDENCE, method="wilson")
    return max(float(ends.low), 0.0), min(float(ends.high), 1.0)


def stratified_folds(labels: NDArray[Any], folds: int, seed: int = 0) -> tuple[NDArray[np.int64], ...]:
    """Deal out rows so that every fold has its share of each label, within one row.

    Args:
        labels: Labels of two or more kinds, shape ``(n,)``.
        folds: How many folds, at least 2.
        seed: What shuffles the rows.

    Returns:
        The rows of each fold, in ascending order; every row is in one fold.

    Raises:
        ConfigurationError: If there are fewer than 2 folds.
        DataError: If a label has fewer rows than there are folds.
    """
    if folds < 2:
        raise ConfigurationError(f"folds is {folds}; use 2 or more")
    rng, place, dealt = generator(seed, "folds"), np.empty(len(labels), dtype=np.int64), 0
    for label in np.unique(labels):
        rows = np.flatnonzero(labels == label)
        if len(rows) < folds:
            raise DataError(
                f"label {label} has {len(rows)} trajector{'y' if len(rows) == 1 else 'ies'} for {folds} folds; "
                "give one a fold of each label or more, or use fewer folds"
            )
        # dealing goes on where the last label ended, so that folds have the same size within one row
        place[rng.permutation(rows)] = (dealt + np.arange(len(rows))) % folds
        dealt += len(rows)
    return tuple(np.flatnonzero(place == fold) for fold in range(folds))


def stratified_holdout(labels: NDArray[Any], share: float, seed: int = 0) -> NDArray[np.int64]:
    """Choose rows to hold out, the same share of each label.

    Args:
        labels: Labels of two or more kinds, shape ``(n,)``.
        share: The share, between 0 and 1; each label keeps a row and gives up one, at least.
        seed: What draws the rows.

    Returns:
        The rows, in ascending order.

    Raises:
        ConfigurationError: If the share is not between 0 and 1.
        DataError: If a label has only one row.
    """
    if not 0 < share < 1:
        raise ConfigurationError(f"holdout is {share}; use a share between 0 and 1, such as 0.2")
    rng, chosen = generator(seed, "holdout"), []
    for label in np.unique(labels):
        rows = np.flatnonzero(labels == label)
        if len(rows) < 2:
            raise DataError(f"label {label} has one trajectory alone; holding out needs two of each label or more")
        count = min(max(round(share * len(rows)), 1), len(rows) - 1)
        chosen.append(rng.permutation(rows)[:count])
    return np.sort(np.concatenate(chosen))


@dataclass(frozen=True, slots=True)
class Trial:
    """A model that was fitted without some trajectories, and judged on these.

    Attributes:
        rows: The rows that were held out.
        explanation: Its formula on them.
        seconds: How long fitting took.
    """

    rows: NDArray[np.int64]
    explanation: Explanation
    seconds: float

    @property
    def formula(self) -> str | None:
        """The formula as text; None if none was found."""
        return None if self.explanation.formula is None else str(self.explanation.formula)

    @property
    def wrong(self) -> int:
        """How many of the predictions are wrong."""
        return self.explanation.confusion.wrong

    @property
    def error(self) -> float:
        """The share of wrong predictions."""
        return self.wrong / len(self.rows)


@dataclass(frozen=True, slots=True)
class Validation:
    """What models predict for trajectories that they were not fitted to.

    Attributes:
        method: ``"holdout"`` or ``"folds"``.
        trials: One for a held-out share, one a fold for cross-validation.
        interrupted: Whether Ctrl-C left out the folds that were to come.
    """

    method: str
    trials: tuple[Trial, ...]
    interrupted: bool = False

    @property
    def confusion(self) -> Confusion:
        """Labels against held-out predictions, those of all folds pooled."""
        return Confusion.pooled(trial.explanation.confusion for trial in self.trials)

    @property
    def interval(self) -> tuple[float, float]:
        """The Wilson interval of the error."""
        return error_interval(self.confusion.wrong, self.confusion.count)

    @property
    def note(self) -> str:
        """What the interval is, and what it leaves out."""
        if self.method == "holdout":
            return f"{CONFIDENCE:.0%} Wilson interval of one held-out sample, for the formula shown".replace("%", " %")
        return (
            f"{CONFIDENCE:.0%} Wilson interval of the pooled held-out predictions; folds share trajectories to learn "
            "from, so it is approximate, and it is of formulas inferred like the one shown"
        ).replace("%", " %")

    def mistakes(self) -> Iterator[tuple[int, Mistake]]:
        """The trajectories that were predicted wrongly, each with the number of its fold, from 1."""
        for number, trial in enumerate(self.trials, 1):
            yield from ((number, mistake) for mistake in trial.explanation.mistakes)

    def sentence(self) -> str:
        """The held-out error with its interval."""
        found, (low, high) = self.confusion, self.interval
        how = "" if self.method == "holdout" else f" in {len(self.trials)} folds"
        return (
            f"held-out error {percent(found.error)} [{percent(low)}, {percent(high)}], "
            f"{found.wrong} of {found.count} trajectories wrong{how}"
        )

    def document(self) -> dict[str, Any]:
        """What JSON says of it."""
        found, (low, high) = self.confusion, self.interval
        return {
            "method": self.method,
            "held_out": found.count, "wrong": found.wrong, "error": found.error, "low": low, "high": high,
            "interval": self.note, "confusion": found.document(),
            "trials": [
                {
                    "formula": trial.formula, "held_out": len(trial.rows), "wrong": trial.wrong, "error": trial.error,
                    "seconds": round(trial.seconds, 3),
                }
                for trial in self.trials
            ],
            "misclassified": [{**mistake.document(), "trial": number} for number, mistake in self.mistakes()],
            "interrupted": self.interrupted,
        }  # fmt: skip


def percent(share: float) -> str:
    """A share as a percentage with two decimals."""
    return f"{100 * share:.2f} %"


def states_of(data: LabelledTrajectories) -> list[NDArray[np.float64]]:
    """Each trajectory's states alone, without what comes after its end."""
    return [values[:length] for values, length in zip(data.values, data.lengths, strict=True)]


def hold_out(
    model: MITLClassifier, data: LabelledTrajectories, share: float, seed: int = 0
) -> tuple[MITLClassifier, Validation]:
    """Fit a model without a share of the trajectories, and judge it on them.

    Args:
        model: The parameters; it is left as it is.
        data: Trajectories of both labels.
        share: The share to hold out.
        seed: What draws it.

    Returns:
        The fitted model, and its predictions.

    Raises:
        ConfigurationError: If the share or a parameter of the model is out of range.
        DataError: If there are too few trajectories, or fitting fails.
    """
    fitted, trial = _trial(model, data, stratified_holdout(data.labels, share, seed))
    return fitted, Validation("holdout", (trial,), fitted.interrupted_)


def cross_validate(
    model: MITLClassifier,
    data: LabelledTrajectories,
    folds: int,
    seed: int = 0,
    report: Callable[[int, Trial], None] | None = None,
) -> Validation:
    """Fit a model once for each fold to all other folds, and judge it on that one.

    Args:
        model: The parameters; it is left as it is.
        data: Trajectories of both labels.
        folds: How many folds.
        seed: What deals the trajectories out.
        report: Is called after each fold with its number, from 1, and what was found.

    Returns:
        The predictions. Ctrl-C leaves out the folds that were not finished.

    Raises:
        ConfigurationError: If the number of folds or a parameter of the model is out of range.
        DataError: If there are too few trajectories, or fitting fails.
        KeyboardInterrupt: At a Ctrl-C before the first fold is finished.
    """
    trials: list[Trial] = []
    interrupted = False
    for number, rows in enumerate(stratified_folds(data.labels, folds, seed), 1):
        try:
            fitted, trial = _trial(model, data, rows)
            interrupted = fitted.interrupted_
        except KeyboardInterrupt:
            interrupted = True
        if interrupted:  # a search that was cut short says nothing of the method
            break
        trials.append(trial)
        if report is not None:
            report(number, trial)
    if not trials:
        raise KeyboardInterrupt
    return Validation("folds", tuple(trials), interrupted)


def _trial(model: MITLClassifier, data: LabelledTrajectories, rows: NDArray[np.int64]) -> tuple[MITLClassifier, Trial]:
    """A model fitted without some rows, and what it predicts for them."""
    kept = np.ones(len(data), dtype=np.bool_)
    kept[rows] = False
    known, held_out = data.select(kept), data.select(rows)
    fitted = MITLClassifier(**model.get_params())
    began = time.monotonic()
    fitted.fit(states_of(known), known.labels)
    seconds = time.monotonic() - began
    formula = None if fitted.formula_ is None else fitted.formula_.formula
    return fitted, Trial(rows, explain(formula, held_out), seconds)
