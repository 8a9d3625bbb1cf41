"""Timed automata: those of both tasks with the mapping ξ, the counterpart of the paper's Fig. 5, and any others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch
from matplotlib.path import Path

from tickwise.automata.build import timed_automata
from tickwise.automata.interchange import fill, layout
from tickwise.automata.mapping import bijections
from tickwise.automata.model import Edge, TimedAutomaton
from tickwise.errors import AutomatonError
from tickwise.experiments.figures.style import INK, LINE, MUTED, PAPER, WIDTH, blank, canvas, literal
from tickwise.experiments.regions import (
    NamedFormula,
    math_primitive,
    math_symbol,
    read_formula,
)
from tickwise.experiments.study import StudySpec
from tickwise.logic.render import to_unicode

_RADIUS = 0.27
_ROW = 1.22
_TITLE = 0.33
_HEAD = 0.92
_FOOT = 0.45
_STRIP = 1.35
_COLUMN = 2.85
_WIDEST_COLUMN = 3.3
_CROWDED_COLUMN = 4.1
_MARGIN = 2.9
_SMALL = 9.2
_LINE = 0.21
_CHARACTER = 0.09

Point = tuple[float, float]
Literals = Mapping[tuple[int, bool], str]
"""For each predicate and whether it holds, the mathematical text of that without the dollar signs about it."""


def draw(results: Mapping[str, Any], spec: StudySpec) -> Figure | None:
    """The source's automata above the target's, in the same colours where ξ maps one location to another."""
    formulas = results["summary"]["formulas"]
    source = read_formula(formulas["source"], "S", spec.source)
    target = read_formula(formulas["target"], "T", spec.target)
    if source is None:
        return None
    sources = timed_automata(source.sdnf)
    targets = () if target is None else timed_automata(target.sdnf)
    panels = [(source, automaton) for automaton in sources]
    panels += [(target, automaton) for automaton in targets if target is not None]
    heights = [_TITLE + _height(automaton) for _, automaton in panels]
    width = max(_width(automaton) for _, automaton in panels)
    total = sum(heights) + (_STRIP if targets else 0) + 0.15
    figure = canvas(total, width)
    axes = blank(figure, width, total)
    top = total
    for number, ((formula, automaton), height) in enumerate(zip(panels, heights, strict=True)):
        if number == len(sources) and target is not None:
            _mapping(axes, top, width, (source, sources), (target, targets))
            top -= _STRIP
        _title(axes, formula, automaton, top)
        _Drawing(axes, automaton, _named_literals(formula, automaton), top - _TITLE, width).draw()
        top -= height
    return figure


def draw_alone(automata: Sequence[TimedAutomaton]) -> Figure:
    """Automata of no study, one below the other, each with the legend of its predicates ρ₁, ρ₂, … below it."""
    legends = [[to_unicode(predicate) for predicate in automaton.predicates] for automaton in automata]
    longest = max(len(row) for rows in legends for row in rows)
    width = max(1.0 + _CHARACTER * longest, *(_width(automaton) for automaton in automata))
    heights = [_height(automaton) for automaton in automata]
    total = sum(heights) + sum(0.2 + _LINE * len(rows) for rows in legends)
    figure = canvas(total, width)
    axes = blank(figure, width, total)
    top = total
    for automaton, height, rows in zip(automata, heights, legends, strict=True):
        numbers = range(len(rows))
        literals = {(j, holds): rf"{'' if holds else '¬'}\rho_{{{j + 1}}}" for j in numbers for holds in (True, False)}
        _Drawing(axes, automaton, literals, top, width).draw()
        top -= height
        for j, row in enumerate(rows):
            axes.text(0.2, top - _LINE * j, rf"$\rho_{{{j + 1}}}$:", fontsize=_SMALL, va="center")
            axes.text(0.55, top - _LINE * j, literal(row), fontsize=_SMALL, va="center")
        top -= 0.2 + _LINE * len(rows)
    return figure


def _height(automaton: TimedAutomaton) -> float:
    rows = [y for _, y in layout(automaton)]
    return _HEAD + (max(rows) - min(rows)) * _ROW + _FOOT + _RADIUS


def _width(automaton: TimedAutomaton) -> float:
    return max(WIDTH, _MARGIN + _step(automaton) * (len(automaton.predicates)))


def _step(automaton: TimedAutomaton) -> float:
    """The distance of columns; a stay in a later stage has labels on its left."""
    columns, operators = (
        len(automaton.predicates),
        [part.operator for part in automaton.conjunction.primitives],
    )
    if any(operator.nested for operator in operators[1:]):
        return _CROWDED_COLUMN
    return min(_WIDEST_COLUMN, max(_COLUMN, (WIDTH - _MARGIN) / columns))


def _title(axes: Axes, formula: NamedFormula, automaton: TimedAutomaton, top: float) -> None:
    text = r"\,∧\,".join(math_primitive(part, formula.names) for part in automaton.conjunction.primitives)
    symbol = math_symbol(formula.task)
    if len(formula.sdnf.disjuncts) > 1:
        number = formula.sdnf.disjuncts.index(automaton.conjunction) + 1
        symbol = symbol.replace("^", f"_{{{number}}}^", 1)
    task = "Source" if formula.task == "S" else "Target"
    axes.text(0.2, top - 0.24, f"{task}:", weight="bold", fontsize=11.5, va="center")
    axes.text(0.98, top - 0.24, f"${symbol} = {text}$", fontsize=11.5, va="center")


def _named_literals(formula: NamedFormula, automaton: TimedAutomaton) -> Literals:
    """The literals by the names of the regions; that of a complement is negated where it holds."""
    return {
        (number, holds): ("" if holds != part.complemented else "¬") + formula.names[part.box].math
        for number, part in enumerate(automaton.conjunction.primitives)
        for holds in (True, False)
    }


class _Drawing:
    """One automaton in a strip of the figure."""

    def __init__(self, axes: Axes, automaton: TimedAutomaton, literals: Literals, top: float, width: float) -> None:
        self.axes, self.automaton, self.literals = axes, automaton, literals
        places = layout(automaton)
        highest = max(y for _, y in places)
        step = _step(automaton)
        left = (width - len(automaton.predicates) * step) / 2 + 0.55
        self.places = [(left + x * step, top - _HEAD + (y - highest) * _ROW) for x, y in places]
        self.above = {place for place, (x, y) in enumerate(places) if any(other == (x, y + 1) for other in places)}

    def draw(self) -> None:
        """Edges, then locations."""
        grouped: dict[tuple[int, int], list[str]] = {}
        for edge in self.automaton.edges:
            absorbs = edge.source in self.automaton.accepting | self.automaton.rejecting
            possible = all(low <= high for low, high in edge.ranges(len(self.automaton.clocks)))
            if possible and not absorbs:
                grouped.setdefault((edge.source, edge.target), []).append(self._label(edge))
        for (source, target), labels in grouped.items():
            if source == target:
                self._loop(source, labels)
            else:
                self._edge(source, target, labels)
        for location in range(len(self.automaton.locations)):
            self._location(location)
        x, y = self.places[self.automaton.initial]
        slant = _RADIUS * math.sqrt(0.5)
        self._arrow(Path([(x - 0.52, y - 0.52), (x - slant, y - slant)]))

    def _label(self, edge: Edge) -> str:
        automaton = self.automaton
        parts = [f"${self.literals[each]}$" for each in edge.literals]
        ranges = edge.ranges(len(automaton.clocks))
        for clock in dict.fromkeys(atom.clock for atom in edge.guard):
            atoms = [atom for atom in edge.guard if atom.clock == clock]
            name = clock_math(automaton.clocks[clock])
            if len(atoms) == 1:
                parts.append(f"${name} {_SIGNS[atoms[0].comparison]} {atoms[0].value}$")
            else:
                low, high = ranges[clock]
                parts.append(rf"${low} \leq {name} \leq {high}$" if low < high else f"${name} = {low}$")
        parts = parts or [r"$\top$"]
        resets = [rf"${clock_math(automaton.clocks[clock])}\,≔\,0$" for clock in sorted(edge.resets)]
        return ", ".join(parts) + "".join(f"\n{reset}" for reset in resets)

    def _location(self, location: int) -> None:
        automaton, (x, y) = self.automaton, self.places[location]
        accepting = location in automaton.accepting
        self.axes.add_patch(
            Circle((x, y), _RADIUS, facecolor=fill(automaton, location), edgecolor=INK, lw=1.3, zorder=5)
        )
        if accepting:
            self.axes.add_patch(Circle((x, y), _RADIUS - 0.045, facecolor="none", edgecolor=INK, lw=1.0, zorder=6))
        self.axes.text(
            x, y - 0.01, location_text(automaton.locations[location]), ha="center", va="center", zorder=7,
            fontsize=_SMALL if automaton.locations[location][0] != "q" else 11.5,
        )  # fmt: skip

    def _loop(self, location: int, labels: Sequence[str]) -> None:
        x, y = self.places[location]
        if location not in self.above:
            angle, place, ha, va = 90, (x + 0.26, y + 0.66), "left", "center"
        elif location == self.automaton.initial:
            angle, place, ha, va = 180, (x - 0.68, y + 0.03), "right", "center"
        else:
            angle, place, ha, va = 215, (x - 0.58, y - 0.5), "right", "center"
        points = [(x + reach * math.cos(a), y + reach * math.sin(a)) for reach, a in _loop_points(math.radians(angle))]
        self._arrow(Path(points, [Path.MOVETO, *(Path.CURVE4,) * 3]))
        self._text(place, labels, ha, va)

    def _edge(self, source: int, target: int, labels: Sequence[str]) -> None:
        """One edge; where it goes and where its label stands follow from the places of its ends."""
        start, end = self.places[source], self.places[target]
        (x1, y1), (x2, y2) = start, end
        rows = round((y2 - y1) / _ROW)
        if x1 != x2 and rows:  # from a stay to the next stage
            straight = target in self.above  # a curve would run into the label of the next stay's edge
            x, y = self._curve(start, end, None if straight else (x1 + 0.62 * (x2 - x1), y1))
            self._text((x + 0.1, y + 0.06), labels, "left", "bottom")
        elif x1 != x2:  # from waiting to the next stage
            x, y = self._curve(start, end)
            self._text((x + 0.42, y + 0.06), labels, "center", "bottom")
        elif rows == 1:  # from waiting into a stay
            x, y = self._curve(start, end, (x1 - 0.36, y1 + _ROW / 2))
            self._text((x - 0.07, y), labels, "right", "center")
        elif rows == -1 and target not in self.automaton.rejecting:  # and back
            x, y = self._curve(start, end, (x1 + 0.36, y1 - _ROW / 2))
            self._text((x + 0.07, y - 0.04), labels, "left", "center")
        elif rows == -1:
            x, y = self._curve(start, end)
            self._text((x + 0.07, y), labels, "left", "center")
        else:  # from a stay past the waiting location
            x, y = self._curve(start, end, (x1 + 3.1, (y1 + y2) / 2))
            self._text((x - 0.02, y - 0.28), labels, "left", "top")

    def _curve(self, start: Point, end: Point, control: Point | None = None) -> Point:
        """An arrow between the rims of two locations, drawn towards a control point; gives its middle."""
        (x1, y1), (x2, y2) = start, end
        control = control or ((x1 + x2) / 2, (y1 + y2) / 2)
        first, last = _towards(start, control), _towards(end, control)
        self._arrow(Path([first, control, last], [Path.MOVETO, Path.CURVE3, Path.CURVE3]))
        return 0.25 * (first[0] + last[0]) + 0.5 * control[0], 0.25 * (first[1] + last[1]) + 0.5 * control[1]

    def _arrow(self, path: Path) -> None:
        self.axes.add_patch(
            FancyArrowPatch(
                path=path, arrowstyle="-|>", mutation_scale=11, color=INK, lw=1.1, zorder=3, capstyle="butt"
            )
        )

    def _text(self, place: Point, labels: Sequence[str], ha: Any, va: Any) -> None:
        self.axes.text(
            *place, "\n".join(labels), ha=ha, va=va, fontsize=_SMALL, linespacing=1.45, zorder=4,
            bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 0.8},
        )  # fmt: skip


_SIGNS = {"<": "<", "<=": r"\leq", ">": ">", ">=": r"\geq"}


def clock_math(name: str) -> str:
    """A clock such as ``c1`` as mathematical text, without the dollar signs about it."""
    return f"{name[0]}_{{{name[1:]}}}"


def location_text(name: str) -> str:
    """A location as text for a figure: q0 with a subscript, others as they are."""
    return f"${name[0]}_{{{name[1:]}}}$" if name[0] == "q" else name


def _loop_points(angle: float) -> list[tuple[float, float]]:
    return [(_RADIUS, angle - 0.5), (0.85, angle - 0.5), (0.85, angle + 0.5), (_RADIUS, angle + 0.5)]


def _towards(centre: Point, other: Point) -> Point:
    """The point of a location's rim that faces another point."""
    across, up = other[0] - centre[0], other[1] - centre[1]
    length = math.hypot(across, up)
    return centre[0] + _RADIUS * across / length, centre[1] + _RADIUS * up / length


