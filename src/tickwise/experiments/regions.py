"""Names for the regions of inferred formulas: each is called after the true region that it resembles most."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Primitive, to_sdnf
from tickwise.logic.syntax import Box

_MACRON = "\u0304"
_SUPERSCRIPTS = {"S": "ˢ", "T": "ᵀ"}
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")

Rectangle = tuple[float, float, float, float]
"""Left, bottom, right, top in world units."""


@dataclass(frozen=True, slots=True)
class Name:
    """The name of a region, for instance Ḡ^S.

    Attributes:
        label: A letter and perhaps a number, such as ``B1``.
        task: ``S`` or ``T``.
        inferred: Whether it is an inferred region, which carries a bar.
        primed: Whether it belongs to the formula that was inferred without the information gain.
    """

    label: str
    task: str
    inferred: bool = True
    primed: bool = False

    @property
    def plain(self) -> str:
        """As Unicode text."""
        letter, number = self._parts
        text = unicodedata.normalize("NFC", letter + (_MACRON if self.inferred else ""))
        prime = "′" if self.primed else ""
        return text + prime + number.translate(_SUBSCRIPTS) + _SUPERSCRIPTS[self.task]

    @property
    def math(self) -> str:
        """As mathematical text, without the dollar signs about it."""
        letter, number = self._parts
        text = rf"\bar{{{letter}}}" if self.inferred else letter
        subscript = f"_{{{number}}}" if number else ""
        return text + ("'" if self.primed else "") + subscript + rf"^{{\mathrm{{{self.task}}}}}"

    @property
    def _parts(self) -> tuple[str, str]:
        letter = re.sub(r"\d+$", "", self.label)
        return letter, self.label[len(letter) :]


@dataclass(frozen=True, slots=True)
class NamedFormula:
    """A formula in SDNF and the names of its regions.

    Attributes:
        sdnf: The formula.
        task: ``S`` or ``T``.
        names: A name for each box.
        primed: Whether it was inferred without the information gain.
    """

    sdnf: SDNF
    task: str
    names: Mapping[Box, Name]
    primed: bool = False

    @property
    def symbol(self) -> str:
        """The formula's own name, for instance φˢ."""
        return formula_symbol(self.task, primed=self.primed)

    @property
    def plain(self) -> str:
        """The formula as Unicode text with the names of its regions."""
        several = any(len(disjunct.primitives) > 1 for disjunct in self.sdnf.disjuncts)
        brackets = "({})" if several and len(self.sdnf.disjuncts) > 1 else "{}"
        return " ∨ ".join(
            brackets.format(" ∧ ".join(plain_primitive(part, self.names) for part in disjunct.primitives))
            for disjunct in self.sdnf.disjuncts
        )


def read_formula(
    text: str | None, task: str, environment: EnvironmentSpec, *, primed: bool = False
) -> NamedFormula | None:
    """Read a formula and name its regions; None stays None.

    Args:
        text: The formula as text.
        task: ``S`` or ``T``.
        environment: The task's world with its true regions.
        primed: Whether it was inferred without the information gain.
    """
    if text is None:
        return None
    sdnf = to_sdnf(parse(text))
    return NamedFormula(sdnf, task, name_boxes(boxes_of(sdnf), task, environment, primed=primed), primed)


def formula_symbol(task: str, *, primed: bool = False) -> str:
    """The name of a formula as Unicode text, for instance φˢ."""
    return "φ" + ("′" if primed else "") + _SUPERSCRIPTS[task]


def math_symbol(task: str, *, primed: bool = False) -> str:
    """The name of a formula, such as φ^T, as mathematical text without the dollar signs about it."""
    return rf"\varphi{chr(39) if primed else ''}^{{\mathrm{{{task}}}}}"


def plain_primitive(primitive: Primitive, names: Mapping[Box, Name]) -> str:
    """A primitive as Unicode text, for instance ``◇[1,15] □[0,4] Ḡˢ``."""
    outer, *inner = tuple(primitive.operator.symbol)
    within = f" {inner[0]}[0,{primitive.duration}]" if inner else ""
    return f"{outer}{primitive.window}{within} {_sign(primitive)}{names[primitive.box].plain}"


