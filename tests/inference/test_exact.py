"""The exact search finds what an enumeration of all primitives finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, best_of_all, every_time, problem_of, worth
from tests.inference.worlds import grid_prior
from tickwise.errors import ConfigurationError, UnknownVariableError
from tickwise.inference.beyond import beyond_levels
from tickwise.inference.bounding import Bounds
from tickwise.inference.boxes import Node
from tickwise.inference.exact import ExactProblem, ExactSettings, exact_search
from tickwise.inference.objective import trajectory_weights
from tickwise.inference.prior import BoxPrior, MarkovPrior, PathPrior, Prior
from tickwise.inference.space import OPERATORS, Gaps, SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories

WEIGHTS = (None, "balanced", {1: 3.0, -1: 0.5})
GAPS: tuple[Gaps, ...] = (((0, 5),), ((0, 2), (4, 5)), ((1, 4),), ((0, 1), (3, 5)))


def cells(seed: int, size: int, ticks: int, count: int, *, ragged: bool = False) -> LabelledTrajectories:
    """Lazy walks over the cells of a small grid, with labels by chance or by a visit."""
    rng = np.random.default_rng(seed)
    steps = rng.integers(-1, 2, (count, ticks, 2)) * (rng.random((count, ticks, 1)) < 0.6)
    steps[np.arange(count)[:, None], np.arange(ticks), rng.integers(0, 2, (count, ticks))] = 0  # one axis at a time
    places = np.empty((count, ticks, 2))
    here = rng.integers(0, size, (count, 2))
    for tick in range(ticks):
        here = np.clip(here + steps[:, tick], 0, size - 1)
        places[:, tick] = here + 0.5
    labels = np.where((places[:, ticks // 2 :] < 1).all(axis=2).any(axis=1), 1, -1)
    noise = rng.random(count) < rng.choice([0.0, 0.2, 0.5])
    labels = np.where(noise, -labels, labels)
    labels[:2] = 1, -1
    lengths = rng.integers(1, ticks + 1, count) if ragged else np.full(count, ticks)
    return LabelledTrajectories(places, lengths, labels, ("x", "y"), tuple(map(str, range(count))))


def numbers(seed: int, ticks: int, count: int, width: int, *, ragged: bool = False) -> LabelledTrajectories:
    """Trajectories of continuous variables that take few values."""
    rng = np.random.default_rng(seed)
    choices = np.sort(rng.uniform(0, 4, (width, 4)), axis=1).round(1)
    values = np.stack([rng.choice(row, (count, ticks)) for row in choices], axis=2)
    labels = np.where(rng.random(count) < 0.5, 1, -1)
    labels[:2] = 1, -1
    lengths = rng.integers(1, ticks + 1, count) if ragged else np.full(count, ticks)
    return LabelledTrajectories(values, lengths, labels, ("x", "y", "z")[:width], tuple(map(str, range(count))))


def markov_prior(seed: int, size: int, horizon: int) -> MarkovPrior:
    """A lazy random walk with some steps that never happen, so that some formulas are impossible."""
    rng = np.random.default_rng(seed)
    graph = grid_prior(size, horizon)
    places = np.asarray(graph.coordinates)
    step = np.asarray(graph.adjacency) * rng.uniform(0.1, 1, (len(places), len(places)))
    step *= (rng.random(step.shape) < 0.7) | np.roll(np.eye(len(places), dtype=bool), 1, axis=1)
    dead = step.sum(axis=1) == 0
    step[dead, np.flatnonzero(dead)] = 1
    start = rng.dirichlet(np.ones(len(places)))
    return MarkovPrior(start, step / step.sum(axis=1, keepdims=True), places, ("x", "y"), horizon)


def check(problem: ExactProblem, data: LabelledTrajectories, class_weight=None, threads: int = 1) -> None:
    """The search and the enumeration agree on the primitive, and on what it is worth."""
    weights = trajectory_weights(data.labels, class_weight)
    value, primitive = best_of_all(problem, data, weights)
    result = exact_search(problem, ExactSettings(threads=threads))
    assert abs(result.value - value) <= 1e-12
    assert str(result.primitive) == str(primitive)
    assert result.primitive == primitive
    assert result.proved
    assert not result.interrupted


searches = {
    "seed": st.integers(0, 2**32 - 1),
    "information_weight": st.sampled_from((0.0, 0.01, 0.3)),
    "nesting_cost": st.sampled_from((0.0, 0.02)),
    "class_weight": st.sampled_from(WEIGHTS),
    "ragged": st.booleans(),
}


@settings(max_examples=25)
@given(gaps=st.sampled_from(GAPS), markov=st.booleans(), **searches)
def test_gridworlds(seed, gaps, markov, information_weight, nesting_cost, class_weight, ragged):
    data = cells(seed, 2, 6, 12, ragged=ragged)
    prior: Prior = markov_prior(seed, 2, 5) if markov else grid_prior(2, 5)
    problem = problem_of(
        data, prior, SearchSpace.grid(2, 5), gaps=gaps, information_weight=information_weight,
        nesting_cost=nesting_cost, class_weight=class_weight,
    )  # fmt: skip
    check(problem, data, class_weight)


@settings(max_examples=25)
@given(width=st.integers(1, 2), mixed=st.booleans(), **searches)
def test_continuous_variables(seed, width, mixed, information_weight, nesting_cost, class_weight, ragged):
    data = numbers(seed, 5, 12, width, ragged=ragged)
    space = SearchSpace.from_data(data)
    if mixed:  # the first variable has edges, one of them a value of the data
        edges = (-1.0, float(np.nanmin(data.values[..., 0])), 2.05, 5.0)
        edges = tuple(sorted(set(edges)))
        space = SearchSpace(space.variables, (edges, *space.edges[1:]), 4, (False, True)[:width])
    prior = BoxPrior(dict.fromkeys(data.variables, (-0.5, 4.5)), 4)
    problem = problem_of(
        data, prior, space, information_weight=information_weight, nesting_cost=nesting_cost, class_weight=class_weight
    )
    check(problem, data, class_weight)


def cut_off(data: LabelledTrajectories, problem: ExactProblem, **limits) -> None:
    """A search with limits says rightly how much better the best primitive may be."""
    value, _ = best_of_all(problem, data, np.ones(len(data)))
    result = exact_search(problem, ExactSettings(**limits))
    assert result.value <= value + 1e-12
    assert result.bound >= value - 1e-12
    assert result.gap >= value - result.value - 1e-12
    assert result.proved == (result.gap <= 1e-12)


def by_chance(size: int) -> LabelledTrajectories:
    """Walks with labels that mean nothing: the search is long."""
    data = cells(5, size, 6, 40)
    labels = np.where(np.random.default_rng(1).random(40) < 0.5, 1, -1)
    return LabelledTrajectories(data.values, data.lengths, labels, data.variables, data.ids)


DATA = by_chance(3)
PROBLEM = problem_of(DATA, grid_prior(3, 5), SearchSpace.grid(3, 5), information_weight=0.3)
PLAIN = problem_of(DATA, grid_prior(3, 5), SearchSpace.grid(3, 5), information_weight=0.0)


@pytest.mark.parametrize("limits", [{"nodes": 1}, {"nodes": 40}, {"seconds": 1e-9}, {"seconds": 1e-9, "threads": 2}])
def test_a_search_that_is_stopped_bounds_what_it_missed(limits):
    cut_off(DATA, PROBLEM, **limits)
    result = exact_search(PROBLEM, ExactSettings(**limits))
    assert not result.proved
    assert not result.interrupted


class Interrupter:
    """Bounds that are interrupted at their n-th call."""

    def __init__(self, call: int) -> None:
        self.left = call
        self.bounds = Bounds.__call__

    def __call__(self, bounds: Bounds, nodes: list[Node]) -> list[float]:
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
        return self.bounds(bounds, nodes)


@pytest.mark.parametrize("problem", [PLAIN, PROBLEM])
@pytest.mark.parametrize("call", range(2, 8))
def test_an_interrupted_search_has_the_best_so_far(monkeypatch, problem, call):
    value, _ = best_of_all(problem, DATA, np.ones(len(DATA)))
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    result = exact_search(problem, ExactSettings())
    assert interrupter.left == 0
    assert result.interrupted
    assert not result.proved
    assert result.value <= value + 1e-12
    assert result.bound >= value - 1e-12  # what was taken off the heap when it happened counts too


def test_an_interruption_before_there_is_anything_goes_on(monkeypatch):
    interrupter = Interrupter(1)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    with pytest.raises(KeyboardInterrupt):
        exact_search(PROBLEM, ExactSettings())


def test_threads_do_not_matter():
    one, two = (exact_search(PROBLEM, ExactSettings(threads=threads)) for threads in (1, 2))
    assert one == two
    check(PROBLEM, DATA, threads=3)


@pytest.mark.parametrize(
    ("name", "wrong"), [("levels", 0), ("nodes", 0), ("threads", -1), ("seconds", 0.0), ("seconds", float("nan"))]
)
def test_wrong_settings(name, wrong):
    with pytest.raises(ConfigurationError, match=f"exact setting {name} is {wrong}; use [^\n]+$"):
        ExactSettings(**{name: wrong})


@pytest.mark.parametrize(
    ("gaps", "operators"),
    [((), OPERATORS), (((3, 3),), OPERATORS), (((0, 1), (4, 5)), [op for op in OPERATORS if op.nested])],
)
def test_no_room_for_a_window(gaps, operators):
    problem = problem_of(DATA, grid_prior(3, 5), SearchSpace.grid(3, 5), gaps=gaps, operators=operators)
    with pytest.raises(ConfigurationError, match=r"no gap has room for a window of two ticks; use a longer horizon$"):
        exact_search(problem, ExactSettings())


def test_a_prior_that_lacks_a_variable():
    problem = problem_of(DATA, BoxPrior({"x": (0, 3)}, 5), SearchSpace.grid(3, 5))
    with pytest.raises(UnknownVariableError, match="the prior has no variable 'y'"):
        exact_search(problem, ExactSettings())


def paths_of(prior: MarkovPrior, rng: np.random.Generator, count: int) -> np.ndarray:
    """Trajectories that a prior can give, each of its full length."""
    arrays = prior.arrays(("x", "y"))
    step = np.asarray(prior.transition) * 1.0
    states = np.empty((count, arrays.horizon + 1), dtype=int)
    for row in states:
        row[0] = rng.choice(len(step), p=np.asarray(prior.initial))
        for tick in range(1, len(row)):
            row[tick] = rng.choice(len(step), p=step[row[tick - 1]])
    return arrays.coordinates[states]


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    information_weight=st.sampled_from((0.01, 0.3, 1.0)),
    class_weight=st.sampled_from(WEIGHTS),
    supported=st.booleans(),
    continuous=st.booleans(),
    ragged=st.booleans(),
)
def test_a_prior_under_which_tight_formulas_are_impossible(
    seed, information_weight, class_weight, supported, continuous, ragged
):
    """Of a robot that never stays, the tightest primitive that classifies as well may be worth less."""
    rng = np.random.default_rng(seed)
    states = int(rng.integers(3, 6))
    step = np.zeros((states, states))
    for here in range(states):  # few steps, none of them to the state itself
        others = np.delete(np.arange(states), here)
        step[here, rng.choice(others, int(rng.integers(1, 3)), replace=False)] = rng.uniform(0.1, 1)
    start = (rng.random(states) < 0.6) + 1e-3 * (np.arange(states) == 0)
    places = rng.integers(0, 3, (states, 2)) + 0.5
    prior = MarkovPrior(start / start.sum(), step / step.sum(axis=1, keepdims=True), places, ("x", "y"), 5)
    labels = np.where(rng.random(10) < 0.5, 1, -1)
    labels[:2] = 1, -1
    # what ends early may satisfy weakly what no path does
    lengths = rng.integers(3, 7, 10) if ragged else None
    data = LabelledTrajectories.from_arrays(paths_of(prior, rng, 10), labels, ("x", "y"), lengths)
    space = SearchSpace.from_data(data) if continuous else SearchSpace.grid(3, 5)
    problem = problem_of(
        data, prior, space, information_weight=information_weight, class_weight=class_weight, supported=supported
    )
    check(problem, data, class_weight)


@settings(max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1), cap=st.integers(1, 6), information_weight=st.sampled_from((0.0, 0.02, 0.3)),
    independent=st.booleans(),
)  # fmt: skip
def test_a_bound_on_what_more_levels_could_give(seed, cap, information_weight, independent):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(10, 4, 2)).cumsum(axis=1).round()
    labels = np.where(rng.random(10) < 0.5, 1, -1)
    labels[:2] = 1, -1
    data = LabelledTrajectories.from_arrays(values, labels, ("x", "y"))
    space = SearchSpace.from_data(data)
    prior: Prior = BoxPrior(dict(zip(data.variables, space.edges, strict=True)), 3)
    if not independent:
        places = values.reshape(-1, 2)[:6]
        prior = PathPrior(np.ones((6, 6)), places, ("x", "y"), 3)
    coarse, fine = (
        problem_of(data, prior, space, information_weight=information_weight, cap=most) for most in (cap, 1000)
    )
    assert fine.levels.complete
    limit = beyond_levels(coarse, ExactSettings())
    weights = np.ones(len(data))
    assert limit >= exact_search(coarse, ExactSettings()).value - 1e-12
    if information_weight == 0 or not independent:
        assert limit >= exact_search(fine, ExactSettings()).value - 1e-12
    for _ in range(300):  # sides at the resolution that the bound is about
        sides = [np.sort(rng.choice(len(levels), 2, replace=False)) for levels in fine.levels.sides]
        (lower, upper) = (tuple(int(pair[end]) for pair in sides) for end in (0, 1))
        operator = OPERATORS[rng.integers(4)]
        times = list(every_time(fine.gaps, operator))
        choice = Choice(operator, bool(rng.integers(2)), times[rng.integers(len(times))], lower, upper)
        assert limit >= worth(fine, data, weights, choice) - 1e-12


def test_all_thresholds_leave_nothing_beyond_them():
    data = numbers(3, 5, 12, 2)
    problem = problem_of(data, grid_prior(5, 4), SearchSpace.from_data(data), information_weight=0.0)
    assert problem.levels.complete
    value = exact_search(problem, ExactSettings()).value
    assert value - 1e-12 <= beyond_levels(problem, ExactSettings())
    stopped = beyond_levels(problem, ExactSettings(seconds=1e-9))
    assert stopped >= beyond_levels(problem, ExactSettings(threads=2))
