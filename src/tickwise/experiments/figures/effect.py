"""What a setting does: a small panel a measure, with a point a collection, the median, and the range shaded."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator
from numpy.typing import NDArray

from tickwise.experiments.figures.style import BLUE, GREEN, INK, MUTED, VERMILION, WIDTH, canvas

_ROW = 2.75  # inches, as all lengths here
_FOOT = 0.36
_LEFT, _BELOW, _ABOVE, _BETWEEN = 0.72, 0.55, 0.5, 0.88
_CHARACTER = 0.083
_FAR = 1.5  # ranges of the numbers
_SYMBOLS = {
    "φˢ": r"$\varphi^{\mathrm{S}}$", "φᵀ": r"$\varphi^{\mathrm{T}}$", "hₘₐₓ": r"$h_{\mathrm{max}}$",
    "ϱₜₕ": r"$\varrho_{\mathrm{th}}$", "V*": "$V^*$", "N⁻": "$N^{-}$", "source, N": "source, $N$",
}  # fmt: skip

Data = Mapping[str, Any]


def draw(results: Data) -> Figure | None:
    """The measures over the values, which stand at equal distances; None where nothing is measured.

    Equal distances, since some settings go by factors, some by steps, and some by factors from 0 on.
    """
    summary, measures = results["summary"], list(results["summary"]["measures"].values())
    if not measures:
        return None
    figure, panels = _panels(len(measures))
    for axes, measure in zip(panels, measures, strict=True):
        _over_values(axes, summary, measure, BLUE)
    kinds = {"share" if measure["share"] else "runs" for measure in measures}
    kinds |= {"none" for measure in measures if None in measure["middle"]}
    _legend(figure, BLUE, kinds | {"own"})
    return figure


def draw_times(results: Data) -> Figure | None:
    """The times over the values, or over the size of the problem on logarithmic axes; None where nothing is timed."""
    summary, times = results["summary"], results["times"]
    measures = list(times["measures"].values())
    if not measures:
        return None
    figure, panels = _panels(len(measures))
    size = times.get("size")
    for axes, measure in zip(panels, measures, strict=True):
        if size is None:
            _over_values(axes, summary, measure, VERMILION)
        else:
            _over_sizes(axes, size, measure, VERMILION)
    _legend(figure, VERMILION, {"runs", "own" if size is None else "growth"})
    return figure


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    """A figure with axes for so many panels, row by row: two broad ones a row where that leaves no gap, else three."""
    columns = 2 if count in (1, 2, 4) else 3
    rows = math.ceil(count / columns)
    panel, height = WIDTH / columns, _ROW * rows + _FOOT
    figure = canvas(height)
    panels = []
    for number in range(count):
        row, column = divmod(number, columns)
        left, bottom = panel * column + _LEFT, height - _ROW * (row + 1) + _BELOW
        if count == 1:
            left += panel / 2  # in the middle
        size = (panel - _BETWEEN) / WIDTH, (_ROW - _BELOW - _ABOVE) / height
        panels.append(figure.add_axes((left / WIDTH, bottom / height, *size)))
    return figure, panels


def _over_values(axes: Axes, summary: Data, measure: Data, colour: str) -> None:
    values = summary["values"]
    places = np.arange(len(values), dtype=np.float64)
    middle = _numbers(measure["middle"])
    if measure["share"]:
        axes.bar(places, middle, width=0.62, color=colour, alpha=0.75, zorder=2)
        axes.set_ylim(0, 1.08)
    else:
        _runs(axes, [[place] * len(row) for place, row in zip(places, measure["runs"], strict=True)], measure, colour)
        _middle(axes, places, measure, colour)
    for place in places[np.isnan(middle)]:
        axes.annotate("none", (place, 0.5), xycoords=("data", "axes fraction"), ha="center", color=MUTED, fontsize=8.5)
    if summary["own"] in values:
        own = values.index(summary["own"])
        axes.axvline(own, color=MUTED, linewidth=1.3, linestyle=(0, (1.2, 2.2)), zorder=0)
    _mark(axes, measure)
    axes.set_xlim(-0.5, len(values) - 0.5)
    axes.xaxis.set_major_locator(FixedLocator(places.tolist()))
    axes.set_xticklabels([tick(value) for value in values], fontsize=8.5)
    whole, seconds = measure["form"] == ".0f", measure["unit"] == "seconds"
    if whole or seconds:  # counted from nothing
        axes.yaxis.set_major_locator(MaxNLocator(5, integer=whole, steps=[1, 2, 5, 10]))
        axes.set_ylim(0, 1.06 * max(1.0, axes.get_ylim()[1]))
    _words(axes, measure, summary["axis"])


def _over_sizes(axes: Axes, size: Data, measure: Data, colour: str) -> None:
    """Times on logarithmic axes, since sizes go by factors."""
    _runs(axes, size["runs"], measure, colour)
    places = _numbers(size["middle"])
    _middle(axes, places, measure, colour)
    axes.set(xscale="log", yscale="log")
    if measure["growth"] is not None:
        _growth(axes, size, measure["growth"])
    axes.xaxis.set_major_locator(FixedLocator(places.tolist()))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels([f"{place:.0f}" for place in places], fontsize=8.5)
    axes.yaxis.set_major_locator(FixedLocator([factor * 10.0**power for power in range(-3, 4) for factor in (1, 2, 5)]))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    _words(axes, measure, size["title"])


def _growth(axes: Axes, size: Data, growth: Data) -> None:
    """The straight line that fits, bent by the logarithmic axes, and what it says."""
    x = np.geomspace(growth["from"], max(value for row in size["runs"] for value in row))
    y = growth["fixed"] + growth["per_thousand"] * x / 1000
    axes.plot(x[y > 0], y[y > 0], linestyle=(0, (5, 2)), color=INK, linewidth=1.3, zorder=5)
    text = f"{growth['fixed']:.2g} s + {growth['per_thousand']:.2g} s · $N$ / 1,000"
    axes.text(0.97, 0.05, text, transform=axes.transAxes, ha="right", va="bottom", fontsize=9.5)


def _runs(axes: Axes, places: Sequence[Sequence[float]], measure: Data, colour: str) -> None:
    """A point a collection."""
    x = [place for row in places for place in row]
    y = np.concatenate([_numbers(row) for row in measure["runs"]])
    axes.scatter(x, y, s=16, facecolor="white", edgecolor=colour, linewidth=1.0, zorder=4)


def _middle(axes: Axes, places: NDArray[np.float64], measure: Data, colour: str) -> None:
    """The middle as a line, and the range of the collections shaded."""
    axes.fill_between(
        places, _numbers(measure["low"]), _numbers(measure["high"]), color=colour, alpha=0.18, linewidth=0, zorder=1
    )
    axes.plot(places, _numbers(measure["middle"]), color=colour, linewidth=1.9, marker="_", markersize=9, zorder=3)


def _mark(axes: Axes, measure: Data) -> None:
    """What to compare with, and room for its name; left out where it is so far away that it would flatten the rest."""
    mark, known = measure["mark"], [value for row in measure["runs"] for value in row if value is not None]
    if mark is None or not known:
        return
    bottom, top = 0 if measure["form"] == ".0f" else min(known), max(known)
    if not bottom - _FAR * (top - bottom) <= mark["value"] <= top + _FAR * (top - bottom):
        return
    axes.axhline(mark["value"], color=GREEN, linewidth=1.3, linestyle=(0, (5, 2)), zorder=1)
    axes.annotate(
        symbols(f"{mark['name']} = {mark['value']:.4g}"), (0.98, mark["value"]),
        xycoords=("axes fraction", "data"), xytext=(0, 2), textcoords="offset points", ha="right", va="bottom",
        color="#00694C", fontsize=8.5,
    )  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low, max(high, mark["value"] + 0.12 * (mark["value"] - low)))


def _words(axes: Axes, measure: Data, place: str) -> None:
    room = int(axes.get_position().width * WIDTH / _CHARACTER)
    axes.set_title(symbols("\n".join(textwrap.wrap(measure["title"], room))), fontsize=10)
    axes.set_xlabel(symbols(place), fontsize=9)
    axes.set_ylabel(symbols(measure["unit"]), fontsize=9)
    axes.tick_params(axis="y", labelsize=8.5)
    axes.grid(True, axis="y")


def _legend(figure: Figure, colour: str, kinds: set[str]) -> None:
    dotted, dashed = (0, (1.2, 2.2)), (0, (5, 2))
    entries: dict[str, list[Line2D | Patch]] = {
        "runs": [
            Line2D([], [], marker="o", markerfacecolor="white", color=colour, linestyle="none", markersize=4.5,
                   label="a collection"),
            Line2D([], [], color=colour, linewidth=1.9, label="median"),
            Patch(facecolor=colour, alpha=0.18, label="range"),
        ],
        "share": [Patch(facecolor=colour, alpha=0.75, label="share of the collections")],
        "own": [Line2D([], [], color=MUTED, linestyle=dotted, linewidth=1.3, label="the study’s own value")],
        "growth": [Line2D([], [], color=INK, linestyle=dashed, linewidth=1.3, label="linear growth that fits")],
    }  # fmt: skip
    handles = [handle for kind, group in entries.items() if kind in kinds for handle in group]
    figure.legend(
        handles=handles, loc="lower center", ncols=len(handles), fontsize=8.5, columnspacing=1.3, handletextpad=0.5,
        handlelength=1.6,
    )  # fmt: skip


def symbols(text: str) -> str:
    """Text with the paper's symbols as mathematics."""
    for plain, math_text in _SYMBOLS.items():
        text = text.replace(plain, math_text)
    return text


def tick(value: float) -> str:
    """A value below an axis, in few signs."""
    if 0 < value < 0.001:
        power = math.floor(math.log10(value))
        factor = value / 10.0**power
        return rf"${'' if round(factor, 6) == 1 else f'{factor:g}·'}10^{{{power}}}$"
    return f"{value:g}"


def _numbers(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)
