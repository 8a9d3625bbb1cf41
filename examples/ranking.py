"""How well predictors of transfer rank sources: statistics and figures of `similarity.py`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.ticker import StrMethodFormatter
from numpy.typing import NDArray
from scipy.stats import norm, rankdata

from tickwise.experiments.figures.style import BLUE, MUTED, STYLE, VERMILION, canvas
from tickwise.logic.alignment import align
from tickwise.logic.parse import parse

Group = dict[str, Any]
"""A target with its sources, as `similarity.measured` gives it."""

Interval = tuple[float, float]

RESAMPLES = 2_000
SPLITS = 50
NEAR = 1.2
"""A choice is good if it takes at most this many times the episodes of the best source."""

AT_ONCE = 2
"""Windows this many ticks apart, at most, come at about the same time."""

SMALL_IS_GOOD = ("disagreement", "dissimilarity", "regions", "windows", "shift", "delay")
"""What the names of distances end with; of all other predictors more is better."""


class Table:
    """The groups as arrays.

    A run that did not get there counts with the most episodes, and one that had nothing to learn with a step.

    Attributes:
        runs: Episodes of each run, shape ``(groups, sources, runs)``.
        speedups: Mean episodes without transfer by those with it, shape ``(groups, sources)``.
        scores: What each predictor says, the more the better, each of shape ``(groups, sources)``.
    """

    def __init__(self, groups: Sequence[Group], most: int, step: int) -> None:
        def episodes(times: Sequence[int | None]) -> list[int]:
            return [most if time is None else max(time, step) for time in times]

        self.runs = np.array([[episodes(source["episodes"]) for source in group["sources"]] for group in groups])
        alone = np.array([episodes(group["episodes"]) for group in groups]).mean(axis=1)
        self.speedups = alone[:, None] / self.means
        self.scores: dict[str, NDArray[np.float64]] = {}
        for name in groups[0]["sources"][0]["predictors"]:
            values = np.array([[source["predictors"][name] for source in group["sources"]] for group in groups])
            self.scores[name] = -values if name.endswith(SMALL_IS_GOOD) else values

    @property
    def means(self) -> NDArray[np.float64]:
        """Mean episodes with transfer, shape ``(groups, sources)``."""
        return np.asarray(self.runs.mean(axis=2))


def correlation(left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Spearman's rank correlation along the last axis; 0 where one of the two is constant, since it tells nothing."""
    one, other = (rankdata(values, axis=-1) - (values.shape[-1] + 1) / 2 for values in (left, right))
    scale = np.sqrt((one**2).sum(axis=-1) * (other**2).sum(axis=-1))
    return np.asarray((one * other).sum(axis=-1) / np.where(scale > 0, scale, 1.0))


