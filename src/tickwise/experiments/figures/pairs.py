"""How random pairs of tasks were judged, and what the formula and the transfer bought on those that are similar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from tickwise.experiments.figures.convergence import spread
from tickwise.experiments.figures.style import BLUE, GREEN, INK, MUTED, VERMILION, canvas

_KINDS = (("similar", "identified", GREEN), ("dissimilar", "refused", GREEN))
_WRONG = {"similar": "missed", "dissimilar": "identified"}
_PAIRS = {"I/III": ("III over I\n(the formula)", BLUE), "III/IV": ("IV over III\n(the transfer)", VERMILION)}


def draw(results: Mapping[str, Any]) -> Figure:
    """Left, how many pairs were judged rightly; right, the speed-up on each similar pair, its median and interval."""
    figure = canvas(3.9)
    _judgement(figure.add_axes((0.105, 0.2, 0.355, 0.68)), results["identification"])
    _speed_ups(figure.add_axes((0.56, 0.2, 0.425, 0.68)), results)
    return figure


def _judgement(axes: Axes, identification: Mapping[str, Any]) -> None:
    axes.set_title("Judged rightly")
    for place, (kind, right, colour) in enumerate(_KINDS):
        found = identification[kind]
        if not found["of"]:
            continue
        share = 100 * found["share"]
        axes.barh(place, share, height=0.46, color=colour, alpha=0.85, zorder=2)
        axes.barh(
            place, 100 - share, left=share, height=0.46, facecolor="white", edgecolor=VERMILION, hatch="///", zorder=2
        )
        axes.plot([100 * found["low"], 100 * found["high"]], [place + 0.33] * 2, color=INK, linewidth=1.8, zorder=4)
        text = f"{found['right']} of {found['of']} {right}"
        if found["right"] < found["of"]:
            text += f", {found['of'] - found['right']} {_WRONG[kind]}"
        axes.text(0, place - 0.33, text, va="bottom", fontsize=9.5)
    axes.axvline(90, color=MUTED, linewidth=1, linestyle=(0, (2, 2)), zorder=3)
    axes.set(xlim=(0, 100), ylim=(1.75, -0.75), xlabel="share of the pairs in %, with its 95 % interval")
    axes.set_yticks(range(len(_KINDS)), ["similar\npairs", "dissimilar\npairs"])
    axes.tick_params(axis="y", length=0)
    axes.grid(True, axis="x")


def _speed_ups(axes: Axes, results: Mapping[str, Any]) -> None:
    axes.set_title("Times fewer episodes to the goal")
    shown: list[float] = [1.0]
    for place, (pair, (_, colour)) in enumerate(_PAIRS.items()):
        values = [row["speed_ups"][pair]["goal"] for row in results["pairs"] if row["similar"] and row["speed_ups"]]
        shown += values
        _points(axes, place, values, colour)
        found = results["speed_ups"][pair]["goal"]
        if found["median"] is None:
            continue
        axes.plot([place - 0.3, place + 0.3], [found["median"]] * 2, color=INK, linewidth=2.4, zorder=5)
        axes.fill_between(
            [place - 0.3, place + 0.3], found["low"], found["high"], color=INK, alpha=0.14, linewidth=0, zorder=2
        )
        axes.annotate(
            f"{found['median']:.1f}", (place + 0.3, found["median"]), xytext=(5, 0), textcoords="offset points",
            va="center", fontsize=10, weight="bold",
        )  # fmt: skip
    axes.axhline(1, color=MUTED, linewidth=1, linestyle=(0, (2, 2)), zorder=1)
    axes.set(yscale="log", xlim=(-0.6, len(_PAIRS) - 0.35), ylim=(0.6 * min(shown), 1.7 * max(shown)))
    axes.set_xticks(range(len(_PAIRS)), [f"Method {label}" for label, _ in _PAIRS.values()])
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}×"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.grid(True, axis="y")


def _points(axes: Axes, place: int, values: Sequence[float], colour: str) -> None:
    """A point a pair of tasks."""
    numbers = np.array(values, dtype=np.float64)
    axes.scatter(
        place + spread(len(numbers), 0.42), numbers, s=28, color=colour, alpha=0.75, edgecolors="white",
        linewidths=0.5, zorder=4,
    )  # fmt: skip
