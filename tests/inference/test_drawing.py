import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.inference import drawing, plane
from tickwise.inference.explanation import explain
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse


def panels(formula, data, rows=(0,), variables=("x",)):
    return drawing.draw(explain(parse(formula), data), data, np.array(rows), variables)


@pytest.fixture
def ramp():
    """From 0 at tick 0 to 10 at tick 10, and its mirror, which ends at tick 5."""
    up = np.arange(11.0)[:, None]
    return LabelledTrajectories.from_arrays([up, 10 - up[:6]], [1, -1], ("x",), ids=["up", "down"])


def test_a_trajectory_goes_from_corner_to_corner(ramp):
    [panel] = panels("F[0,1] (x >= 20)", ramp, rows=(0, 1))  # 20 is on the axis, which has 4 % of 20 beside it
    other, one = panel.lines  # label -1 lies below label 1
    assert (other.name, one.name) == ("down", "up")
    places = [tuple(map(float, point.split(","))) for point in one.points.split()]
    assert len(places) == 11
    assert len(other.points.split()) == 6
    unit = (drawing.BOTTOM - drawing.TOP) / 21.6
    assert places[0] == (drawing.LEFT, pytest.approx(drawing.BOTTOM - 0.8 * unit, abs=0.051))
    assert places[-1] == (drawing.RIGHT, pytest.approx(drawing.BOTTOM - 10.8 * unit, abs=0.051))
    assert [tick.text for tick in panel.across] == ["0", "2", "4", "6", "8", "10"]
    assert [tick.text for tick in panel.up] == ["0", "5", "10", "15", "20"]


def test_a_mark_spans_window_and_range(ramp):
    [panel] = panels("F[2,4] G[0,3] !(x <= 2)", ramp)
    [mark] = panel.marks
    assert mark.outside
    assert mark.name == "1 ◇□¬"
    tick = (drawing.RIGHT - drawing.LEFT) / 10
    assert mark.frame.x == pytest.approx(drawing.LEFT + tick * (2 - 0.35), abs=0.051)
    assert mark.frame.x + mark.frame.width == pytest.approx(drawing.LEFT + tick * (7 + 0.35), abs=0.11)
    assert mark.rest == pytest.approx(drawing.LEFT + tick * (4 + 0.35), abs=0.051)
    assert mark.frame.y + mark.frame.height == pytest.approx(drawing.BOTTOM, abs=0.051)  # the lower side is open
    unit = (drawing.BOTTOM - drawing.TOP) / 10.8
    assert mark.frame.y == pytest.approx(drawing.BOTTOM - unit * 2.4, abs=0.051)


def test_no_line_closes_a_range_that_has_no_end(ramp):
    [panel] = panels("F[2,4] (x <= 2) & F[5,6] (3 <= x <= 4)", ramp)
    open_below, closed = panel.marks
    assert closed.frame.edges.count("M") == 4
    left, top, right = open_below.frame.x, open_below.frame.y, open_below.frame.x + open_below.frame.width
    assert open_below.frame.edges.count("M") == 3
    assert f"M{left:g} {top:g}H{right:g}" in open_below.frame.edges


def test_a_ring_is_where_a_trajectory_first_leaves_what_it_may_not_leave():
    path = np.array([[0.0, 0.0], [1.0, 5.0], [4.0, 6.0], [5.0, 0.0]])
    data = LabelledTrajectories.from_arrays([path, path], [1, -1], ("x", "y"))
    for formula, ticks_x, ticks_y in (
        ("G[0,3] (x <= 3 & y <= 7)", [2], []), ("G[0,3] (x <= 3 & y <= 4)", [], [1]),
        ("G[1,3] !(x >= 4)", [2], []), ("F[0,1] (x >= 3)", [], []), ("G[3,9] (y >= 1)", [], [3]),
    ):  # fmt: skip
        for panel, ticks in zip(panels(formula, data, variables=("x", "y")), (ticks_x, ticks_y), strict=True):
            [line] = panel.lines
            points = [tuple(map(float, point.split(","))) for point in line.points.split()]
            assert list(line.breaks) == [points[tick] for tick in ticks], formula