def _mapping(
    axes: Axes,
    top: float,
    width: float,
    source: tuple[NamedFormula, Sequence[TimedAutomaton]],
    target: tuple[NamedFormula, Sequence[TimedAutomaton]],
) -> None:
    """ξ in a strip: the pairs of locations in their colours, then those of clocks and predicates."""
    axes.plot([0.2, width - 0.2], [top - 0.05] * 2, color=LINE, linewidth=0.8)
    axes.plot([0.2, width - 0.2], [top - _STRIP + 0.08] * 2, color=LINE, linewidth=0.8)
    middle = top - _STRIP / 2 + 0.02
    axes.text(0.2, middle + 0.27, r"Mapping $\xi$", weight="bold", fontsize=11, va="center")
    axes.text(0.2, middle - 0.27, "target ┄ source", fontsize=_SMALL, color=MUTED, va="center")
    (target_formula, targets), (source_formula, sources) = target, source
    try:
        xi = bijections(targets[0], sources[0])
    except AutomatonError:
        axes.text(1.9, middle, "none: the two are not structurally equivalent", va="center")
        return
    count = len(xi.locations)
    distance = min(1.3, (width - 1.9) / count)
    for location, image in enumerate(xi.locations):
        x = 1.85 + distance * location
        _pair(axes, (x, middle + 0.27), (targets[0], location), (sources[0], int(image)))
    clocks = [
        rf"${clock_math(targets[0].clocks[clock])}^{{\mathrm{{T}}}}$ ┄ "
        rf"${clock_math(sources[0].clocks[int(image)])}^{{\mathrm{{S}}}}$"
        for clock, image in enumerate(xi.clocks)
    ]
    predicates: dict[str, None] = {}
    for number, automaton in enumerate(targets):
        other = sources[number % len(sources)].conjunction.primitives
        for ours, theirs in zip(automaton.conjunction.primitives, other, strict=True):
            left, right = target_formula.names[ours.box], source_formula.names[theirs.box]
            predicates[f"${left.math}$ ┄ ${right.math}$"] = None
    axes.text(1.7, middle - 0.27, "     ".join([*clocks, *predicates]), va="center", fontsize=10.5)


def _pair(axes: Axes, place: Point, target: tuple[TimedAutomaton, int], source: tuple[TimedAutomaton, int]) -> None:
    x, y = place
    axes.plot([x, x + 0.55], [y, y], color=INK, linewidth=1.1, linestyle=(0, (3, 2)), zorder=2)
    for offset, (automaton, location), task in ((0.0, target, "T"), (0.55, source, "S")):
        axes.add_patch(
            Circle((x + offset, y), 0.19, facecolor=fill(automaton, location), edgecolor=INK, lw=1, zorder=5)
        )
        name = automaton.locations[location]
        text = rf"$q_{{{name[1:]}}}^{{\mathrm{{{task}}}}}$" if name[0] == "q" else name
        axes.text(
            x + offset,
            y - 0.005,
            text,
            ha="center",
            va="center",
            fontsize=9 if name[0] == "q" else 7,
            zorder=6,
        )
