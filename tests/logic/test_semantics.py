from __future__ import annotations

import math
import tracemalloc
from importlib.util import find_spec

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.logic.twins import State, robustness_twin, signal_twin, verdict_twin
from tests.strategies import VARIABLES, batches, formulas, intervals, predicates, primitives, random_trajectories, sdnfs
from tickwise.errors import DataError, UnknownVariableError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import Primitive
from tickwise.logic.semantics import holds, robustness, verdict
from tickwise.logic.syntax import Always, And, Bound, Box, Constant, Eventually, Formula, Interval, Not, Or, Verdict

Ragged = tuple[NDArray[np.float64], NDArray[np.int64]]


def states_of(values: NDArray[np.float64], length: int) -> list[State]:
    return [dict(zip(VARIABLES, row, strict=True)) for row in values[:length].tolist()]


@settings(max_examples=400)
@given(formulas(), batches())
def test_verdicts_agree_with_the_twin(phi: Formula, batch: Ragged) -> None:
    values, lengths = batch
    answers = verdict(phi, values, variables=VARIABLES, lengths=lengths)
    assert isinstance(answers, np.ndarray)
    assert answers.dtype == np.int8
    expected = [verdict_twin(phi, states_of(*one)) for one in zip(values, lengths, strict=True)]
    assert answers.tolist() == expected


@settings(max_examples=400)
@given(formulas(), batches())
def test_robustness_agrees_with_the_twin_and_with_the_verdict(phi: Formula, batch: Ragged) -> None:
    values, lengths = batch
    answers = robustness(phi, values, variables=VARIABLES, lengths=lengths)
    assert isinstance(answers, np.ndarray)
    for answer, *one in zip(answers, values, lengths, strict=True):
        states = states_of(*one)
        lower, upper = robustness_twin(phi, states)
        match verdict_twin(phi, states):
            case 1:
                assert answer == lower
                assert answer >= 0
            case -1:
                assert answer == upper
                assert answer <= 0
            case 0:
                assert math.isnan(answer)


@st.composite
def long_formulas(draw: st.DrawFn) -> Formula:
    """Long windows; at times every box is asked for again, at other ticks."""
    phi = draw(formulas(("x", "y", "z"), longest=90, max_leaves=4))
    return draw(st.sampled_from((phi, And((phi, Not(Eventually(draw(intervals(70)), phi)))))))


@settings(max_examples=150, deadline=None)
@given(long_formulas(), batches(3, most=3, longest=150))
def test_words_of_many_ticks_agree_with_the_signals_of_the_twin(phi: Formula, batch: Ragged) -> None:
    """Signals and windows longer than a word, shifts by whole words, and windows beyond the data."""
    values, lengths = batch
    options = {"variables": ("x", "y", "z"), "lengths": lengths}
    expected = np.array([signal_twin(phi, one[:length]) for one, length in zip(values, lengths, strict=True)])
    verdicts = verdict(phi, values, **options)
    np.testing.assert_array_equal(verdicts, expected[:, 0])
    answers = np.select([expected[:, 0] > 0, expected[:, 0] < 0], [expected[:, 1], expected[:, 2]], math.nan)
    np.testing.assert_array_equal(robustness(phi, values, **options), answers)