def choices(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Which source of each group comes first, as weights: equal ones share; shape ``(groups, sources)``."""
    first = scores == scores.max(axis=1, keepdims=True)
    return np.asarray(first / first.sum(axis=1, keepdims=True))


def good(chosen: NDArray[np.float64], means: NDArray[np.float64]) -> NDArray[np.float64]:
    """For each group whether what was chosen is near the best."""
    near = means <= NEAR * means.min(axis=1, keepdims=True)
    return np.asarray((chosen * near).sum(axis=1))


def ceiling(runs: NDArray[np.int64]) -> float:
    """How often the best source of one half of the runs is near the best of the other half: noise allows no more."""
    rng, shares = np.random.default_rng(0), []
    for _ in range(SPLITS):
        order = rng.permutation(runs.shape[2])
        one, other = (runs[:, :, half].mean(axis=2) for half in np.array_split(order, 2))
        shares.append(good(choices(-one), other).mean())
    return float(np.mean(shares))


def wilson(share: float, count: int) -> Interval:
    """The 95 % interval of Wilson for a share of so many."""
    z = float(norm.ppf(0.975))
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count**2))
    return middle - half, middle + half


def interval(values: NDArray[np.float64]) -> Interval:
    """The middle 95 % of resampled values."""
    low, high = np.percentile(values, [2.5, 97.5])
    return float(low), float(high)


def geometric(values: NDArray[np.float64]) -> float:
    """The geometric mean."""
    return float(np.exp(np.log(values).mean()))


def judged(score: NDArray[np.float64], found: Table) -> dict[str, Any]:
    """What a predictor is worth: rank correlations, and how good its first choices are; intervals resample groups."""
    count, rng = len(score), np.random.default_rng(0)
    within = correlation(score, found.speedups)
    chosen = choices(score)
    hits = good(chosen, found.means)
    gained = (chosen * np.log(found.speedups)).sum(axis=1)
    drawn = rng.integers(count, size=(RESAMPLES, count))
    resampled = (values[drawn].reshape(RESAMPLES, -1) for values in (score, found.speedups))
    share = float(hits.mean())
    return {
        "correlation": float(correlation(score.ravel(), found.speedups.ravel())),
        "correlation_interval": interval(correlation(*resampled)),
        "within": float(within.mean()),
        "within_interval": interval(within[drawn].mean(axis=1)),
        "good": share,
        "good_interval": wilson(share, count),
        "speedup": float(np.exp(gained.mean())),
        "speedup_interval": interval(np.exp(gained[drawn].mean(axis=1))),
    }


def summary(groups: Sequence[Group], most: int, step: int) -> dict[str, Any]:
    """Everything that is reported.

    Args:
        groups: The groups.
        most: Episodes of a run at most.
        step: Episodes between evaluations.
    """
    found = Table(groups, most, step)
    best = found.speedups.max(axis=1)
    anyone = good(np.full(found.means.shape, 1 / found.means.shape[1]), found.means)
    models = groups[0]["learned in models"]
    modelled = {name: np.array([group["learned in models"][name] for group in groups]) for name in models}
    return {
        "groups": len(groups),
        "pairs": found.speedups.size,
        "speedup_quantiles": {str(q): float(np.quantile(found.speedups, q)) for q in (0.05, 0.25, 0.5, 0.75, 0.95)},
        "hurt": float((found.speedups < 1).mean()),
        "any_source": {"good": float(anyone.mean()), "speedup": geometric(found.speedups)},
        "best_source": {"speedup": geometric(best), "hurt": float((best < 1).mean())},
        "ceiling": ceiling(found.runs),
        "delays": by_delay(groups, found),
        "predictors": {name: judged(score, found) for name, score in found.scores.items()},
        "none_or_first": {
            name: refused(score, found) for name, score in found.scores.items() if name.startswith("rehearsal")
        },
        "learned_in_models": {
            name: {"mean": float(shares.mean()), "at_least_95_percent": float((shares >= 0.95).mean())}
            for name, shares in modelled.items()
        },
    }


def by_delay(groups: Sequence[Group], found: Table) -> dict[str, dict[str, float]]:
    """The speed-ups by whether the target's windows come earlier than the source's, later, or about the same time."""
    pairs = [(source["formula"], group["target"]["formula"]) for group in groups for source in group["sources"]]
    delays = np.array([align(parse(source), parse(target)).delay for source, target in pairs])
    speedups = found.speedups.ravel()
    kinds = {"earlier": delays < -AT_ONCE, "alike": abs(delays) <= AT_ONCE, "later": delays > AT_ONCE}
    return {
        kind: {
            "pairs": float(rows.sum()),
            "hurt": float((speedups[rows] < 1).mean()),
            "twice": float((speedups[rows] > 2).mean()),
        }
        for kind, rows in kinds.items()
        if rows.any()
    }


def refused(score: NDArray[np.float64], found: Table) -> dict[str, float]:
    """What comes of transferring only where a rehearsal is faster with the first choice than without any source."""
    first = score.argmax(axis=1)[:, None]
    gained = np.take_along_axis(found.speedups, first, axis=1)[:, 0]
    taken = np.take_along_axis(score, first, axis=1)[:, 0] > 1
    return {
        "taken": float(taken.mean()),
        "right": float(((score > 1) == (found.speedups > 1)).mean()),
        "speedup": geometric(np.where(taken, gained, 1.0)),
        "hurt": float((taken & (gained < 1)).mean()),
    }


def table(found: Mapping[str, Any]) -> str:
    """The summary as text."""

    def span(ends: Interval, digits: int = 2) -> str:
        return f"[{ends[0]:.{digits}f}, {ends[1]:.{digits}f}]"

    lines = [
        f"{found['pairs']} pairs in {found['groups']} groups; transfer hurts in {found['hurt']:.0%} of the pairs",
        f"{'predictor':<34}{'rank correlation':<22}{'within groups':<22}{'good first choice':<20}its speed-up",
    ]
    for name, each in sorted(found["predictors"].items(), key=lambda item: item[1]["good"]):
        lines.append(
            f"{name:<34}{each['correlation']:5.2f} {span(each['correlation_interval']):<16}"
            f"{each['within']:5.2f} {span(each['within_interval']):<16}"
            f"{each['good']:4.0%} {span(each['good_interval']):<15}"
            f"{each['speedup']:5.2f} {span(each['speedup_interval'])}"
        )
    chance, best = found["any_source"], found["best_source"]
    lines += [
        f"{'any source':<78}{chance['good']:4.0%}{'':<16}{chance['speedup']:5.2f}",
        f"{'the best source':<78}{found['ceiling']:4.0%} (noise){'':<8}{best['speedup']:5.2f}",
    ]
    for kind, each in found["delays"].items():
        what = {"alike": f"within {AT_ONCE} ticks"}.get(kind, f"more than {AT_ONCE} ticks {kind}")
        lines.append(
            f"target's windows {what}: {each['pairs']:.0f} pairs, transfer hurts in {each['hurt']:.0%} and is at least "
            f"twice as fast in {each['twice']:.0%}"
        )
    for name, each in found["none_or_first"].items():
        lines.append(
            f"{name}, or no transfer: speed-up {each['speedup']:.2f}, {each['hurt']:.0%} of targets hurt, "
            f"{each['taken']:.0%} take a source, {each['right']:.0%} of pairs judged rightly"
        )
    for name, each in found["learned_in_models"].items():
        lines.append(
            f"learned in the model of {name} alone: {each['mean']:.0%} of the best success, "
            f"{each['at_least_95_percent']:.0%} of targets with 95 % of it"
        )
    return "\n".join(lines)


PANELS = {
    "aligned dissimilarity": "dissimilarity after alignment",
    "promise, 500 walks": "promise: chance of success of\nthe transferred policy, in the model",
    "rehearsal, 500 walks": "speed-up in the rehearsal",
}
"""What the scatter shows, with the labels of the axes; the models are from 500 random walks."""


def draw_scatter(groups: Sequence[Group], found: Mapping[str, Any], most: int, step: int, path: Path) -> None:
    """Draw what three predictors say against the speed-up; a marker tells the number of primitives."""
    data = Table(groups, most, step)
    parts = np.array([group["target"]["primitives"] for group in groups])
    with matplotlib.rc_context(STYLE):
        figure = canvas(3.9, 10.5)
        axes = figure.subplots(1, len(PANELS), sharey=True)
        for each, (name, label) in zip(axes, PANELS.items(), strict=True):
            values = -data.scores[name] if name.endswith(SMALL_IS_GOOD) else data.scores[name]
            for count, colour, marker in ((1, BLUE, "o"), (2, VERMILION, "^")):
                rows = parts == count
                what = f"{count} primitive" + "s" * (count > 1)
                style: dict[str, Any] = {"s": 14, "alpha": 0.55, "linewidths": 0, "label": what}
                each.scatter(values[rows], data.speedups[rows], c=colour, marker=marker, **style)
            sign = -1 if name.endswith(SMALL_IS_GOOD) else 1
            each.axhline(1, color=MUTED, linewidth=1)
            each.set(yscale="log", xlabel=label)
            each.set_title(f"rank correlation {sign * found['predictors'][name]['correlation']:.2f}")
            each.grid(axis="y")
            each.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            if name.startswith("rehearsal"):
                each.set_xscale("log")
                each.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes[0].set_ylabel("measured speed-up")
        axes[-1].legend(loc="lower right", handletextpad=0.1, markerscale=1.6)
        figure.savefig(path, bbox_inches="tight", dpi=150)


def draw_choices(found: Mapping[str, Any], path: Path) -> None:
    """Draw how often each predictor's first choice is good, with intervals, between chance and what noise allows."""
    ordered = sorted(found["predictors"].items(), key=lambda item: item[1]["good"])
    with matplotlib.rc_context(STYLE):
        figure = canvas(0.3 * len(ordered) + 1.2, 8)
        axes = figure.subplots()
        for row, (_, each) in enumerate(ordered):
            axes.plot([100 * end for end in each["good_interval"]], [row, row], color=BLUE, linewidth=2)
            axes.plot(100 * each["good"], row, "o", color=BLUE)
        for share, what, line in (
            (found["any_source"]["good"], "any source", ":"),
            (found["ceiling"], "what noise allows", "--"),
        ):
            axes.axvline(100 * share, color=VERMILION, linestyle=line, label=what)
        axes.set(
            xlim=(0, 100), xlabel="groups whose first choice takes at most 1.2 times the best source's episodes, %"
        )
        axes.set_yticks(range(len(ordered)), [name for name, _ in ordered])
        axes.grid(axis="x")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        figure.savefig(path, bbox_inches="tight", dpi=150)
