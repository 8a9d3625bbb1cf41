"""The worlds with their true and their inferred regions: the counterpart of the paper's maps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.tasks import Landmark
from tickwise.experiments.figures.style import (
    INK,
    LANDMARK_COLOURS,
    LINE,
    MUTED,
    PAPER,
    PURPLE,
    canvas,
)
from tickwise.experiments.regions import Name, NamedFormula, clip, math_symbol, overlap, read_formula
from tickwise.experiments.study import StudySpec
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.syntax import Box

_SAMPLE = 12
_NARROW = 1.5
_HATCH = "#00000059"
_HALO = [withStroke(linewidth=3, foreground=PAPER)]


def draw(results: Mapping[str, Any], spec: StudySpec) -> Figure:
    """Three maps: φ^S in the source, φ^T in the target, φ'^T (without the information gain) in the target."""
    formulas = results["summary"]["formulas"]
    panels = (
        ("(a)", "source", "S", "source", False),
        ("(b)", "target", "T", "target", False),
        ("(c)", "target_without_information", "T", "target", True),
    )
    figure = canvas(3.85)
    colour = LANDMARK_COLOURS["green"]
    for number, (letter, key, task, place, primed) in enumerate(panels):
        environment: EnvironmentSpec = spec.source if place == "source" else spec.target
        axes = figure.add_axes((0.047 + number * 0.3235, 0.215, 0.295, 0.69))
        _world(axes, environment)
        if number == 0:
            axes.set_ylabel("y (cells)", labelpad=1)
        _paths(axes, results["data"].get(place))
        formula = read_formula(formulas[key], task, environment, primed=primed)
        for landmark in environment.task.landmarks:
            _true_region(axes, landmark, task, environment)
        if formula is None:
            _say(axes, environment, "no formula was inferred")
        else:
            _inferred_regions(axes, formula, environment)
            colour = _colour(next(iter(formula.names)), environment)
        axes.set_title(f"{letter} ${math_symbol(task, primed=primed)}$, {place}" + (r", $\lambda=0$" if primed else ""))
    _legend(figure, colour)
    return figure


def _world(axes: Axes, environment: EnvironmentSpec) -> None:
    size = environment.world.size
    ticks = range(size + 1)
    axes.set(xlim=(-0.04, size + 0.04), ylim=(-0.04, size + 0.04), aspect="equal", xticks=ticks, yticks=ticks)
    axes.grid(True, color=LINE, linewidth=0.5, alpha=0.6)
    axes.set_xlabel("x (cells)", labelpad=2)
    axes.tick_params(length=2)
    for spine in axes.spines.values():
        spine.set(visible=True, color=INK, linewidth=1.2)


def _paths(axes: Axes, data: LabelledTrajectories | None) -> None:
    """The first trajectories with label 1, each a little aside, so that those that share cells stay apart."""
    if data is None or "x" not in data.variables or "y" not in data.variables:
        return
    columns = [data.variables.index(name) for name in ("x", "y")]
    chosen = np.flatnonzero(data.labels == 1)[:_SAMPLE]
    for number, row in enumerate(chosen):
        path = data.values[row, : data.lengths[row]][:, columns]
        angle = 2.4 * number  # about the golden angle: neighbours in number lie far apart
        aside = 0.28 * np.sqrt((number + 0.5) / _SAMPLE)
        x, y = path[:, 0] + aside * np.cos(angle), path[:, 1] + aside * np.sin(angle)
        axes.plot(x, y, color=MUTED, linewidth=0.7, alpha=0.55, zorder=1.5, solid_joinstyle="round")
        axes.plot(x[:1], y[:1], marker="o", markersize=2.4, color=MUTED, alpha=0.8, zorder=1.6)


def _true_region(axes: Axes, landmark: Landmark, task: str, environment: EnvironmentSpec) -> None:
    left, bottom, right, top = clip(landmark.box, environment.world.size)
    corner, width, height = (left, bottom), right - left, top - bottom
    # the hatching has the edge's colour, so that a light one needs a rectangle of its own
    axes.add_patch(Rectangle(corner, width, height, facecolor="none", edgecolor=_HATCH, hatch="///", lw=0, zorder=2.5))
    axes.add_patch(Rectangle(corner, width, height, facecolor="none", edgecolor=INK, linewidth=2.0, zorder=3))
    above = top + 0.75 <= environment.world.size
    name = Name(landmark.label, task, inferred=False)
    axes.text(
        (left + right) / 2, top + 0.1 if above else bottom - 0.1, f"${name.math}$", ha="center",
        va="bottom" if above else "top", fontsize=11, path_effects=_HALO, zorder=6,
    )  # fmt: skip


def _inferred_regions(axes: Axes, formula: NamedFormula, environment: EnvironmentSpec) -> None:
    size = environment.world.size
    outside = {part.box for disjunct in formula.sdnf.disjuncts for part in disjunct.primitives if part.complemented}
    for box, name in formula.names.items():
        left, bottom, right, top = clip(box, size)
        colour = _colour(box, environment)
        axes.add_patch(
            Rectangle(
                (left, bottom),
                right - left,
                top - bottom,
                facecolor=to_rgba(colour, 0.42),
                edgecolor=colour,
                linewidth=2.2,
                linestyle=(0, (4, 2)) if box in outside else "-",
                zorder=2,
            )
        )
        text = f"${'¬' if box in outside else ''}{name.math}$"
        style: dict[str, Any] = {"va": "center", "fontsize": 12.5, "path_effects": _HALO, "zorder": 6}
        middle = (bottom + top) / 2
        if right - left > _NARROW:  # in a corner: the true region's name is at the middle of an edge
            axes.text(left + 0.15, bottom + 0.15, text, ha="left", **{**style, "va": "bottom"})
        elif right + 1.2 <= size:
            axes.text(right + 0.15, middle, text, ha="left", **style)
        else:
            axes.text(left - 0.15, middle, text, ha="right", **style)


def _colour(box: Box, environment: EnvironmentSpec) -> str:
    """The colour of the true region that a box overlaps most; a neutral one where it overlaps none."""
    shares = [
        (overlap(box, landmark.box, environment.world.size), landmark.colour) for landmark in environment.task.landmarks
    ]
    best = max(shares, key=lambda share: share[0], default=(0.0, ""))
    return LANDMARK_COLOURS.get(best[1], PURPLE) if best[0] > 0 else PURPLE


def _say(axes: Axes, environment: EnvironmentSpec, text: str) -> None:
    middle = environment.world.size / 2
    axes.text(
        middle, middle, text, ha="center", va="center", style="italic", zorder=7,
        bbox={"facecolor": PAPER, "edgecolor": LINE, "boxstyle": "round,pad=0.4"},
    )  # fmt: skip


def _legend(figure: Figure, colour: str) -> None:
    handles = [
        Patch(facecolor="none", edgecolor=INK, hatch="///", linewidth=1.6,
              label="true region (hidden from the learner)"),
        Patch(facecolor=to_rgba(colour, 0.42), edgecolor=colour, linewidth=2, label="inferred region"),
        Line2D([], [], color=MUTED, linewidth=1, marker="o", markersize=3, label="trajectories with label 1"),
    ]  # fmt: skip
    figure.legend(handles=handles, loc="lower center", ncols=3, handlelength=2.2, columnspacing=2)
