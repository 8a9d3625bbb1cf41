"""The drawings of the concepts page, from what the library computes, in the style of its own figures."""

from __future__ import annotations

import io

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from tickwise.automata.build import timed_automata
from tickwise.automata.run import letters_of
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.figures.style import (
    GREEN,
    INK,
    LINE,
    MUTED,
    ORANGE,
    PAPER,
    STYLE,
    VERMILION,
    WIDTH,
    arrow,
    blank,
    canvas,
)
from tickwise.logic.parse import parse
from tickwise.logic.syntax import Box, Verdict
from tickwise.transfer.qtransfer import similar_states

__all__ = ["similar", "ticks"]

SOURCE = Box.of(x=(3, 4), y=(3, 5))
TARGET = Box.of(x=(5, 6), y=(6, 7))
FORMULA = "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)"


def ticks() -> str:
    """Draw what happens at each tick of a trajectory.

    Rows of 41 ticks: the windows of both regions, the ticks in them, and the verdict, the location of the automaton and
    its clock within the stay after each tick.
    """
    trajectory = np.full((41, 2), 1.5)
    trajectory[4:6] = trajectory[9:16] = 3.5, 4.5
    trajectory[27:33] = 7.5, 6.5
    with _style():
        figure = canvas(3.05)
        axes = blank(figure, WIDTH, 3.05)
        _TickRows(axes, trajectory).draw()
        return _svg(figure)


class _TickRows:
    """Rows of one cell a tick, below each other."""

    left, cell, top = 1.32, 0.182, 2.7

    def __init__(self, axes: Axes, trajectory: NDArray[np.float64]) -> None:
        self.axes, self.trajectory, self.formula = axes, trajectory, parse(FORMULA)
        (automaton,) = timed_automata(self.formula)
        self.table = automaton.compile()
        letters = letters_of(automaton, trajectory, variables=("x", "y"))
        self.states = self.table.run(letters)
        self.letters = letters

    def draw(self) -> None:
        """Draw all rows."""
        for tick in range(0, 41, 5):
            x = self.left + (tick + 0.5) * self.cell
            self.axes.text(x, self.top + 0.2, str(tick), ha="center", va="center", color=MUTED, fontsize=9)
        self._name(0, "window of G")
        self._span(0, 1, 15, GREEN)
        self._span(0, 16, 19, GREEN, faint=True)
        self._name(1, "window of Y")
        self._span(1, 21, 39, ORANGE)
        self._name(2, "trajectory")
        self._name(3, "verdict")
        self._name(4, "location")
        self._name(5, "clock of the stay")
        for tick, (state, letter) in enumerate(zip(self.states, self.letters, strict=True)):
            verdict = Verdict(int(np.asarray(self.formula.verdict(self.trajectory[: tick + 1]))))
            self._cell(2, tick, {1: GREEN, 2: ORANGE}.get(int(letter), PAPER), "")
            self._cell(3, tick, "#CDE9DF" if verdict is Verdict.TRUE else PAPER, "T" if verdict > 0 else "?")
            self._cell(4, tick, PAPER, str(self.table.location[state]))
            self._cell(5, tick, PAPER, str(self.table.clocks[state, 1]))

    def _y(self, row: int) -> float:
        return self.top - 0.42 * row - 0.15

    def _name(self, row: int, text: str) -> None:
        self.axes.text(self.left - 0.12, self._y(row), text, ha="right", va="center", fontsize=9.5)

    def _span(self, row: int, first: int, last: int, colour: str, *, faint: bool = False) -> None:
        corner = (self.left + first * self.cell, self._y(row) - 0.07)
        alpha = 0.35 if faint else 1.0
        self.axes.add_patch(Rectangle(corner, (last - first + 1) * self.cell, 0.14, color=colour, alpha=alpha, lw=0))

    def _cell(self, row: int, tick: int, colour: str, text: str) -> None:
        x, y = self.left + tick * self.cell, self._y(row)
        self.axes.add_patch(Rectangle((x, y - 0.13), self.cell, 0.26, facecolor=colour, edgecolor=LINE, linewidth=0.6))
        self.axes.text(x + self.cell / 2, y, text, ha="center", va="center", fontsize=8)


def similar() -> str:
    """Draw which places of two gridworlds are likened to each other.

    Two gridworlds with a region each: four places about the target's region, and those of the source that lie in the
    same direction and at the same distance from its own.
    """
    mdp = GridWorld(9).mdp()
    centres = [box.centroid(mdp.variables, mdp.limits) for box in (SOURCE, TARGET)]
    alike = similar_states(mdp, SOURCE, centres[0], mdp, TARGET, centres[1])
    with _style():
        figure = canvas(4.3)
        panels = [figure.add_axes((left, 0.08, 0.42, 0.82)) for left in (0.05, 0.54)]
        for axes, box, title in zip(panels, (SOURCE, TARGET), ("Source", "Target"), strict=True):
            _grid(axes, box, title)
        for number, place in enumerate(((2.5, 3.5), (7.5, 7.5), (1.5, 8.5), (8.5, 0.5))):
            state = int(np.flatnonzero((mdp.coordinates == place).all(axis=1))[0])
            for axes, at, centre in (
                (panels[0], mdp.coordinates[alike[state]], centres[0]),
                (panels[1], mdp.coordinates[state], centres[1]),
            ):
                _state(axes, at, centre, "ABCD"[number])
        return _svg(figure)


def _grid(axes: Axes, box: Box, title: str) -> None:
    axes.set(xlim=(-0.04, 9.04), ylim=(-0.04, 9.04), aspect="equal", xticks=range(10), yticks=range(10), title=title)
    axes.grid(True, color=LINE, linewidth=0.5, alpha=0.6)
    x, y = box.bounds
    axes.add_patch(Rectangle((x.lower, y.lower), x.upper - x.lower, y.upper - y.lower, color=GREEN, alpha=0.45, lw=0))


def _state(axes: Axes, place: NDArray[np.float64], centre: NDArray[np.float64], name: str) -> None:
    arrow(axes, tuple(centre), tuple(place), colour=MUTED)
    axes.plot(*place, "o", markersize=15, color=PAPER, markeredgecolor=VERMILION, markeredgewidth=1.6, zorder=3)
    axes.text(*place, name, ha="center", va="center_baseline", fontsize=9, color=INK, zorder=4)


def _style() -> rc_context:
    return rc_context({**STYLE})


def _svg(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return buffer.getvalue().decode()
