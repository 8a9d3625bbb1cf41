import numpy as np
import pytest

from tickwise.errors import UnknownVariableError
from tickwise.inference.explanation import Confusion, explain, parts_of
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse


def trajectories(rows, labels, variables=("x",)):
    return LabelledTrajectories.from_arrays(
        [np.array(row, float) for row in rows], labels, variables, ids=list("abcdef")
    )


@pytest.fixture
def data():
    # with F[0,1] (x >= 5) & G[2,3] (x <= 3):
    rows = [
        [[6], [0], [1], [1]],  # a, 1: both hold
        [[0], [5], [3], [3]],  # b, 1: both hold, on the boundary
        [[4.5], [0], [1], [1]],  # c, 1: the first fails, by 0.5
        [[6], [0], [1], [4]],  # d, -1: the second fails
        [[7], [0], [2], [2]],  # e, -1: both hold, the second by 1, the first by 2
        [[7], [0]],  # f, -1: the second is open, since it ends at tick 1
    ]
    return trajectories(rows, [1, 1, 1, -1, -1, -1])


PHI = "F[0,1] (x >= 5) & G[2,3] (x <= 3)"


def test_confusion_and_parts(data):
    found = explain(parse(PHI), data)
    assert found.predicted.tolist() == [1, 1, -1, -1, 1, 1]
    assert found.confusion == Confusion(2, 1, 2, 1)
    assert (found.confusion.count, found.confusion.wrong, found.confusion.error) == (6, 3, 0.5)
    first, second = found.separations
    assert (first.name, first.alone, first.reaching, first.keeping, first.removing) == (
        "1.1", (2, 3), (3, 3), (2, 3), (1, 0),
    )  # fmt: skip
    assert (second.name, second.alone, second.reaching, second.keeping, second.removing) == (
        "1.2", (3, 2), (2, 3), (2, 2), (0, 1),
    )  # fmt: skip
    assert (
        found.english
        == "within ticks 0 to 1, reach the region x ≥ 5; then, throughout ticks 2 to 3, stay in the region x ≤ 3"
    )


def test_why_each_mistake(data):
    why = {mistake.id: mistake.why for mistake in explain(parse(PHI), data).mistakes}
    assert why == {
        "c": "violates F[0,1] (x >= 5), by 0.5",
        "e": f"satisfies {PHI.replace(' & ', ' and ')}, by 1",
        "f": "ends at tick 1, before G[2,3] (x <= 3) is decided",
    }


def test_disjuncts_are_told_one_by_one(data):
    found = explain(parse("F[0,0] (x >= 6.5) | G[3,3] (x == 4) & F[0,0] (x >= 6)"), data)
    assert [separation.name for separation in found.separations] == ["1.1", "2.1", "2.2"]
    # G[3,3] keeps d, and f, which ends before it is decided
    assert [separation.keeping for separation in found.separations] == [(0, 2), (0, 2), (0, 2)]
    why = {mistake.id: mistake.why for mistake in found.mistakes}
    assert why["a"] == "violates F[0,0] (x >= 6.5), by 0.5; violates G[3,3] (x == 4), by 3"
    assert why["d"] == "satisfies G[3,3] (x == 4) and F[0,0] (x >= 6), by 0"
    assert why["e"] == "satisfies F[0,0] (x >= 6.5), by 0.5"


def test_a_formula_without_normal_form_has_parts_too(data):
    phi = parse("F[0,9] (x >= 5) & F[0,9] (x <= 1)")  # their windows overlap
    assert parts_of(phi) == (phi.children,)
    assert len(explain(phi, data).separations) == 2
    constant = explain(parse("true"), data)
    assert constant.predicted.tolist() == [1] * 6
    assert {mistake.why for mistake in constant.mistakes} == {"satisfies true"}


def test_no_formula_predicts_minus_one(data):
    found = explain(None, data)
    assert found.confusion == Confusion(0, 3, 0, 3)
    assert [mistake.id for mistake in found.mistakes] == ["a", "b", "c"]
    assert found.separations == ()


def test_an_unknown_variable_is_named(data):
    with pytest.raises(UnknownVariableError, match="speed"):
        explain(parse("F[0,1] (speed >= 5)"), data)


def test_the_document_is_plain(data):
    document = explain(parse(PHI), data).document()
    assert document["primitives"][1]["removing"] == {"positives": 0, "negatives": 1}
    assert document["misclassified"][0]["id"] == "c"
    assert Confusion.pooled([Confusion(1, 2, 3, 4), Confusion(10, 20, 30, 40)]) == Confusion(11, 22, 33, 44)
