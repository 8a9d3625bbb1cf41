"""The picture of how cost grows: one panel for each benchmark and axis, one line for each contender."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.result import OURS, Result, duration

# Okabe and Ito's colours, which the colour-blind tell apart; markers differ too.
_STYLES = {OURS: ("#0072B2", "o"), "C": ("#000000", "s")}
_OTHERS = (
    ("#D55E00", "^"), ("#009E73", "v"), ("#CC79A7", "D"), ("#E69F00", "P"), ("#56B4E9", "X"), ("#666666", "*"),
)  # fmt: skip
_LABELS = {
    "trajectories": "trajectories",
    "ticks": "ticks",
    "world": "cells along a side of the world",
    "runs": "runs",
}
_GAP = 0.075
"""The least distance of two labels, as a part of a panel's height."""


def draw(results: list[Result], path: Path, columns: int = 3) -> None:
    """Draw the growth as SVG and PNG beside ``path``; nothing where no benchmark has two sizes.

    Args:
        results: All results.
        path: The path without an ending.
        columns: Panels in a row.
    """
    panels = _panels(results)
    if not panels:
        return
    styles = _styles(panels)
    rows = math.ceil(len(panels) / columns)
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "growth", "font.size": 9}):
        figure = Figure(figsize=(4.6 * columns, 3.3 * rows), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, ((benchmark, axis), lines) in zip(grid, panels.items(), strict=False):
            _panel(axes, benchmark, axis, lines, styles)
        for axes in grid[len(panels) :]:
            axes.set_visible(False)
        figure.savefig(path.with_suffix(".svg"), metadata={"Date": None})
        figure.savefig(path.with_suffix(".png"), dpi=150)


Lines = dict[str, list[Result]]


def _panels(results: list[Result]) -> dict[tuple[str, str], Lines]:
    """The measured results by benchmark and axis, and by contender; only where something grows."""
    panels: dict[tuple[str, str], Lines] = {}
    for one in sorted(results, key=lambda one: one.size):
        if one.axis != "none" and one.seconds is not None:
            panels.setdefault((one.benchmark, one.axis), {}).setdefault(one.contender, []).append(one)
    return {key: lines for key, lines in panels.items() if max(map(len, lines.values())) > 1}


def _styles(panels: dict[tuple[str, str], Lines]) -> dict[str, tuple[str, str]]:
    """A style for each contender, the same in all panels and another than those it shares a panel with."""
    styles = dict(_STYLES)
    for name in dict.fromkeys(name for lines in panels.values() for name in lines):
        beside = {styles.get(other) for lines in panels.values() if name in lines for other in lines}
        free = [style for style in _OTHERS if style not in beside]
        styles.setdefault(name, (free or _OTHERS)[0])
    return styles


def _panel(axes: Axes, benchmark: str, axis: str, lines: Lines, styles: dict[str, tuple[str, str]]) -> None:
    unit = next(iter(lines.values()))[0].unit
    axes.set_xscale("log")
    axes.set_yscale("log")
    for name, line in lines.items():
        colour, marker = styles[name]
        sizes, costs = [one.size for one in line], [one.cost for one in line]
        dashes = "--" if name == "C" else "-"
        axes.plot(
            sizes, costs, dashes, color=colour, marker=marker, markersize=4.5, linewidth=2 if name == OURS else 1.2
        )
    axes.margins(y=0.15)  # room for the names of lines that end early
    sizes = sorted({one.size for line in lines.values() for one in line})
    _sizes_on_axis(axes, sizes)
    axes.set_xlabel(_LABELS[axis])
    axes.set_ylabel(f"time per {unit}")
    axes.yaxis.set_major_formatter(lambda cost, _: duration(cost))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_title(benchmark, loc="left", fontweight="bold", fontsize=10)
    axes.grid(True, which="major", color="#DDDDDD", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    _widen(axes)
    _name_lines(axes, lines, styles)


def _sizes_on_axis(axes: Axes, sizes: list[int]) -> None:
    """The very sizes as ticks where they are few and close; powers of ten otherwise."""
    if sizes[-1] / sizes[0] < 1000:
        axes.set_xticks(sizes, [f"{size:,}" for size in sizes])
        axes.minorticks_off()


def _widen(axes: Axes) -> None:
    """At least one power of ten upwards, so that noise does not look like growth."""
    low, high = axes.get_ylim()
    if high / low < 10:
        middle = math.sqrt(low * high)
        low, high = middle / math.sqrt(10), middle * math.sqrt(10)
    axes.set_ylim(low, high)
    if high / low < 100:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))


def _name_lines(axes: Axes, lines: Lines, styles: dict[str, tuple[str, str]]) -> None:
    """Each line's name to the right of its end, or of its only point; those at the margin move apart."""
    low, high = (math.log10(end) for end in axes.get_ylim())
    last = max(line[-1].size for line in lines.values())
    ends = {}
    for name, line in lines.items():
        style = {"color": styles[name][0], "fontweight": "bold" if name == OURS else "normal", "va": "center"}
        if line[-1].size == last:
            ends[name] = (math.log10(line[-1].cost or 1.0) - low) / (high - low), style
        elif len(line) == 1:
            _name_point(axes, name, line[-1], (6, 0), style)
        else:
            _name_point(axes, name, line[-1], (0, 6), style | {"va": "bottom", "ha": "center"})
    heights = _apart([height for height, _ in ends.values()])
    for (name, (_, style)), height in zip(ends.items(), heights, strict=True):
        axes.annotate(name, (1.02, height), xycoords="axes fraction", annotation_clip=False, **style)


def _name_point(axes: Axes, name: str, one: Result, offset: tuple[int, int], style: dict[str, str]) -> None:
    axes.annotate(name, (one.size, one.cost or 1.0), offset, textcoords="offset points", **style)


def _apart(heights: list[float]) -> list[float]:
    """Heights at least a gap apart, in the same order, each group around where it was."""
    order = sorted(range(len(heights)), key=lambda index: heights[index])
    groups: list[list[int]] = []
    centre = {}
    for index in order:
        groups.append([index])
        centre[index] = heights[index]
        while len(groups) > 1:
            below, above = groups[-2], groups[-1]
            room = (len(below) + len(above)) * _GAP / 2
            if centre[above[0]] - centre[below[0]] >= room - 1e-12:
                break
            merged = below + above
            centre[merged[0]] = sum(heights[one] for one in merged) / len(merged)
            groups[-2:] = [merged]
    moved = list(heights)
    for group in groups:
        for place, index in enumerate(group):
            moved[index] = centre[group[0]] + (place - (len(group) - 1) / 2) * _GAP
    return moved
