import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.errors import FormulaError
from tickwise.logic.alignment import Alignment, align, aligned, carried
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.structure import structurally_equivalent
from tickwise.logic.syntax import Formula


def test_by_hand():
    source = parse("F[1,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 4) & F[9,12] (3 <= x <= 5)")
    target = parse("F[3,7] G[0,3] (4 <= x <= 6 & 1 <= y <= 4) & F[11,15] (6 <= x <= 8)")
    # x: sides further on by 3, 4, 3, 3, so by 3, and 1 of 4 remains; y: by 1 and 0, so by a half
    # windows: later by 2, 2, 2, 3, so by 2, and 1 of 4 remains; with the duration's 1 it is 2 of 5
    assert align(source, target) == Alignment({"x": 3, "y": 0.5}, 2, {"x": 0.25, "y": 0.5}, 0.4)


def test_a_side_open_in_one_formula_only_is_infinitely_far():
    found = align(parse("F[1,5] (x >= 1 & y <= 3)"), parse("F[1,5] (1 <= x <= 2 & y <= 4)"))
    assert found.regions == {"x": math.inf, "y": 0}
    assert found.shifts == {"x": 0, "y": 1}
    assert align(parse("F[1,5] (x >= 1)"), parse("F[1,5] (y >= 1)")).regions == {"x": math.inf, "y": math.inf}


def test_the_sources_disjuncts_are_taken_again():
    source = "F[1,5] (x >= 1)"
    found = align(parse(source), parse(f"{source} | F[3,7] (x >= 2)"))
    assert found.delay == 1  # 0, 0, 2, 2
    assert found.windows == 1


def test_other_structures_are_refused_in_one_line():
    for function in (align, aligned, carried):
        with pytest.raises(FormulaError, match="not structurally transferable") as caught:
            function(parse("F[1,5] (x >= 1)"), parse("G[1,5] (x >= 1)"))
        assert "\n" not in str(caught.value)


def test_a_source_laid_over_its_target_by_hand():
    source = "F[1,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 4) & F[9,12] !(3 <= x <= 5)"
    target = "F[3,7] G[0,3] (4 <= x <= 6 & 1 <= y <= 4) & F[11,15] !(6 <= x <= 8)"
    # x further on by 3; y by 0 as well as by 1, so by 0; later by 2
    moved = "F[3,7] G[0,2] (4 <= x <= 5 & 0 <= y <= 4) & F[11,14] !(6 <= x <= 8)"
    assert str(aligned(parse(source), parse(target))) == str(to_sdnf(parse(moved)))
    # sides that are open in one only say nothing of the displacement
    assert str(aligned(parse("F[1,5] (x >= 1)"), parse("F[2,5] (x <= 3)"))) == "F[1,5] (x >= 1)"


def test_a_source_carried_over_by_hand():
    source = "F[1,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 4) & F[9,12] !(3 <= x <= 5)"
    target = "F[3,7] G[0,3] (4 <= x <= 6 & 1 <= y <= 4) & F[11,15] !(8 <= x <= 10)"
    # the first centroid is (1.5, 2) and is to be (5, 2.5), the second is 4 and is to be 9
    there = "F[1,5] G[0,2] (4.5 <= x <= 5.5 & 0.5 <= y <= 4.5) & F[9,12] !(8 <= x <= 10)"
    assert str(carried(parse(source), parse(target))) == str(to_sdnf(parse(there)))
    assert str(carried(parse("F[1,5] (x >= 1)"), parse("F[2,5] (x >= 3)"))) == "F[1,5] (x >= 3)"
    assert str(carried(parse("F[1,5] (x >= 1)"), parse("F[2,5] (x <= 3)"))) == "F[1,5] (x >= 1)"


def test_no_window_is_moved_before_the_beginning():
    source, target = parse("F[2,5] (x >= 1) & G[30,40] (x >= 1)"), parse("F[1,2] (x >= 1) & G[3,4] (x >= 1)")
    assert str(aligned(source, target)) == "F[0,3] (x >= 1) & G[28,38] (x >= 1)"  # not earlier by 27


def test_each_disjunct_is_laid_over_one():
    target = "F[4,8] (x >= 7) | F[9,13] (x >= -2)"
    assert str(aligned(parse("F[1,5] (x >= 1)"), parse(target))) == target


numbers = st.integers(-20, 20)


@st.composite
def formulas(draw: st.DrawFn, shift: int = 0, delay: int = 0) -> Formula:
    return made([draw(numbers) for _ in range(3)], draw(st.integers(0, 9)), draw(st.integers(1, 9)), shift, delay)


def made(sides: list[int], start: int, duration: int, shift: int = 0, delay: int = 0) -> Formula:
    first, second, third = sides
    low, high = min(first, second) + shift, max(first, second) + shift
    begin = start + delay
    stay = f"F[{begin},{begin + 4}] G[0,{duration}] ({low} <= x <= {high})"
    return parse(f"{stay} & F[{begin + 30},{begin + 33}] (x >= {third + shift})")


@given(formulas(), formulas(), formulas())
def test_what_remains_is_a_metric(a: Formula, b: Formula, c: Formula):
    def far(first: Formula, second: Formula) -> tuple[float, float]:
        found = align(first, second)
        return found.regions["x"], found.windows

    assert far(a, a) == (0, 0)
    assert far(a, b) == pytest.approx(far(b, a))
    for direct, one, other in zip(far(a, b), far(a, c), far(c, b), strict=True):
        assert direct <= one + other + 1e-9


@given(st.lists(numbers, min_size=3, max_size=3), st.integers(0, 9), st.integers(1, 9), numbers, st.integers(0, 9))
def test_a_displaced_formula_is_no_other(sides: list[int], start: int, duration: int, shift: int, delay: int):
    plain, displaced = made(sides, start, duration), made(sides, start, duration, shift, delay)
    assert align(plain, displaced) == Alignment({"x": shift}, delay, {"x": 0}, 0)
    assert aligned(plain, displaced) == to_sdnf(displaced)
    assert carried(plain, displaced) == to_sdnf(made(sides, start, duration, shift))


@given(formulas(), formulas())
def test_a_formula_laid_over_another_is_displaced_no_more(source: Formula, target: Formula):
    moved = aligned(source, target)
    assert structurally_equivalent(moved, to_sdnf(target))
    assert aligned(moved, target) == moved
    assert align(moved, target).regions == align(source, target).regions
