"""Learning curves as numbers: what the figure draws, and what a page lets its reader look into."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.experiments.study import METHODS, StudySpec

BINS = 100
"""Points of a training curve."""

BINS_A_DECADE = 12
"""Points of a curve of greedy returns for each factor of ten in episodes."""

_FINER = 5
_RESAMPLES = 2_000

Curve = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Episodes, shape ``(points,)``, and the runs' returns there, shape ``(runs, points)``."""


def training_curve(runs: Sequence[Mapping[str, Any]], block: int, shown: int, bins: int = BINS) -> Curve:
    """Returns in the first training episodes, averaged over bins of whole blocks.

    Args:
        runs: What each run gave; its ``blocks`` are mean returns.
        block: Episodes of a block.
        shown: Episodes of the curve.
        bins: How many points there are to be, about.
    """
    count = min(shown // block, *(len(run["blocks"]) for run in runs))
    width = max(1, shown // block // bins)
    whole = max(1, count // width)
    episodes = np.asarray((np.arange(whole) + 0.5) * width * block, dtype=np.float64)
    rows = np.stack([np.asarray(run["blocks"][:count], dtype=np.float64) for run in runs])
    usable = rows[:, : whole * width] if count >= width else rows
    returns: NDArray[np.float64] = usable.reshape(len(runs), whole, -1).mean(axis=2)
    return episodes, returns


def evaluation_curve(runs: Sequence[Mapping[str, Any]], bins: int = BINS_A_DECADE) -> Curve:
    """Returns of the greedy policy, averaged over equal bins of a log axis, as far as all runs go.

    Args:
        runs: What each run gave, with ``evaluation_episodes`` and ``evaluation_returns``.
        bins: Bins for each factor of ten.
    """
    shortest = min(runs, key=lambda run: len(run["evaluation_episodes"]))
    episodes = np.asarray(shortest["evaluation_episodes"], dtype=np.float64)
    rows = np.stack([np.asarray(run["evaluation_returns"][: len(episodes)], dtype=np.float64) for run in runs])
    later = episodes > 0  # a log axis has no 0
    episodes, rows = episodes[later], rows[:, later]
    number = np.floor(np.log10(episodes) * bins)
    groups = [np.flatnonzero(number == value) for value in np.unique(number)]
    middles = np.array([episodes[group].mean() for group in groups])
    returns = [rows[:, group].mean(axis=1) for group in groups]
    return middles, np.stack(returns, axis=1) if returns else np.empty((len(runs), 0))


def interval(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The 95 % percentile bootstrap interval of the mean over runs, from ``(runs, points)`` to ``(points,)``."""
    draws = np.random.default_rng(0).integers(len(rows), size=(_RESAMPLES, len(rows)))
    share = np.stack([(draws == run).mean(axis=1) for run in range(len(rows))], axis=1)
    low, high = np.percentile(share @ rows, [2.5, 97.5], axis=0)
    return low, high


def curve_data(results: Mapping[str, Any], spec: StudySpec) -> dict[str, Any] | None:
    """Both learning curves of every method as plain data; None where nothing was learned.

    Args:
        results: The results of the study.
        spec: The study.

    Returns:
        ``optimum`` V* and ``worst`` (always failing), and under ``charts`` for each curve its axis and under ``levels``
        its points by method: first as many as the figure has, then more, for a reader who looks closer.
    """
    methods = {name: results["methods"][name] for name in METHODS if results["methods"].get(name)}
    if not methods:
        return None
    learning = spec.learning
    training = [
        {name: _points(training_curve(runs, learning.block, learning.shown, bins)) for name, runs in methods.items()}
        for bins in (BINS, _FINER * BINS)
    ]
    greedy = [
        {name: _points(evaluation_curve(runs, bins)) for name, runs in methods.items()}
        for bins in (BINS_A_DECADE, _FINER * BINS_A_DECADE)
    ]
    charts: list[dict[str, Any]] = [
        {
            "title": "Training", "unit": "training episodes", "log": False, "limits": [0, learning.shown],
            "levels": training,
        },
        {
            "title": "Greedy policy", "unit": "learned episodes", "log": True, "limits": _limits(greedy[-1]),
            "levels": greedy,
        },
    ]  # fmt: skip
    summary = results["summary"]
    shown = [chart for chart in charts if chart["limits"][0] < chart["limits"][1]]
    return {"optimum": summary["v_star"], "worst": summary["fail"], "charts": shown}


def _points(curve: Curve) -> dict[str, list[float]]:
    episodes, rows = curve
    low, high = interval(rows) if rows.shape[1] else (rows[0], rows[0])
    numbers = {"x": episodes, "mean": rows.mean(axis=0), "low": low, "high": high}
    return {name: [round(float(value), 1) for value in values] for name, values in numbers.items()}


def _limits(points: Mapping[str, Mapping[str, Sequence[float]]]) -> list[float]:
    episodes = [value for curve in points.values() for value in curve["x"]]
    return [min(episodes), max(episodes)] if episodes else [0.0, 0.0]
