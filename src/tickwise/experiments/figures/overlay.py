"""Two formulas over one another: when each of their parts looks, and at which range of each variable."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from tickwise.experiments.figures.style import BLUE, INK, VERMILION, canvas
from tickwise.logic.sdnf import SDNF, Primitive

_LOOKS: Final[Any] = {"source": (BLUE, "-", 0.20), "target": (VERMILION, (0, (4, 2)), 0.12)}
"""How each formula is drawn: colour, line, and how opaque its boxes are."""


def draw(source: SDNF, target: SDNF) -> Figure:
    """Draw a panel for each variable: boxes of ticks by values, cut off where a side is open.

    Args:
        source: The source's formula.
        target: The target's.

    Returns:
        The figure.
    """
    formulas = {"source": source, "target": target}
    parts = [part for phi in formulas.values() for _, part in _parts(phi)]
    names = list(dict.fromkeys(name for part in parts for name in part.box.variables))
    figure = canvas(0.9 + 2.5 * len(names))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    last = max(part.end for part in parts) + 1
    for name, axes in zip(names, panels, strict=True):
        low, high = _range(parts, name)
        for who, phi in formulas.items():
            for number, part in _parts(phi):
                _box(axes, part, name, (low, high), who, number)
        axes.set(ylabel=name, ylim=(low, high), xlim=(-0.5, last))
        axes.grid(axis="y")
    panels[-1].set_xlabel("tick")
    handles = [
        Patch(facecolor=(colour, opacity), edgecolor=colour, linestyle=line, linewidth=1.8, label=who)
        for who, (colour, line, opacity) in _LOOKS.items()
    ]
    figure.legend(handles=handles, loc="upper right", ncols=2)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.35 / figure.get_figheight()))
    return figure


def _parts(phi: SDNF) -> Iterator[tuple[str, Primitive]]:
    """The primitives with the numbers by which they are called."""
    for first, disjunct in enumerate(phi.disjuncts, start=1):
        for second, part in enumerate(disjunct.primitives, start=1):
            yield (f"{first}.{second}" if len(phi.disjuncts) > 1 else str(second)), part


def _range(parts: Sequence[Primitive], name: str) -> tuple[float, float]:
    """What range of a variable shows all sides of all regions, with some room beyond."""
    sides = [
        side
        for part in parts
        for bound in part.box.bounds
        if bound.variable == name
        for side in (bound.lower, bound.upper)
        if math.isfinite(side)
    ]
    room = 0.2 * (max(sides) - min(sides)) or 1.0
    return min(sides) - room, max(sides) + room


def _box(axes: Axes, part: Primitive, name: str, limits: tuple[float, float], who: str, number: str) -> None:
    colour, line, opacity = _LOOKS[who]
    for bound in part.box.bounds:
        if bound.variable != name:
            continue
        low, high = max(bound.lower, limits[0]), min(bound.upper, limits[1])
        place, size = (part.start - 0.4, low), (part.end - part.start + 0.8, high - low)
        axes.add_patch(Rectangle(place, *size, facecolor=colour, alpha=opacity, linewidth=0))
        axes.add_patch(Rectangle(place, *size, fill=False, edgecolor=colour, linestyle=line, linewidth=1.8))
        operator = part.operator.symbol if part.predicate is part.box else f"{part.operator.symbol}¬"
        up = who == "source"
        axes.annotate(
            f"{number} {operator}", (place[0], high if up else low), xytext=(4, -4 if up else 4), color=INK,
            textcoords="offset points", va="top" if up else "bottom", fontsize=9.5,
        )  # fmt: skip
