"""What stands under each figure: what it shows, and the figure of the paper that it is the counterpart of."""

from __future__ import annotations

from dataclasses import dataclass

from tickwise.experiments.study import StudySpec


@dataclass(frozen=True, slots=True)
class Caption:
    """What stands under a figure.

    Attributes:
        title: What it is.
        counterpart: The paper's figure, or the place in its text.
        text: What is to be seen.
    """

    title: str
    counterpart: str
    text: str


def captions(spec: StudySpec) -> dict[str, Caption]:
    """The caption of every figure by name, drawn or not."""
    runs = f"{spec.runs} run{'s' if spec.runs != 1 else ''}"
    learning = spec.learning
    figures = spec.published.figures
    curves = figures.get("curves", "the figures of learning results")
    return {
        "workflow": Caption(
            "Workflow",
            "Fig. 4, the workflow diagram",
            "Each box has what the first collection and its formulas gave; episodes to convergence are means over "
            f"{runs}.",
        ),
        "maps": Caption(
            "Inferred regions",
            f"{figures.get('maps', 'the figures of inferred regions')}, inferred regions",
            "Filled: inferred regions; outlined and hatched: the true ones. Thin lines: some of the first "
            "collection's trajectories with label 1, each shifted a little so that they can be told apart; a dot "
            "marks the start. (c) is inferred without the information gain.",
        ),
        "tree": Caption(
            "Decision tree of the source task",
            "Fig. 3, the decision tree",
            "Rounded boxes hold primitives with their classification rate and information gain at the node, "
            "rectangles hold path formulas. A condition says why a node is a leaf: I, enough trajectories have one "
            "label; II, the greatest depth; III, no ticks are left."
            + " The full protocol finds all primitives together, without a tree."
            * (spec.protocol == "full"),
        ),
        "automata": Caption(
            "Timed automata",
            "Fig. 5, the timed automata",
            "Clock c₁ counts from tick 0, c₂ from the start of a stay. Locations that ξ maps to one another have the "
            "same colour and place. Accepting and rejecting locations absorb; edges whose guard no clock value "
            "satisfies are left out.",
        ),
        "curves": Caption(
            "Learning curves",
            f"{curves}, left",
            f"Left: mean returns of the first {learning.shown:,} training episodes, in blocks of {learning.block} "
            "averaged to a hundred points. "
            f"Right: mean returns of the greedy policy, {learning.evaluation_episodes} episodes on fixed seeds, for "
            f"as long as each method learned. Lines are means over {runs}, bands 95 % bootstrap intervals of them.",
        ),
        "boxplot": Caption(
            "Mean return of each run",
            f"{curves}, right",
            f"The mean return of the first {learning.window:,} episodes after the data collection phase: median, "
            "quartiles, whiskers within 1.5 times the box, and a point a run.",
        ),
        "convergence": Caption(
            "Episodes to convergence",
            "the numbers of episodes in the text of Section V",
            f"A point a run, by two measures{_stars(spec)}. An arrow begins at the last episode of runs that did not "
            "get there.",
        ),
    }


def _stars(spec: StudySpec) -> str:
    """What the paper's numbers in the figure are, as the end of a sentence."""
    if spec.published.settled:
        return "; the paper's numbers are stars, on the right those for convergence"
    if spec.published.episodes:
        return "; the paper's number is the same star in both panels, since it does not say how it measured convergence"
    return ""
