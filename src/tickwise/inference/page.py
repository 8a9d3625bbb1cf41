"""A formula and what it does to labelled trajectories, as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from tickwise.inference import drawing, plane
from tickwise.inference.explanation import Explanation, Mistake
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree
from tickwise.inference.validation import Validation, percent
from tickwise.logic.render import to_english, to_unicode
from tickwise.logic.syntax import And, Formula, Or

_DRAWN = 40  # trajectories of each label
_MISTAKES_DRAWN = 12
_MISTAKES_LISTED = 200
_MOST_PANELS = 6

_STOPS = {
    "I": "pure enough", "II": "the deepest a tree may be", "III": "no ticks left to split by",
    "interrupted": "interrupted",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Branch:
    """A node of a tree as a page shows it.

    Attributes:
        text: What it is, as a formula or in words.
        note: What is to be known of it.
        link: How it hangs on the node above it.
        label: What it predicts, if it is a leaf.
        children: The nodes below it.
    """

    text: str
    note: str = ""
    link: str = ""
    label: int | None = None
    children: tuple[Branch, ...] = ()


def render_page(
    found: Explanation,
    data: LabelledTrajectories,
    *,
    source: str,
    settings: Mapping[str, Any] | None = None,
    facts: Mapping[str, Any] | None = None,
    tree: DecisionTree | None = None,
    judged: Validation | None = None,
) -> str:
    """Render the page.

    Args:
        found: The formula, on the trajectories that it was inferred from or is checked on.
        data: All trajectories, which are drawn.
        source: Where they are from, for the title.
        settings: The settings of the inference by name; None where nothing was inferred.
        facts: What the command says of the inference; likewise.
        tree: The decision tree that the formula stands for, if there is one.
        judged: How such a formula did on trajectories that were held out, if that is known.

    Returns:
        HTML with everything in it: no scripts, nothing from a network. All text from data is escaped; the same
        input gives the same page.
    """
    rows = drawing.sample(data, _DRAWN)
    variables = _drawn_variables(found, data)
    panels = drawing.draw(found, data, rows, variables)
    mistakes = _all_mistakes(found, judged)
    wrong = np.array([data.ids.index(mistake.id) for mistake in mistakes[:_MISTAKES_DRAWN]], dtype=np.int64)
    wrong_panels = drawing.draw(found, data, wrong, variables, named=True) if len(wrong) else ()
    loader = PackageLoader("tickwise.inference", "templates")
    environment = Environment(
        loader=loader, undefined=StrictUndefined, autoescape=select_autoescape(default=True), trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["percent"] = percent
    environment.filters["symbols"] = to_unicode
    environment.filters["english"] = lambda part: _capital(to_english(part))
    page = environment.get_template("formula.html.j2").render(
        found=found, data=data, source=source, settings=settings, facts=facts, judged=judged,
        folds=judged is not None and judged.method == "folds",
        summary=_summary(found, judged),
        formula_tree=None if found.formula is None else _formula_branch(found.formula),
        decision_tree=None if tree is None else _node_branch(tree),
        panels=panels,
        planes=plane.planes(found, data, rows)[:_MOST_PANELS],
        wrong_panels=wrong_panels,
        broken=any(line.breaks for panel in wrong_panels for line in panel.lines),
        drawn=len(rows), wrong_drawn=len(wrong), frame=drawing, square=plane, listed=_MISTAKES_LISTED,
        undrawn=[name for name in data.variables if name not in variables],
        several=len({separation.disjunct for separation in found.separations}) > 1,
        nested=any(mark.rest is not None for panel in panels for mark in panel.marks),
        outside=any(mark.outside for panel in panels for mark in panel.marks),
        own_mistakes=[(0, mistake) for mistake in found.mistakes[:_MISTAKES_LISTED]], wrong_count=len(mistakes),
        most=_DRAWN,
        version=version("tickwise"),
    )  # fmt: skip
    return page.rstrip() + "\n"


def _drawn_variables(found: Explanation, data: LabelledTrajectories) -> tuple[str, ...]:
    """The formula's variables, and then others while there is room for them."""
    named = () if found.formula is None else found.formula.variables
    return tuple(dict.fromkeys((*named, *data.variables)))[: max(_MOST_PANELS if not named else 4, len(named))]


def _all_mistakes(found: Explanation, judged: Validation | None) -> list[Mistake]:
    """Where the same formula was judged on held-out trajectories, those that it gets wrong count too."""
    held_out = [] if judged is None or judged.method == "folds" else [mistake for _, mistake in judged.mistakes()]
    return [*held_out, *found.mistakes]


def _summary(found: Explanation, judged: Validation | None) -> str:
    counts = found.confusion
    where = "trajectories" if judged is None or judged.method == "folds" else "trajectories that it was inferred from"
    if found.formula is None:
        told = f"No formula was found: no leaf of the decision tree has label 1. All {counts.count} are predicted -1."
    elif counts.wrong == 0:
        told = f"The formula tells all {counts.count} {where} apart."
    else:
        told = f"The formula is right on {counts.count - counts.wrong} of {counts.count} {where}."
    return told if judged is None else f"{told} {_capital(judged.sentence())}."


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _formula_branch(formula: Formula, link: str = "") -> Branch:
    """The parse tree as far as it combines parts."""
    if isinstance(formula, Or | And):
        children = tuple(_formula_branch(child) for child in formula.children)
        note = "at least one of these" if isinstance(formula, Or) else "all of these"
        return Branch("∨" if isinstance(formula, Or) else "∧", note, link, children=children)
    return Branch(to_unicode(formula), to_english(formula), link)


def _node_branch(node: DecisionTree, link: str = "") -> Branch:
    counts = f"{node.positives} with label 1, {node.negatives} with label -1"
    if node.primitive is None or node.left is None or node.right is None:
        why = f"; {_STOPS[node.stop]}" if node.stop else ""
        return Branch(f"label {node.label}", f"{counts}{why}", link, node.label)
    children = (_node_branch(node.left, "satisfied"), _node_branch(node.right, "violated"))
    note = f"{counts}; J = {node.objective:.4f}, I = {node.gain:.4f}"
    return Branch(to_unicode(node.primitive), note, link, children=children)
