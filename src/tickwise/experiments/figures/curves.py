"""Learning curves: the counterpart of the paper's figures of learning results, left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullLocator

from tickwise.experiments.curves import Curve, evaluation_curve, interval, training_curve
from tickwise.experiments.figures.style import GREEN, METHODS, canvas
from tickwise.experiments.study import StudySpec


def draw(results: Mapping[str, Any], spec: StudySpec) -> Figure | None:
    """Returns in training over the first episodes, and of the greedy policy over all on a log axis."""
    methods = {name: results["methods"][name] for name in METHODS if results["methods"].get(name)}
    if not methods:
        return None
    figure = canvas(4.6)
    left = figure.add_axes((0.085, 0.235, 0.395, 0.675))
    right = figure.add_axes((0.59, 0.235, 0.395, 0.675), sharey=left)
    for name, runs in methods.items():
        _band(left, name, training_curve(runs, spec.learning.block, spec.learning.shown))
        _band(right, name, evaluation_curve(runs))
    for axes in (left, right):
        _optimum(axes, results["summary"]["v_star"])
        axes.grid(True)
        axes.set_ylim(*return_limits(results["summary"]))
    left.set(
        xlim=(0, spec.learning.shown),
        xlabel="episodes (thousands)",
        ylabel=f"mean return of {spec.learning.block} episodes",
    )
    left.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / 1000:g}"))
    left.set_title("Training")
    right.set(xscale="log", xlabel="episodes (log scale)", ylabel="mean return of the greedy policy")
    right.xaxis.set_major_formatter(FuncFormatter(lambda value, _: short(value)))
    right.xaxis.set_minor_locator(NullLocator())
    right.set_title("Greedy policy")
    _legend(figure, list(methods))
    return figure


def return_limits(summary: Mapping[str, Any]) -> tuple[float, float]:
    """The range of an axis of returns: from always failing to V*, and some room."""
    room = 0.04 * (summary["v_star"] - summary["fail"])
    return summary["fail"] - room, summary["v_star"] + 2.5 * room


def short(value: float) -> str:
    """A number of episodes in few signs, for instance ``2M`` or ``10k``."""
    if value >= 1_000_000:
        return f"{value / 1_000_000:g}M"
    return f"{value / 1000:g}k" if value >= 1000 else f"{value:g}"


def _band(axes: Axes, name: str, curve: Curve) -> None:
    look = METHODS[name]
    episodes, rows = curve
    axes.plot(
        episodes, rows.mean(axis=0), color=look.colour, linestyle=look.line, linewidth=1.9, zorder=3,
        marker=look.marker, markersize=5, markevery=max(1, len(episodes) // 9), markeredgecolor="white",
        markeredgewidth=0.6,
    )  # fmt: skip
    if len(rows) > 1 and rows.shape[1]:
        low, high = interval(rows)
        axes.fill_between(episodes, low, high, color=look.colour, alpha=0.16, linewidth=0, zorder=2)


def _optimum(axes: Axes, value: float) -> None:
    axes.axhline(value, color=GREEN, linewidth=1.4, linestyle=(0, (2, 1.5)), zorder=1)
    axes.annotate(
        f"optimum $V^*$ = {value:.1f}", (0.985, value), xycoords=("axes fraction", "data"), xytext=(0, 3),
        textcoords="offset points", ha="right", va="bottom", color="#00694C", fontsize=9.5,
    )  # fmt: skip


def _legend(figure: Figure, names: Sequence[str]) -> None:
    handles = [
        Line2D(
            [],
            [],
            color=look.colour,
            linestyle=look.line,
            marker=look.marker,
            markersize=5.5,
            linewidth=1.9,
            markeredgecolor="white",
            label=f"{name}: {look.meaning}",
        )
        for name, look in METHODS.items()
        if name in names
    ]
    figure.legend(
        handles=handles,
        loc="lower center",
        ncols=min(len(handles), 3) if len(handles) > 4 else 4,
        columnspacing=1.6,
        handlelength=3.2,
    )
