"""Names of inferred regions."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.experiments.synthetic import PLAIN, SOURCE, TARGET
from tickwise.envs.catalog import CASE_STUDY_1_SOURCE, CASE_STUDY_1_TARGET, CASE_STUDY_2_TARGET
from tickwise.experiments.regions import (
    Name,
    clip,
    math_primitive,
    name_boxes,
    overlap,
    plain_primitive,
    ranges_text,
    read_formula,
)
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.syntax import Bound, Box

SIDES = st.tuples(st.integers(0, 9), st.integers(0, 9)).filter(lambda ends: ends[0] != ends[1]).map(sorted)
BOXES = st.builds(lambda x, y: Box.of(x=tuple(x), y=tuple(y)), SIDES, SIDES)


@pytest.mark.parametrize(
    ("name", "plain", "math"),
    [
        (Name("G", "S"), "Ḡˢ", r"\bar{G}^{\mathrm{S}}"),
        (Name("Y", "T", primed=True), "Ȳ′ᵀ", r"\bar{Y}'^{\mathrm{T}}"),
        (Name("B1", "T"), "B\u0304₁ᵀ", r"\bar{B}_{1}^{\mathrm{T}}"),
        (Name("G", "T", inferred=False), "Gᵀ", r"G^{\mathrm{T}}"),
    ],
)
def test_a_name_is_written_as_text_and_as_mathematics(name: Name, plain: str, math: str):
    assert name.plain == plain
    assert name.math == math


def test_formulas_are_written_with_names():
    source = read_formula(SOURCE, "S", CASE_STUDY_1_SOURCE)
    assert source is not None
    assert (source.symbol, source.plain) == ("φˢ", "◇[0,17] □[0,4] Ḡˢ ∧ ◇[22,40] Ȳˢ")
    plain = read_formula(PLAIN, "T", CASE_STUDY_1_TARGET, primed=True)
    assert plain is not None
    assert (plain.symbol, plain.plain) == ("φ′ᵀ", "◇[0,21] □[0,4] Ḡ′ᵀ ∧ ◇[26,40] Ȳ′ᵀ")


def test_disjuncts_of_several_primitives_are_bracketed():
    formula = read_formula(f"{TARGET} | F[0,3] (0 <= x <= 1 & 0 <= y <= 1)", "T", CASE_STUDY_1_TARGET)
    assert formula is not None
    assert formula.plain == "(◇[3,20] □[0,5] Ḡᵀ ∧ ◇[27,40] Ȳᵀ) ∨ (◇[0,3] R\u0304₁ᵀ)"


def test_no_formula_stays_none():
    assert read_formula(None, "S", CASE_STUDY_1_SOURCE) is None


def test_a_complement_is_marked():
    (primitive,) = to_sdnf(parse("G[1,5] F[0,2] !(3 <= x <= 4 & 3 <= y <= 5)")).disjuncts[0].primitives
    names = name_boxes([primitive.box], "S", CASE_STUDY_1_SOURCE)
    assert plain_primitive(primitive, names) == "□[1,5] ◇[0,2] ¬Ḡˢ"
    assert math_primitive(primitive, names) == r"□_{[1{,}5]}\,◇_{[0{,}2]}\,¬\bar{G}^{\mathrm{S}}"


def test_regions_without_a_true_counterpart_are_numbered():
    boxes = [Box.of(x=(0, 1), y=(0, 1)), Box.of(x=(3, 5), y=(3, 5)), Box.of(x=(8, 9), y=(0, 1))]
    labels = [name.label for name in name_boxes(boxes, "S", CASE_STUDY_1_SOURCE).values()]
    assert labels == ["R1", "G", "R2"]


def test_the_better_overlap_gets_the_name():
    wide, exact = Box.of(x=(0, 9), y=(0, 9)), Box.of(x=(3, 4), y=(3, 5))
    names = name_boxes([wide, exact], "S", CASE_STUDY_1_SOURCE)
    assert names[exact].label == "G"
    assert names[wide].label == "Y"


def test_several_true_regions_of_one_label_name_one_box():
    boxes = [Box.of(x=(2, 3), y=(1, 2)), Box.of(x=(4, 5), y=(1, 2))]
    labels = [name.label for name in name_boxes(boxes, "T", CASE_STUDY_2_TARGET).values()]
    assert labels == ["G", "R1"]


@given(st.lists(BOXES, unique=True, max_size=6))
def test_names_are_unique(boxes: list[Box]):
    names = name_boxes(boxes, "T", CASE_STUDY_1_TARGET)
    assert list(names) == boxes
    assert len({name.plain for name in names.values()}) == len(boxes)


@given(BOXES, BOXES)
def test_overlap_counts_cells(a: Box, b: Box):
    def cells(box: Box) -> set[tuple[int, int]]:
        left, bottom, right, top = (int(side) for side in clip(box, 9))
        return {(i, j) for i in range(left, right) for j in range(bottom, top)}

    assert overlap(a, b, 9) == pytest.approx(len(cells(a) & cells(b)) / len(cells(a) | cells(b)))


def test_open_sides_are_the_worlds():
    box = Box((Bound("x", lower=7.0),))
    assert clip(box, 9) == (7.0, 0.0, 9.0, 9.0)
    assert overlap(box, Box.of(x=(7, 9), y=(0, 9)), 9) == 1
    assert ranges_text(box) == "x ∈ [7, ∞)"
    assert ranges_text(Box((Bound("x", upper=2.5), Bound("y", 1.0, 2.0)))) == "(−∞, 2.5] × [1, 2]"
