"""The decision tree of the first source inference: the counterpart of the paper's figure of a tree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tickwise.experiments.figures.style import (
    GREEN,
    INK,
    MUTED,
    PAPER,
    SKY,
    VERMILION,
    WIDTH,
    arrow,
    blank,
    canvas,
    literal,
    note,
)
from tickwise.experiments.regions import Name, boxes_of, math_primitive, math_symbol, name_boxes, ranges_text
from tickwise.experiments.study import StudySpec
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.syntax import Box

_STEP = 1.75
_LEAF_WIDTH = 2.6

Node = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class _Placed:
    """A node and where it is drawn, in inches."""

    node: Node
    x: float
    depth: int
    children: tuple[_Placed, ...] = ()

    def all(self) -> Iterator[_Placed]:
        yield self
        for child in self.children:
            yield from child.all()


def draw(results: Mapping[str, Any], spec: StudySpec) -> Figure | None:
    """The tree: primitives in inner nodes, path formulas in leaves, and how many trajectories reach each."""
    tree = results["inferences"][0]["source"]["tree"] if results["inferences"] else None
    if tree is None:
        return None
    leaves = sum(1 for _ in _leaves(tree))
    width = max(WIDTH, _LEAF_WIDTH * leaves + 0.4)
    root = _place(tree, 0.2, (width - 0.4) / leaves, 0)
    depth = max(place.depth for place in root.all())
    height = 0.62 + _STEP * depth + 1.3
    figure = canvas(height, width)
    axes = blank(figure, width, height)
    names = _names(results, tree, spec)
    top = height - 0.62
    for place in root.all():
        y = top - _STEP * place.depth
        for side, child in enumerate(place.children):
            _branch(axes, (place.x, y), (child.x, y - _STEP), satisfies=side == 0)
        _node(axes, place, y, names)
    regions = ",   ".join(f"${name.math}$ = {literal(ranges_text(box))}" for box, name in names.items())
    axes.text(width / 2, 0.45, regions, ha="center", va="center", color=INK)
    axes.text(
        width / 2, 0.17,
        rf"${math_symbol('S')}$ is the disjunction of the path formulas at the leaves with label 1",
        ha="center", va="center", color=MUTED, fontsize=9.5,
    )  # fmt: skip
    return figure


def _leaves(node: Node) -> Iterator[Node]:
    children = [child for child in (node["left"], node["right"]) if child is not None]
    if not children:
        yield node
    for child in children:
        yield from _leaves(child)


def _place(node: Node, left: float, leaf_width: float, depth: int) -> _Placed:
    """Leaves at equal distances from left to right, an inner node above the middle of its children."""
    children, start = [], left
    for child in (node["left"], node["right"]):
        if child is not None:
            children.append(_place(child, start, leaf_width, depth + 1))
            start += leaf_width * sum(1 for _ in _leaves(child))
    if not children:
        return _Placed(node, left + leaf_width / 2, depth)
    return _Placed(node, sum(child.x for child in children) / len(children), depth, tuple(children))


def _formulas(node: Node) -> Iterator[str]:
    for text in (node["formula"], node["path"]):
        if text is not None and text != "true":
            yield text
    for child in (node["left"], node["right"]):
        if child is not None:
            yield from _formulas(child)


def _names(results: Mapping[str, Any], tree: Node, spec: StudySpec) -> dict[Box, Name]:
    """Names for all boxes of the tree; those of the source's formula have the same name as elsewhere."""
    source = results["summary"]["formulas"]["source"]
    texts = [*([source] if source else []), *_formulas(tree)]
    boxes = dict.fromkeys(box for text in texts for box in boxes_of(to_sdnf(parse(text))))
    return name_boxes(boxes, "S", spec.source)


def _branch(axes: Axes, start: tuple[float, float], end: tuple[float, float], *, satisfies: bool) -> None:
    begin, finish = (start[0], start[1] - 0.45), (end[0], end[1] + 0.52)
    arrow(axes, begin, finish, colour=GREEN if satisfies else VERMILION)
    axes.text(
        0.5 * (begin[0] + finish[0]) + (-0.14 if satisfies else 0.14), 0.5 * (begin[1] + finish[1]) + 0.05,
        "satisfied" if satisfies else "violated", ha="right" if satisfies else "left", va="bottom",
        fontsize=9.5, color="#00694C" if satisfies else "#A54700",
    )  # fmt: skip


def _node(axes: Axes, place: _Placed, y: float, names: Mapping[Box, Name]) -> None:
    node = place.node
    counts = f"{node['positives']} with label 1, {node['negatives']} with −1"
    if node["formula"] is not None:
        (primitive,) = to_sdnf(parse(node["formula"])).disjuncts[0].primitives
        numbers = rf"rate {node['rate']:.3f}, gain {node['gain']:.3f}"
        text = f"${math_primitive(primitive, names)}$\n{counts}\n{numbers}"
        note(axes, place.x, y, text, face="#E8F3FB", edge=SKY, shape="round,pad=0.55,rounding_size=1.4")
        return
    wanted = node["label"] == 1
    stop = f", condition {node['stop']}" if node["stop"] else ""
    text = f"{_path(node['path'], names)}\n{counts}\nleaf: label {'1' if wanted else '−1'}{stop}"
    note(
        axes, place.x, y, text, face="#E5F5F0" if wanted else PAPER, edge=GREEN if wanted else MUTED,
        shape="square,pad=0.45",
    )  # fmt: skip


def _path(text: str, names: Mapping[Box, Name]) -> str:
    """A path formula, a line a primitive."""
    if text == "true":
        return r"$\top$"
    sdnf: SDNF = to_sdnf(parse(text))
    lines = [f"${math_primitive(part, names)}$" for disjunct in sdnf.disjuncts for part in disjunct.primitives]
    return "\n".join([*(f"{line} ∧" for line in lines[:-1]), lines[-1]])
