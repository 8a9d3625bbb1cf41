"""How good each run was, and how fast: the counterpart of the paper's box plots and numbers of episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from tickwise.experiments.figures.curves import return_limits, short
from tickwise.experiments.figures.style import GREEN, INK, METHODS, MUTED, PAPER, canvas, thousands
from tickwise.experiments.study import StudySpec


def draw_boxplot(results: Mapping[str, Any], spec: StudySpec) -> Figure | None:
    """The mean return of each run over the paper's window: a box a method, with a point a run."""
    methods = _present(results)
    if not methods:
        return None
    figure = canvas(4.3, 7.0)
    axes = figure.add_axes((0.11, 0.16, 0.87, 0.78))
    for place, (name, runs) in enumerate(methods.items()):
        look = METHODS[name]
        means = np.array([run["window_mean"] for run in runs], dtype=np.float64)
        axes.boxplot(
            [means], positions=[place], widths=0.5, showfliers=False, patch_artist=True,
            boxprops={"facecolor": PAPER, "edgecolor": look.colour, "linewidth": 1.5},
            whiskerprops={"color": look.colour, "linewidth": 1.3},
            capprops={"color": look.colour, "linewidth": 1.3},
            medianprops={"color": look.colour, "linewidth": 2.6},
        )  # fmt: skip
        axes.scatter(
            place + spread(len(means), 0.3), means, s=30, marker=look.marker, color=look.colour, alpha=0.75,
            edgecolors="white", linewidths=0.5, zorder=4,
        )  # fmt: skip
    v_star = results["summary"]["v_star"]
    axes.axhline(v_star, color=GREEN, linewidth=1.4, linestyle=(0, (2, 1.5)), zorder=1)
    axes.annotate(
        f"optimum $V^*$ = {v_star:.1f}", (0.01, v_star), xycoords=("axes fraction", "data"), xytext=(0, 3),
        textcoords="offset points", va="bottom", color="#00694C", fontsize=9.5,
    )  # fmt: skip
    labels = [f"Method {name}\n{METHODS[name].meaning}" for name in methods]
    axes.set_xticks(range(len(methods)), labels)
    axes.set(xlim=(-0.6, len(methods) - 0.4), ylim=return_limits(results["summary"]))
    axes.set_ylabel(f"mean return of {thousands(spec.learning.window)} episodes")
    axes.grid(True, axis="y")
    return figure


def draw_convergence(results: Mapping[str, Any], spec: StudySpec) -> Figure | None:
    """Episodes to convergence of each run by two measures, beside the paper's numbers."""
    methods = _present(results)
    if not methods:
        return None
    height = 1.55 + 0.72 * len(methods)
    figure = canvas(height)
    panels = _panels(spec)
    for number, (title, measure, published) in enumerate(panels):
        axes = figure.add_axes((0.105 + 0.455 * number, 1.08 / height, 0.425, 1 - 1.48 / height))
        for place, (name, runs) in enumerate(methods.items()):
            _runs(axes, place, name, [measure(run) for run in runs], [run["episodes"] for run in runs])
            _published(axes, place, published, name)
        axes.set(xscale="log", ylim=(len(methods) - 0.45, -0.6), xlabel="episodes (log scale)")
        axes.set_yticks(range(len(methods)), [f"Method {name}" for name in methods] if number == 0 else [])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: short(value)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.grid(True, axis="x")
        axes.tick_params(axis="y", length=0)
        axes.set_title(title)
    shown = [measure(run) for runs in methods.values() for run in runs for _, measure, _ in panels]
    shown += [run["episodes"] for runs in methods.values() for run in runs]
    shown += [published.get(name) for name in methods for _, _, published in panels]
    low = 0.6 * max(1, min(value for value in shown if value is not None))
    most = max(PUBLISHED_LIMIT if spec.published.episodes else 0, *(value for value in shown if value is not None))
    for axes in figure.axes:
        axes.set_xlim(low, most * (most / low) ** _ROOM)
        axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(7) if 10.0**power >= low]))
    _legend(figure)
    return figure


_Panel = tuple[str, Callable[[Mapping[str, Any]], int | None], Mapping[str, int | None]]
"""A title, a measure of a run, and the paper's numbers."""


def _panels(spec: StudySpec) -> tuple[_Panel, _Panel]:
    heading = spec.learning.goal.heading
    goal: _Panel = (heading[:1].upper() + heading[1:], lambda run: run["goal"], spec.published.episodes)
    if spec.published.settled:
        return goal, ("Training has settled", lambda run: run["settled"], spec.published.settled)
    return goal, ("Greedy policy at 90 % of V*", lambda run: run["reached"]["90"], spec.published.episodes)


def _present(results: Mapping[str, Any]) -> dict[str, Any]:
    return {name: results["methods"][name] for name in METHODS if results["methods"].get(name)}


def spread(count: int, width: float) -> NDArray[np.float64]:
    """Offsets that keep points apart, the same each time."""
    return np.asarray((np.arange(count) * 0.618034 % 1 - 0.5) * width, dtype=np.float64)


def _runs(axes: Axes, place: int, name: str, values: Sequence[int | None], limits: Sequence[int]) -> None:
    look = METHODS[name]
    there = np.array([max(value, 1) for value in values if value is not None], dtype=np.float64)
    axes.scatter(
        there, place + 0.1 + spread(len(there), 0.34), s=30, marker=look.marker, color=look.colour,
        alpha=0.75, edgecolors="white", linewidths=0.5, zorder=4,
    )  # fmt: skip
    missing = len(values) - len(there)
    if missing:  # not within their episodes: an arrow from the limit onwards
        _onwards(axes, (max(limits), place + 0.1), look.colour, f"{missing} run{'s' if missing > 1 else ''}")
    elif len(there):
        mean = float(there.mean())
        axes.plot([mean, mean], [place - 0.16, place + 0.36], color=look.colour, linewidth=2.6, zorder=5)


def _published(axes: Axes, place: int, published: Mapping[str, int | None], name: str) -> None:
    if name not in published:
        return
    episodes = published[name]
    x, y = PUBLISHED_LIMIT if episodes is None else episodes, place - 0.3
    if episodes is None:
        _onwards(axes, (x, y), INK)
    axes.plot(
        x, y, marker="*", markersize=12, markerfacecolor=PAPER, markeredgecolor=INK, markeredgewidth=1.1,
        linestyle="none", zorder=6,
    )  # fmt: skip


def _onwards(axes: Axes, place: tuple[float, float], colour: str, text: str = "") -> None:
    """An arrow from a limit to the right, with a text at its head."""
    axes.annotate(
        f" {text}", place, xytext=(22, 0), textcoords="offset points", va="center", fontsize=9.5,
        arrowprops={"arrowstyle": "<|-", "color": colour, "lw": 1.8, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip


PUBLISHED_LIMIT = 2_000_000
"""Where the paper says that a method does not converge, it had so many episodes."""

_ROOM = 0.27  # share of the axis for arrows and what they say


def _legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], marker="D", color=MUTED, linestyle="none", markersize=6, label="a run"),
        Line2D([], [], marker="|", color=MUTED, linestyle="none", markersize=13, markeredgewidth=2.6,
               label="mean, where all runs got there"),
        Line2D([], [], marker=r"$\rightarrow$", color=MUTED, linestyle="none", markersize=11,
               label="not within the episodes given"),
        Line2D([], [], marker="*", markerfacecolor=PAPER, markeredgecolor=INK, linestyle="none",
               markersize=12, label="paper"),
    ]  # fmt: skip
    figure.legend(handles=handles, loc="lower center", ncols=4, columnspacing=1.8, handletextpad=0.4)
