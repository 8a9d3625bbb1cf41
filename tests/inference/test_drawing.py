import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.inference import drawing
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
    assert mark.x == pytest.approx(drawing.LEFT + tick * (2 - 0.35), abs=0.051)
    assert mark.x + mark.width == pytest.approx(drawing.LEFT + tick * (7 + 0.35), abs=0.11)
    assert mark.rest == pytest.approx(drawing.LEFT + tick * (4 + 0.35), abs=0.051)
    assert mark.y + mark.height == pytest.approx(drawing.BOTTOM, abs=0.051)  # the lower side is open
    unit = (drawing.BOTTOM - drawing.TOP) / 10.8
    assert mark.y == pytest.approx(drawing.BOTTOM - unit * 2.4, abs=0.051)


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