@settings(max_examples=50, deadline=None)
@given(formulas(), st.sampled_from((1, 7, 8, 9, 63, 64, 65, 255, 256, 257, 600)), st.data())
def test_answers_do_not_depend_on_how_trajectories_come_together(phi: Formula, count: int, data: st.DataObject) -> None:
    """Blocks of any size, the last one partly filled, and some trajectories that end early."""
    values = random_trajectories(data.draw(st.integers(0, 2**32 - 1)), count, 12, len(VARIABLES))
    lengths = np.full(count, 12)
    for which in data.draw(st.sets(st.integers(0, count - 1), max_size=3)):
        lengths[which] = data.draw(st.integers(1, 12))
    options = {"variables": VARIABLES, "lengths": lengths}
    few = sorted({0, count // 2, count - 1, *np.flatnonzero(lengths < 12).tolist()})
    alone = [phi.verdict(values[i, : lengths[i]], variables=VARIABLES) for i in few]
    assert np.asarray(phi.verdict(values, **options))[few].tolist() == alone
    numbers = [phi.robustness(values[i, : lengths[i]], variables=VARIABLES) for i in few]
    np.testing.assert_array_equal(np.asarray(phi.robustness(values, **options))[few], numbers)


@pytest.mark.parametrize("method", ["verdict", "robustness"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_nan_is_found_wherever_it_lies_within_a_length(method: str, order: str) -> None:
    phi = parse("F[0,2] (x >= 1) | F[0,1] (y >= 1)")
    values = np.zeros((600, 80, 2), order=order)
    lengths = np.full(600, 80)
    lengths[1] = 4
    values[1, 4:] = math.nan
    options = {"variables": VARIABLES, "lengths": lengths}
    assert np.all(np.asarray(getattr(phi, method)(values, **options)) <= 0)
    values[599, 79, 1] = math.nan
    with pytest.raises(DataError, match=r"^trajectory 599 has NaN at tick 79 in 'y'; fill it, leave it out, or set"):
        getattr(phi, method)(values, **options)


@pytest.mark.parametrize("method", ["verdict", "robustness"])
def test_many_trajectories_are_not_copied(method: str) -> None:
    phi = parse("F[1,15] G[0,4] (3 <= x <= 4) & F[21,39] (5 <= y <= 8)")
    values = random_trajectories(0, 20_000, 41, len(VARIABLES))
    getattr(phi, method)(values[:1])  # loads the compiled code
    tracemalloc.start()
    getattr(phi, method)(values)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < values.nbytes / 10


@given(formulas(), st.integers(0, 2**32 - 1))
def test_infinite_values_are_values_too(phi: Formula, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = random_trajectories(seed, 5, 12, len(VARIABLES))
    values[rng.random(values.shape) < 0.2] = math.inf
    values[rng.random(values.shape) < 0.2] = -math.inf
    states = [states_of(one, 12) for one in values]
    assert verdict(phi, values, variables=VARIABLES).tolist() == [verdict_twin(phi, one) for one in states]  # type: ignore[union-attr]


@settings(max_examples=100)
@given(formulas(), batches())
def test_single_answers_are_the_batch_s(phi: Formula, batch: Ragged) -> None:
    values, lengths = batch
    parts = [one[:length] for one, length in zip(values, lengths, strict=True)]
    in_batch = phi.verdict(parts, variables=VARIABLES)
    singly = [phi.verdict(part, variables=VARIABLES) for part in parts]
    assert all(isinstance(one, Verdict) for one in singly)
    assert in_batch.tolist() == singly  # type: ignore[union-attr]
    number = phi.robustness(parts[0], variables=VARIABLES)
    assert isinstance(number, float)
    np.testing.assert_equal(number, phi.robustness(parts, variables=VARIABLES)[0])  # type: ignore[index]


@settings(max_examples=100)
@given(formulas(), batches(), st.sampled_from((1e9, -1e9, math.inf)))
def test_what_lies_past_the_end_means_nothing(phi: Formula, batch: Ragged, filling: float) -> None:
    values, lengths = batch
    filled = np.where(np.isnan(values), filling, values)
    options = {"variables": VARIABLES, "lengths": lengths}
    np.testing.assert_array_equal(verdict(phi, filled, **options), verdict(phi, values, **options))
    np.testing.assert_array_equal(robustness(phi, filled, **options), robustness(phi, values, **options))


@settings(max_examples=200)
@given(primitives(), batches())
def test_a_negated_primitive_is_the_primitive_of_its_dual(primitive: Primitive, batch: Ragged) -> None:
    """¬◇ρ, □¬ρ and the primitive that is kept for them have one verdict, on trajectories of any length."""
    values, lengths = batch
    options = {"variables": VARIABLES, "lengths": lengths}
    said = verdict(primitive.formula, values, **options)
    for negation in (Not(primitive.formula), primitive.negation.formula):
        np.testing.assert_array_equal(verdict(negation, values, **options), -said)
    assert primitive.negation.negation == primitive


@given(formulas(constants=False), batches(), st.integers(0, 2**32 - 1))
def test_a_verdict_given_early_is_never_taken_back(phi: Formula, batch: Ragged, seed: int) -> None:
    values, lengths = batch
    early = verdict(phi, values, variables=VARIABLES, lengths=lengths)
    longer = random_trajectories(seed, len(lengths), phi.end_effect + values.shape[1] + 1, len(VARIABLES))
    for row, one, length in zip(longer, values, lengths, strict=True):
        row[:length] = one[:length]
    late = verdict(phi, longer, variables=VARIABLES)
    assert np.all(late != 0)
    assert np.all((early == 0) | (early == late))


@given(predicates(), batches())
def test_holds_is_the_verdict_at_each_tick(predicate: Box | Not, batch: Ragged) -> None:
    values, lengths = batch
    found = holds(predicate, values, VARIABLES)
    for row, one, length in zip(found, values, lengths, strict=True):
        states = states_of(one, length)
        assert [2 * int(answer) - 1 for answer in row[:length]] == [
            verdict_twin(predicate, states, tick) for tick in range(length)
        ]


def test_holds_names_an_unknown_variable() -> None:
    with pytest.raises(UnknownVariableError) as caught:
        holds(Box.of(z=(0, 1)), np.zeros((3, 2)), VARIABLES)
    assert str(caught.value) == "the predicate names 'z', which the data does not have; it has 'x', 'y'"
    with pytest.raises(TypeError, match="true is not a predicate; give a box or its complement"):
        holds(Not(Constant(True)), np.zeros((3, 2)), VARIABLES)


X = np.array([[0.0], [1.0], [5.0], [2.0]])


@pytest.mark.parametrize(
    ("text", "expected", "number"),
    [
        ("F[0,3] (x >= 5)", Verdict.TRUE, 0.0),
        ("F[0,3] (x > 5)", Verdict.FALSE, 0.0),
        ("F[0,9] (x > 6)", Verdict.UNKNOWN, math.nan),
        ("F[0,9] (x >= 4)", Verdict.TRUE, 1.0),
        ("G[0,9] (x <= 4)", Verdict.FALSE, -1.0),
        ("G[0,9] (x <= 6)", Verdict.UNKNOWN, math.nan),
        ("G[0,3] (-1 <= x <= 7)", Verdict.TRUE, 1.0),
        ("F[0,2] G[0,1] (1 <= x <= 5)", Verdict.TRUE, 0.0),
        ("F[0,9] G[0,1] (x >= 5)", Verdict.UNKNOWN, math.nan),
        ("G[0,9] F[0,1] (x >= 3)", Verdict.FALSE, -2.0),
        ("!F[0,3] (x >= 8)", Verdict.TRUE, 3.0),
        ("F[9,9] (x >= 0) | true", Verdict.TRUE, math.inf),
        ("F[9,9] (x >= 0) & false", Verdict.FALSE, -math.inf),
        ("F[4,4] (x >= 0) | F[2,2] (x >= 4)", Verdict.TRUE, 1.0),
    ],
)
def test_by_hand(text: str, expected: Verdict, number: float) -> None:
    phi = parse(text)
    assert phi.verdict(X) is expected
    np.testing.assert_equal(phi.robustness(X), number)


def test_a_formula_without_variables() -> None:
    assert parse("F[0,3] true").verdict(X) is Verdict.TRUE


def test_a_bare_array_s_columns_are_the_variables_in_order_of_appearance() -> None:
    phi = parse("F[0,0] (y >= 1) & G[0,0] (x <= 0)")
    data = np.array([[1.0, 0.0]])
    assert phi.verdict(data) is Verdict.TRUE
    assert phi.verdict(data, variables=("x", "y")) is Verdict.FALSE
    assert phi.verdict(pd.DataFrame(data, columns=["y", "x"])) is Verdict.TRUE
    assert phi.robustness(data) == 0.0


def test_a_horizon_far_beyond_the_data_costs_nothing() -> None:
    phi = parse("F[0,1000000000] G[5,2000000000] (x >= 0) & G[1000000000,2000000000] (x >= 0)")
    assert phi.verdict(X) is Verdict.UNKNOWN
    assert parse("F[3,1000000000] (x <= 2)").verdict(X) is Verdict.TRUE
    # further than text may say
    low, high = (parse(text) for text in ("x >= 0", "x <= 2"))
    beyond = Or((Always(Interval(10**30, 10**40), low), Eventually(Interval(3, 10**50), high)))
    assert beyond.verdict(X) is Verdict.TRUE
    assert beyond.robustness(X) == 0.0


def test_a_foreign_node_is_refused() -> None:
    class Until(Formula):
        __slots__ = ()

    with pytest.raises(TypeError, match="Until is not a formula node of this library"):
        verdict(Until(), X)


# --- a second opinion: rtamt, on one 0/1 signal for each predicate ---


def _rtamt_text(node: Formula, predicates: dict[Box, str]) -> str:
    match node:
        case Box():
            return f"({predicates.setdefault(node, f'p{len(predicates)}')} >= 0.5)"
        case Not(operand):
            return f"(not {_rtamt_text(operand, predicates)})"
        case And(operands):
            return f"({' and '.join(_rtamt_text(child, predicates) for child in operands)})"
        case Or(operands):
            return f"({' or '.join(_rtamt_text(child, predicates) for child in operands)})"
        case Eventually(interval, operand) | Always(interval, operand):
            name = "eventually" if isinstance(node, Eventually) else "always"
            return f"({name}[{interval.start}:{interval.end}] {_rtamt_text(operand, predicates)})"
    raise AssertionError(node)


@pytest.mark.skipif(find_spec("rtamt") is None, reason="rtamt is not installed (it needs Python below 3.13)")
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=150, deadline=None)
@given(
    st.one_of(formulas(constants=False, longest=3), sdnfs(longest=3).map(lambda phi: phi.formula)),
    st.integers(0, 3),
    st.integers(0, 2**32 - 1),
)
def test_rtamt_agrees_where_the_horizon_fits(phi: Formula, longer: int, seed: int) -> None:
    import rtamt

    # rtamt reads no signal of a single tick
    ticks = max(phi.end_effect + 1 + longer, 2)
    trajectory = random_trajectories(seed, 1, ticks, len(VARIABLES))[0]
    predicates: dict[Box, str] = {}
    specification = rtamt.StlDiscreteTimeSpecification()
    specification.spec = _rtamt_text(phi, predicates)
    data: dict[str, list[float]] = {"time": list(range(len(trajectory)))}
    for box, name in predicates.items():
        specification.declare_var(name, "float")
        data[name] = holds(box, trajectory, VARIABLES).astype(float).tolist()
    specification.parse()
    answer = specification.evaluate(data)[0][1]
    assert (answer > 0) == (phi.verdict(trajectory, variables=VARIABLES) is Verdict.TRUE)


def test_a_bound_at_one_side_only() -> None:
    box = Box((Bound("x", lower=1.0, lower_strict=True),))
    assert holds(box, np.array([[1.0], [math.inf], [-math.inf]]), ("x",)).tolist() == [False, True, False]
    assert robustness(box, np.array([[3.0]])) == 2.0


@pytest.mark.parametrize("empty", [[], np.zeros((0, 5, 1))])
def test_an_empty_batch_has_no_answers(empty: object) -> None:
    phi = parse("F[0,3] G[0,9] (x >= 1) | true")
    assert phi.verdict(empty).shape == (0,)  # type: ignore[union-attr, arg-type]
    assert phi.robustness(empty).shape == (0,)  # type: ignore[union-attr, arg-type]
