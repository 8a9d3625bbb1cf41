"""When a method has converged, and what can be said of it over the runs (Section V)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap, trim_mean

from tickwise.experiments.study import Goal

LEVELS = (80, 90, 95)
"""Shares, in percent, of the way from the always-fail return to V*."""

_SMOOTHED = 500  # episodes of the moving mean


def block_means(returns: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """The mean of each whole block of episodes, from ``(episodes,)`` to ``(blocks,)``."""
    whole = len(returns) // block * block
    means: NDArray[np.float64] = returns[:whole].reshape(-1, block).mean(axis=1, dtype=np.float64)
    return means.astype(np.float32)


def goal_reached(returns: NDArray[np.float32], goal: Goal, optimum: float) -> int | None:
    """Episodes until the end of the first block that meets the study's goal; None where none does.

    The measure nearest to the paper's curves, which are "averaged for every 10 episodes".

    Args:
        returns: The return of each training episode, shape ``(episodes,)``.
        goal: The study's goal.
        optimum: The optimal value V*.
    """
    means = block_means(returns, goal.block)
    there = np.flatnonzero(means >= optimum if goal.above is None else means > goal.above)
    return int(there[0] + 1) * goal.block if len(there) else None


def final_mean(blocks: NDArray[np.float32]) -> float:
    """Where training ends: the mean return of the last fifth of the episodes, from the means of blocks."""
    return float(np.asarray(blocks[-max(len(blocks) // 5, 1) :], dtype=np.float64).mean())


def settled(blocks: NDArray[np.float32], block: int, fail: float) -> int:
    """Episodes until training is as good as it gets: 95 % of the way from always failing to where it ends.

    Where it ends is `final_mean`; a moving mean over 500 episodes has to get there, and counts from its first episode.

    Args:
        blocks: Mean return of each block, shape ``(blocks,)``.
        block: Episodes of a block.
        fail: The return of always failing.
    """
    values = np.asarray(blocks, dtype=np.float64)
    width = min(max(_SMOOTHED // block, 1), len(values))
    sums = np.concatenate([[0.0], np.cumsum(values)])
    moving = (sums[width:] - sums[:-width]) / width
    end = final_mean(blocks)
    # the end itself may be a little less smooth than the threshold; the best moving mean always counts
    threshold = min(fail + 0.95 * (end - fail), moving.max())
    return int(np.flatnonzero(moving >= threshold)[0]) * block


def reached(episodes: NDArray[np.int64], returns: NDArray[np.float64], threshold: float) -> int | None:
    """The episodes of learning before the first evaluation with at least the threshold; None if there is none."""
    there = np.flatnonzero(returns >= threshold)
    return int(episodes[there[0]]) if len(there) else None


def stays(episodes: NDArray[np.int64], returns: NDArray[np.float64], threshold: float) -> int | None:
    """The episodes before the evaluation from which on all have at least the threshold; None if the last has not."""
    below = np.flatnonzero(returns < threshold)
    first = int(below[-1]) + 1 if len(below) else 0
    return int(episodes[first]) if first < len(episodes) else None


def episode_statistics(values: Sequence[int | None], seed: int) -> dict[str, Any]:
    """Mean, median and the mean's bootstrap interval of episodes to convergence.

    Args:
        values: Episodes of each run, None where a run did not get there.
        seed: The seed of the bootstrap.

    Returns:
        ``mean``, ``low`` and ``high`` (95 %), which are None unless all runs got there; ``median``, None unless more
        than half did; and ``reached``, the number of runs that did.
    """
    numbers = np.array([np.inf if value is None else value for value in values], dtype=np.float64)
    median = float(np.median(numbers)) if np.isfinite(numbers).sum() * 2 > len(numbers) else None
    result: dict[str, Any] = {"mean": None, "low": None, "high": None, "median": median}
    if np.isfinite(numbers).all() and len(numbers):
        result["mean"] = float(numbers.mean())
        result["low"], result["high"] = _interval(numbers, np.mean, seed)
    return {**result, "reached": int(np.isfinite(numbers).sum())}


def return_statistics(values: Sequence[float], seed: int) -> dict[str, float]:
    """The runs' mean returns together.

    Args:
        values: The mean return of each run, at least one.
        seed: The seed of the bootstrap.

    Returns:
        ``iqm``, the interquartile mean, and its 95 % bootstrap interval, ``low`` and ``high``.
    """
    numbers = np.asarray(values, dtype=np.float64)
    low, high = _interval(numbers, _interquartile_mean, seed)
    return {"iqm": float(_interquartile_mean(numbers)), "low": low, "high": high}


def ratio(slow: Sequence[int | None], fast: Sequence[int | None], limit: int) -> dict[str, Any]:
    """How many times fewer episodes the fast method needs, by the means over the runs.

    Args:
        slow: Episodes of each run of the slow method; None counts as the limit, which makes the ratio a lower bound.
        fast: Episodes of each run of the fast method; 0 counts as 1.
        limit: The most episodes that the slow method learned for.

    Returns:
        ``value``, None where a run of the fast method did not get there or there is no run, and ``at_least``.
    """
    at_least = any(value is None for value in slow)
    there = [max(value, 1) for value in fast if value is not None]
    if not slow or not fast or len(there) < len(fast):
        return {"value": None, "at_least": at_least}
    numerator = np.mean([limit if value is None else value for value in slow])
    return {"value": float(numerator / np.mean(there)), "at_least": at_least}


def sure_ratio(slow: Sequence[int | None], fast: Sequence[int | None], limit: int) -> float:
    """How many times fewer episodes the fast method needs, where runs that did not get there count with the limit.

    Args:
        slow: Episodes of each run of the slow method, None where a run did not get there.
        fast: Episodes of each run of the fast method, likewise; 0 counts as 1.
        limit: The most episodes that either method learned for.

    Returns:
        The ratio of the means.
    """
    means = [np.mean([limit if value is None else max(value, 1) for value in values]) for values in (slow, fast)]
    return float(means[0] / means[1])


def difference_statistics(ours: Sequence[float], theirs: Sequence[float], seed: int) -> dict[str, float | None]:
    """How much greater the mean over our runs is than the mean over theirs.

    Args:
        ours: A number of each run, at least one.
        theirs: The same of the other runs.
        seed: The seed of the bootstrap.

    Returns:
        ``value``, and its 95 % bootstrap interval over both, ``low`` and ``high``, which are None where either has one
        run only, so that nothing is known of the noise.
    """
    one, other = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
    value = float(one.mean() - other.mean())
    if min(len(one), len(other)) < 2:
        return {"value": value, "low": None, "high": None}
    if np.ptp(one) == 0 and np.ptp(other) == 0:
        return {"value": value, "low": value, "high": value}
    rng = np.random.default_rng(seed)
    found = bootstrap((one, other), _mean_difference, method="percentile", rng=rng, n_resamples=4999)
    interval = found.confidence_interval
    return {"value": value, "low": float(interval.low), "high": float(interval.high)}


def median_statistics(values: Sequence[float], seed: int) -> dict[str, Any]:
    """The median of some ratios and its 95 % bootstrap interval.

    Args:
        values: The ratios.
        seed: The seed of the bootstrap.

    Returns:
        ``median``, ``low`` and ``high``, which are None where there is no ratio; ``count``, how many there are; and
        ``quartiles``, the lower and the upper one.
    """
    numbers = np.asarray(values, dtype=np.float64)
    if not len(numbers):
        return {"median": None, "low": None, "high": None, "count": 0, "quartiles": None}
    low, high = _interval(numbers, np.median, seed)
    quartiles = [float(value) for value in np.percentile(numbers, [25, 75])]
    return {
        "median": float(np.median(numbers)),
        "low": low,
        "high": high,
        "count": len(numbers),
        "quartiles": quartiles,
    }


def _mean_difference(ours: NDArray[np.float64], theirs: NDArray[np.float64], axis: int = -1) -> Any:
    return ours.mean(axis=axis) - theirs.mean(axis=axis)


def _interquartile_mean(values: NDArray[np.float64], axis: int = -1) -> Any:
    return trim_mean(values, 0.25, axis=axis)


def _interval(values: NDArray[np.float64], statistic: Any, seed: int) -> tuple[float, float]:
    """The 95 % percentile bootstrap interval of a statistic."""
    if np.ptp(values) == 0:  # one run, or all the same
        return float(values[0]), float(values[0])
    rng = np.random.default_rng(seed)
    found = bootstrap((values,), statistic, method="percentile", rng=rng, n_resamples=4999)
    return float(found.confidence_interval.low), float(found.confidence_interval.high)
