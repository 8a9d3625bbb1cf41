"""What all figures share: Okabe and Ito's colours, the look of each method, fonts, and boxes of text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.text import Text

INK: Final = "#1A1A1A"
MUTED: Final = "#5F6368"
LINE: Final = "#9AA0A6"
PAPER: Final = "#FFFFFF"
GREEN: Final = "#009E73"
BLUE: Final = "#0072B2"
SKY: Final = "#56B4E9"
ORANGE: Final = "#E69F00"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"

LANDMARK_COLOURS: Final = {"green": GREEN, "yellow": ORANGE, "blue": BLUE}
"""The colour of a landmark on a map; plain yellow would be too faint beside white."""

WIDTH: Final = 9.0
"""The width of a figure in inches."""

STYLE: Final[Any] = {
    "svg.hashsalt": "tickwise",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
    "font.size": 10.5,
    "axes.labelsize": 10.5,
    "axes.titlesize": 11.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "grid.color": "#E3E5E8",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "legend.fontsize": 10,
    "hatch.linewidth": 0.8,
    "figure.facecolor": PAPER,
    "savefig.facecolor": PAPER,
}
"""Settings of Matplotlib; the salt makes the identifiers in an SVG the same each time."""


@dataclass(frozen=True, slots=True)
class Look:
    """How a method is drawn: told by colour, by line and by marker."""

    colour: str
    line: Any
    marker: str
    meaning: str


METHODS: Final = {
    "I": Look("#000000", (0, (1, 1.1)), "o", "τ-states"),
    "II": Look(PURPLE, (0, (5, 1.6)), "s", r"$\varphi'^{\mathrm{T}}$, no information gain"),
    "III": Look(BLUE, (0, (6, 1.4, 1.4, 1.4)), "^", r"$\varphi^{\mathrm{T}}$"),
    "IV": Look(VERMILION, "-", "D", r"$\varphi^{\mathrm{T}}$, transferred $\bar{Q}$"),
    "V": Look(GREEN, (0, (3, 1)), "P", "closed loop"),
}
"""The paper's black, magenta, blue and red, as colours that colour-blind readers can tell apart, and green for the
closed loop."""


def canvas(height: float, width: float = WIDTH) -> Figure:
    """An empty figure of a size in inches, apart from any global state."""
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def blank(figure: Figure, width: float, height: float) -> Axes:
    """Axes that fill a figure, without frame, whose unit is an inch; (0, 0) is the lower left corner."""
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.set_axis_off()
    return axes


def literal(text: str) -> str:
    """Text that may come from data, so that a dollar sign in it starts no mathematics."""
    return text.replace("$", r"\$")


def note(
    axes: Axes,
    x: float,
    y: float,
    text: str,
    *,
    face: str = PAPER,
    edge: str = INK,
    shape: str = "round,pad=0.45,rounding_size=0.35",
    dashed: bool = False,
    **style: Any,
) -> Text:
    """Text in a box about its centre (x, y)."""
    box = {
        "boxstyle": shape, "facecolor": face, "edgecolor": edge, "linewidth": 1.2,
        "linestyle": (0, (4, 2.5)) if dashed else "-",
    }  # fmt: skip
    return axes.text(x, y, text, ha="center", va="center", bbox=box, **{"linespacing": 1.5, "zorder": 4, **style})


def arrow(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    *,
    colour: str = INK,
    dashed: bool = False,
    style: str = "-|>",
) -> None:
    """An arrow between two points."""
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle=style,
            mutation_scale=13,
            color=colour,
            linewidth=1.3,
            shrinkA=0,
            shrinkB=0,
            linestyle=(0, (4, 2.5)) if dashed else "-",
            zorder=2,
        )
    )


def thousands(value: float | None) -> str:
    """A number with separators, for instance ``2,000,000``; a dash for None."""
    return "–" if value is None else f"{value:,.0f}"