def math_primitive(primitive: Primitive, names: Mapping[Box, Name]) -> str:
    """A primitive as mathematical text, without the dollar signs about it."""
    outer, *inner = tuple(primitive.operator.symbol)
    window = primitive.window
    within = rf"{inner[0]}_{{[0{{,}}{primitive.duration}]}}\," if inner else ""
    return (
        rf"{outer}_{{[{window.start}{{,}}{window.end}]}}\,{within}"
        rf"{_sign(primitive)}{names[primitive.box].math}"
    )


def _sign(primitive: Primitive) -> str:
    return "¬" if primitive.complemented else ""


def boxes_of(sdnf: SDNF) -> list[Box]:
    """The boxes of a formula, each once, in order of appearance."""
    parts = (part for disjunct in sdnf.disjuncts for part in disjunct.primitives)
    return list(dict.fromkeys(part.box for part in parts))


def name_boxes(
    boxes: Iterable[Box], task: str, environment: EnvironmentSpec, *, primed: bool = False
) -> dict[Box, Name]:
    """Call each box after the true region that it overlaps most, each name once; the rest are R1, R2, ….

    Args:
        boxes: Different boxes.
        task: ``S`` or ``T``.
        environment: The task's world with its true regions.
        primed: Whether to mark the names with a prime.

    Returns:
        A name a box, in the order of the boxes.
    """
    boxes = list(boxes)
    pairs = [
        (overlap(box, landmark.box, environment.world.size), index, landmark.label)
        for index, box in enumerate(boxes)
        for landmark in environment.task.landmarks
    ]
    labels: dict[int, str] = {}
    for share, index, label in sorted(pairs, key=lambda pair: (-pair[0], pair[1])):
        if share > 0 and index not in labels and label not in labels.values():
            labels[index] = label
    unnamed = [index for index in range(len(boxes)) if index not in labels]
    labels |= {index: f"R{number}" for number, index in enumerate(unnamed, start=1)}
    return {box: Name(labels[index], task, primed=primed) for index, box in enumerate(boxes)}


def overlap(a: Box, b: Box, size: float) -> float:
    """The area in a square world that two boxes share, divided by the area that they cover together."""
    first, second = clip(a, size), clip(b, size)
    low = [max(pair) for pair in zip(first[:2], second[:2], strict=True)]
    high = [min(pair) for pair in zip(first[2:], second[2:], strict=True)]
    shared = _area((low[0], low[1], high[0], high[1]))
    together = _area(first) + _area(second) - shared
    return shared / together if together else 0.0


def _area(rectangle: Rectangle) -> float:
    left, bottom, right, top = rectangle
    return max(0.0, right - left) * max(0.0, top - bottom)


def clip(box: Box, size: float) -> Rectangle:
    """The rectangle of a box over x and y within a square world; open sides are the world's."""
    ranges = {bound.variable: bound for bound in box.bounds}
    sides = []
    for variable in ("x", "y"):
        bound = ranges.get(variable)
        low, high = (0.0, size) if bound is None else (max(0.0, bound.lower), min(size, bound.upper))
        sides.append((low, high))
    (left, right), (bottom, top) = sides
    return left, bottom, right, top


def ranges_text(box: Box) -> str:
    """A box as ranges, for instance ``[3, 4] × [3, 5]`` over x and y, else with the variables' names."""
    if box.variables == ("x", "y"):
        return " × ".join(_range(bound.lower, bound.upper) for bound in box.bounds)
    return ", ".join(f"{bound.variable} ∈ {_range(bound.lower, bound.upper)}" for bound in box.bounds)


def _range(lower: float, upper: float) -> str:
    low = "(−∞" if math.isinf(lower) else f"[{lower:g}"
    high = "∞)" if math.isinf(upper) else f"{upper:g}]"
    return f"{low}, {high}"
