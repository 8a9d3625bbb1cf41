"""The figures of a study: the counterparts of the paper's, as SVG and PNG; and drawings of timed automata.

Matplotlib is imported by the modules of this package only, and those only when something is drawn.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tickwise._files import write_bytes
from tickwise.automata.model import TimedAutomaton
from tickwise.errors import AutomatonError
from tickwise.experiments.study import StudySpec
from tickwise.logic.sdnf import SDNF

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = ("workflow", "maps", "tree", "automata", "curves", "boxplot", "convergence")
"""The names of the figures, in the order of the report."""

DPI = 150

_SVG_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}


def draw_figures(results: Mapping[str, Any], spec: StudySpec, folder: Path) -> dict[str, str]:
    """Draw every figure that there is something to show in, each as ``name.svg`` and ``name.png``.

    The same results give the same bytes. A figure without content, such as the automata where no formula was
    inferred, is left out, and one of an earlier drawing is removed.

    Args:
        results: The results of the study.
        spec: The study.
        folder: Where the files go; it is made if it is not there.

    Returns:
        The SVG text of each figure by name, in the order of `FIGURES`.

    Raises:
        StoreError: If a file cannot be written.
    """
    drawn = {}
    with _style():
        for name, draw in _painters().items():
            figure = draw(results, spec)
            if figure is None:
                for suffix in ("svg", "png"):
                    (folder / f"{name}.{suffix}").unlink(missing_ok=True)
                continue
            drawn[name] = _write(figure, folder / name)
    return drawn


def draw_pairs(results: Mapping[str, Any], folder: Path) -> str:
    """Draw what random pairs of tasks show, as ``pairs.svg`` and ``pairs.png``.

    Args:
        results: What `tickwise.experiments.pairs.gather_pairs` gave.
        folder: Where the files go.

    Returns:
        The SVG text.

    Raises:
        StoreError: If a file cannot be written.
    """
    with _style():
        from tickwise.experiments.figures import pairs

        return _write(pairs.draw(results), folder / "pairs")


def draw_effect(results: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """Draw what a setting does, as ``name.svg`` and ``name.png``, and apart from it the times, as ``name-time``.

    Args:
        results: What `tickwise.experiments.effects.effect_results` gave.
        folder: Where the files go.

    Returns:
        The SVG text of each figure by name; without times there is one.

    Raises:
        StoreError: If a file cannot be written.
    """
    drawn = {}
    with _style():
        from tickwise.experiments.figures import effect

        name = results["summary"]["effect"]
        for key, figure in ((name, effect.draw(results)), (f"{name}-time", effect.draw_times(results))):
            if figure is not None:
                drawn[key] = _write(figure, folder / key)
    return drawn


def draw_automata(automata: Sequence[TimedAutomaton]) -> str:
    """Draw timed automata one below the other, each with the legend of its predicates ρ₁, ρ₂, … below it.

    Args:
        automata: One timed automaton or more, for instance those of a formula.

    Returns:
        The SVG text; the same automata give the same text.

    Raises:
        AutomatonError: If there is no automaton.
    """
    if not automata:
        raise AutomatonError("there is no automaton to draw; give at least one")
    from tickwise.experiments.figures.automata import draw_alone

    with _style():
        return _render(draw_alone(automata), "svg", _SVG_METADATA).decode()


def draw_overlay(source: SDNF, target: SDNF) -> str:
    """Draw two formulas over one another, in a panel for each variable.

    Args:
        source: The source's formula.
        target: The target's.

    Returns:
        The SVG text; the same formulas give the same text.
    """
    from tickwise.experiments.figures.overlay import draw

    with _style():
        return _render(draw(source, target), "svg", _SVG_METADATA).decode()


@contextmanager
def _style() -> Iterator[None]:
    """The settings of every figure; a reader's own must not change it, and stay as they are."""
    import matplotlib

    from tickwise.experiments.figures.style import STYLE

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def _painters() -> dict[str, Any]:
    """The function that draws each figure; it gives None where there is nothing to show."""
    from tickwise.experiments.figures import automata, convergence, curves, maps, tree, workflow

    return {
        "workflow": workflow.draw, "maps": maps.draw, "tree": tree.draw, "automata": automata.draw,
        "curves": curves.draw, "boxplot": convergence.draw_boxplot,
        "convergence": convergence.draw_convergence,
    }  # fmt: skip


def _write(figure: Figure, path: Path) -> str:
    """Write a figure as SVG and PNG, the suffixes to be added; the SVG text comes back."""
    svg = _render(figure, "svg", _SVG_METADATA)
    write_bytes(path.with_name(f"{path.name}.svg"), svg)
    write_bytes(path.with_name(f"{path.name}.png"), _render(figure, "png", {"Software": None}))
    return svg.decode()


def _render(figure: Figure, kind: str, metadata: dict[str, None]) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=DPI, metadata=metadata)
    return buffer.getvalue()