def test_names_stand_beside_the_axes_in_the_order_of_the_lines():
    ends = [5.0, 5.1, 0.0, 9.0, 5.05]
    data = LabelledTrajectories.from_arrays(
        [np.linspace(3, end, 5)[:, None] for end in ends], [1, 1, -1, -1, 1], ("x",), ids=["a", "b", "c", "d", "e"]
    )
    found = explain(parse("F[0,4] (x >= 3)"), data)
    [panel] = drawing.draw(found, data, np.arange(5), ["x"], named=True)
    assert panel.right == drawing.RIGHT - 8
    lines = sorted(panel.lines, key=lambda line: line.place[1])
    assert [line.name for line in lines] == ["d", "b", "e", "a", "c"]
    assert all(line.beside for line in lines)
    levels = [line.place[1] for line in lines]
    assert min(np.diff(levels)) >= 13.9
    assert levels[-1] <= drawing.BOTTOM + 4


def test_a_plane_has_the_states_of_the_window_over_the_region():
    paths = np.array([[[0, 0], [1, 2], [2, 4], [3, 6]], [[9, 9], [9, 8], [9, 7], [9, 6]]], dtype=float)
    data = LabelledTrajectories.from_arrays(paths, [1, -1], ("x", "y"), ids=["up", "down"])
    found = explain(parse("F[1,2] (1 <= x <= 2 & y >= 3) & G[3,3] (x <= 5)"), data)
    first, second = plane.planes(found, data, np.array([0, 1]))
    assert (first.name, first.variables) == ("1", ("x", "y"))
    assert [(way.name, way.label, len(way.points.split())) for way in first.ways] == [("down", -1, 2), ("up", 1, 2)]
    assert first.frame.edges.count("M") == 3  # y has no upper end
    assert first.ways[1].points.split()[0].split(",")[0] == f"{first.frame.x:g}"  # x = 1, its left side
    assert second.frame.edges.count("M") == 1
    assert second.frame.height == plane.BOTTOM - plane.TOP
    assert [len(way.points.split()) for way in second.ways] == [1, 1]


def test_a_primitive_of_one_variable_among_three_has_no_plane():
    data = LabelledTrajectories.from_arrays(np.random.default_rng(0).random((2, 4, 3)), [1, -1], ("x", "y", "z"))
    found = explain(parse("F[0,1] (x >= 0.5) & F[2,3] (z >= 0.5 & y >= 0.1)"), data)
    [only] = plane.planes(found, data, np.array([0]))
    assert (only.name, only.variables) == ("2", ("z", "y"))


def test_marks_belong_to_their_variable_and_names_do_not_cover_each_other():
    data = LabelledTrajectories.from_arrays(np.random.default_rng(0).random((2, 9, 2)), [1, -1], ("x", "y"))
    formula = "F[0,4] (x >= 0.5) & G[6,8] (x <= 0.5 & y <= 1) | G[0,4] (x <= 0.5)"
    x, y = panels(formula, data, variables=("x", "y"))
    assert [mark.name for mark in x.marks] == ["1.1 ◇", "1.2 □", "2.1 □"]
    assert [mark.name for mark in y.marks] == ["1.2 □"]
    for index, mark in enumerate(x.marks):
        for other in x.marks[:index]:
            assert abs(mark.place[1] - other.place[1]) >= 13.9 or abs(mark.place[0] - other.place[0]) >= 40


def test_what_is_no_primitive_is_not_drawn(ramp):
    assert drawing.primitive_of(parse("F[0,4] G[0,1] F[0,2] (x >= 3)")) is None
    assert drawing.primitive_of(parse("!F[0,4] (x >= 3)")) is not None
    [panel] = panels("true", ramp)
    assert panel.marks == ()


def test_constant_values_and_a_single_tick_have_axes():
    data = LabelledTrajectories.from_arrays(np.full((2, 1, 1), 7.0), [1, -1], ("x",))
    [panel] = panels("F[0,0] (x >= 7)", data)
    assert panel.lines[0].points
    assert len({tick.text for tick in panel.up}) == len(panel.up) >= 2


@given(st.integers(0, 30), st.integers(0, 30), st.integers(1, 10))
def test_a_sample_has_so_many_of_each_label(positives, negatives, most):
    labels = np.repeat([1, -1], [positives + 1, negatives + 1])
    data = LabelledTrajectories.from_arrays(np.zeros((len(labels), 1, 1)), labels)
    rows = drawing.sample(data, most)
    assert np.all(np.diff(rows) > 0)
    assert [int((labels[rows] == label).sum()) for label in (1, -1)] == [
        min(positives + 1, most), min(negatives + 1, most),
    ]  # fmt: skip
    assert rows.tolist() == drawing.sample(data, most).tolist()
