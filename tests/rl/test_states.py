from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.twins import random_mdp
from tests.rl.twins import extended_problems, nearest_disjunct
from tickwise.automata.build import timed_automata
from tickwise.automata.run import EdgeStep, letters_of, run
from tickwise.automata.ticks import TickTable
from tickwise.envs.catalog import (
    CASE_STUDY_1_SOURCE,
    CASE_STUDY_1_TARGET,
    CASE_STUDY_2_TARGET,
    EnvironmentSpec,
)
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP, cumulative, draw
from tickwise.errors import ConfigurationError, DataError
from tickwise.logic.parse import parse
from tickwise.logic.semantics import verdict
from tickwise.rl.qlearning import Problem, QSettings, collect
from tickwise.rl.states import (
    DISJUNCT_CHOICES,
    Memory,
    automaton_memory,
    disjunct_choice,
    first_disjunct,
    nearest_centroid,
    nearest_region,
    state_letters,
    tau_memory,
    tick_memory,
)

SOURCE_1 = "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)"
TARGET_1 = "F[5,18] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[24,39] (4 <= x <= 7 & 1 <= y <= 2)"
TARGET_2 = "G[0,40] F[0,10] (2 <= x <= 3 & 3 <= y <= 4) | G[0,40] F[0,10] (4 <= x <= 5 & 3 <= y <= 4)"


def tables_of(text: str, horizon: int = 50, *, reduce: bool = True) -> tuple[TickTable, ...]:
    return tuple(automaton.compile(horizon, reduce=reduce) for automaton in timed_automata(parse(text)))


def walk(mdp: TabularMDP, memory: Memory, rng: np.random.Generator, ticks: int) -> tuple[list[int], list[int]]:
    """The states and memory states of a random walk; an action is often repeated, so that it gets about."""
    thresholds = cumulative(mdp.probability)
    states = [draw(cumulative(mdp.initial), rng.random())]
    remembered = [int(memory.start[states[0]])]
    action = 0
    for _ in range(ticks):
        action = action if rng.random() < 0.4 else int(rng.integers(mdp.n_actions))
        outcome = draw(thresholds[states[-1], action], rng.random())
        remembered.append(int(memory.delta[remembered[-1], memory.letter[states[-1], action, outcome]]))
        states.append(int(mdp.successor[states[-1], action, outcome]))
    return states, remembered


# τ-states and ticks


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 3), st.integers(1, 3), st.integers(1, 4))
def test_tau_states_are_the_last_tau_states(seed: int, states: int, actions: int, outcomes: int, tau: int):
    """Every history, with None before tick 0, has one memory state, and no two share it in one state."""
    mdp = random_mdp(np.random.default_rng(seed), states, actions, outcomes)
    memory = tau_memory(mdp, tau)
    remembered: dict[tuple[int | None, ...], int] = {}
    waiting: list[tuple[tuple[int | None, ...], int]] = [
        ((None,) * (tau - 1) + (s,), int(memory.start[s])) for s in range(states)
    ]
    while waiting:
        history, u = waiting.pop()
        if history in remembered:
            assert remembered[history] == u
            continue
        remembered[history] = u
        s = history[-1]
        for action, outcome in np.argwhere(mdp.probability[s] > 0):
            after = int(mdp.successor[s, action, outcome])
            waiting.append(((*history, after)[1:], int(memory.delta[u, memory.letter[s, action, outcome]])))
    pairs = {(history[-1], u) for history, u in remembered.items()}
    assert len(pairs) == len(remembered)


@pytest.mark.parametrize("spec", [CASE_STUDY_1_SOURCE, CASE_STUDY_2_TARGET], ids=lambda spec: spec.name)
def test_tau_states_of_the_case_studies(spec: EnvironmentSpec):
    mdp, tau, rng = spec.mdp(), 5, np.random.default_rng(0)
    memory = tau_memory(mdp, tau)
    of_history: dict[tuple[int, ...], tuple[int, int]] = {}
    histories: dict[tuple[int, int], tuple[int, ...]] = {}
    for _ in range(300):
        states, remembered = walk(mdp, memory, rng, spec.task.deadline)
        for t, pair in enumerate(zip(states, remembered, strict=True)):
            history = tuple(states[max(0, t - tau + 1) : t + 1])
            assert of_history.setdefault(history, pair) == pair
            assert histories.setdefault(pair, history) == history


def test_tau_memory_has_a_digit_for_each_state_before():
    # in a world of one cell a state has its two neighbours in turning and itself before it
    memory = tau_memory(GridWorld(1).mdp(), 3)
    assert (memory.n_states, memory.delta.shape) == ((3 + 1) ** 2, (16, 4))
    assert memory.delta[5].tolist() == [4, 5, 6, 7]  # 5 = (1, 1) in base 4: the older digit goes, one comes
    assert tau_memory(GridWorld(1).mdp(), 1).n_states == 1


def test_tau_of_zero_is_refused():
    with pytest.raises(ConfigurationError, match="horizon of τ-states is 0; use 1 or more"):
        tau_memory(GridWorld(1).mdp(), 0)


def test_tick_memory_counts_ticks_up_to_its_horizon():
    mdp = random_mdp(np.random.default_rng(0), 4, 2, 3)
    memory = tick_memory(mdp, 3)
    assert memory.n_states == 4
    _, remembered = walk(mdp, memory, np.random.default_rng(1), 6)
    assert remembered == [0, 1, 2, 3, 3, 3, 3]


def test_a_tick_memory_counts_something():
    with pytest.raises(ConfigurationError, match="horizon of counted ticks is 0; use 1 or more"):
        tick_memory(GridWorld(1).mdp(), 0)


# extended states


@pytest.mark.parametrize(
    ("spec", "text"),
    [(CASE_STUDY_1_SOURCE, SOURCE_1), (CASE_STUDY_1_TARGET, TARGET_1), (CASE_STUDY_2_TARGET, TARGET_2)],
    ids=["1 source", "1 target", "2 target, two disjuncts"],
)
@pytest.mark.parametrize("reduce", [True, False], ids=["reduced", "full"])
def test_extended_states_are_the_run_of_the_automaton(spec: EnvironmentSpec, text: str, reduce: bool):
    mdp, rng = spec.mdp(), np.random.default_rng(7)
    tables = tables_of(text, reduce=reduce)
    memory = automaton_memory(mdp, tables)
    choice = nearest_centroid(mdp, tables)
    seen = set()
    for _ in range(60):
        states, remembered = walk(mdp, memory, rng, spec.task.deadline)
        index = choice[states[0]]
        table, offset = tables[index], memory.offsets[index]
        X = mdp.coordinates[states]
        edges = [step for step in run(table.automaton, X, variables=("x", "y")).steps if isinstance(step, EdgeStep)]
        for t, (u, edge) in enumerate(zip(remembered, edges, strict=True)):
            local = u - offset
            assert 0 < local < len(table)
            assert table.location[local] == edge.target
            clocks = table.automaton.active[edge.target] if reduce else range(len(table.automaton.clocks))
            assert [table.clocks[local, c] for c in clocks] == [edge.after[c] for c in clocks]
            formula = table.automaton.conjunction.formula
            seen.add(int(table.verdict[local]))
            assert table.verdict[local] == verdict(formula, X[: t + 1], variables=("x", "y"))
    assert len(seen) > 1, "the walks never come to a verdict"


@settings(max_examples=150, deadline=None)
@given(extended_problems(), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.5]))
def test_learning_takes_place_where_the_chosen_automaton_runs(problem: Problem, seed: int, epsilon: float):
    """In every episode, also one that ends early, the entries that change are those of the run at every step.

    With α = 1 and γ = 0 an entry becomes the reward, which is never the initial value.
    """
    chosen = QSettings(alpha=1.0, gamma=0.0, epsilon=epsilon, initial=1e6)
    rng, memory = np.random.default_rng(seed), problem.memory
    for _ in range(5):
        q = problem.initial_q(chosen)
        _, paths = collect(problem, q, chosen, rng, 1)
        path = paths[0, : np.count_nonzero(paths[0] >= 0)]
        assert (paths[0, len(path) :] == -1).all()
        i = nearest_disjunct(problem, path[0])
        table = memory.tables[i]
        X = problem.mdp.coordinates[path]
        states = table.run(letters_of(table.automaton, X, variables=problem.mdp.variables))
        assert table.verdict[states[-1]] == verdict(table.automaton.conjunction.formula, X, variables=("x", "y"))
        changed = {(int(u), int(s)) for u, s, _ in np.argwhere(q != 1e6)}
        # nothing is learned in the state that an episode ends in
        assert changed == set(zip((memory.offsets[i] + states[:-1]).tolist(), path[:-1].tolist(), strict=True))


def test_many_visits_reach_both_verdicts():
    """A walk within and about the region: the memory tells satisfied, violated and open apart."""
    mdp = GridWorld(3).mdp()
    tables = tables_of("F[0,4] G[0,1] (0 <= x <= 1 & 0 <= y <= 1) & F[6,9] (1 <= x <= 2)")
    memory, rng = automaton_memory(mdp, tables), np.random.default_rng(3)
    verdicts = set()
    for _ in range(400):
        states, remembered = walk(mdp, memory, rng, 9)
        last = tables[0].verdict[remembered[-1]]
        formula = tables[0].automaton.conjunction.formula
        assert last == verdict(formula, mdp.coordinates[states], variables=("x", "y"))
        verdicts.add(int(last))
    assert verdicts == {1, -1}


def test_memory_lays_the_tables_end_to_end():
    mdp, tables = CASE_STUDY_2_TARGET.mdp(), tables_of(TARGET_2)
    memory = automaton_memory(mdp, tables)
    assert memory.tables == tables
    assert memory.offsets == (0, len(tables[0]))
    assert memory.n_states == len(tables[0]) + len(tables[1])
    # three letters suffice for two regions that do not overlap
    assert memory.delta.shape[1] == 3
    assert memory.delta[: len(tables[0])].max() < len(tables[0]) <= memory.delta[len(tables[0]) :].min()


def test_nearest_centroid_by_hand():
    mdp = CASE_STUDY_2_TARGET.mdp()  # the centroids are (2.5, 3.5) and (4.5, 3.5)
    nearest = nearest_centroid(mdp, tables_of(TARGET_2))
    column = mdp.coordinates[:, 0]
    np.testing.assert_array_equal(nearest, np.where(column > 3.5, 1, 0))  # the tie at 3.5 goes to the first


def test_nearest_centroid_goes_by_the_first_primitive_within_the_limits():
    mdp = GridWorld(4).mdp()
    # first: x <= 2, y free, so the centroid is (1, 2); second: [3,4]×[0,4] with centroid (3.5, 2)
    text = "(F[0,3] (x <= 2) & F[5,6] (x >= 3)) | (F[0,3] (3 <= x <= 4) & F[5,6] (x <= 1 & y <= 1))"
    nearest = nearest_centroid(mdp, tables_of(text))
    expected = [0, 0, 1, 1]  # the centres 0.5, 1.5 | 2.5, 3.5 about the middle 2.25
    np.testing.assert_array_equal(nearest, np.repeat(expected, 16))


def test_another_choice_of_the_disjunct():
    mdp, tables = CASE_STUDY_2_TARGET.mdp(), tables_of(TARGET_2)
    memory = automaton_memory(mdp, tables, lambda mdp, _: np.full(mdp.n_states, 1, dtype=np.int32))
    assert (memory.start >= memory.offsets[1]).all()


def test_the_nearest_region_and_its_ties():
    mdp = GridWorld(6).mdp()
    # a wide region from x = 0 to 4 and a narrow one from 5 to 6: at x = 3.5 the wide one is here, its centroid farther
    tables = tables_of("(F[0,3] (0 <= x <= 4)) | (F[0,3] (5 <= x <= 6))")
    column = mdp.coordinates[:, 0]
    np.testing.assert_array_equal(nearest_centroid(mdp, tables)[column == 3.5][0], 0)  # 1.5 against 2
    np.testing.assert_array_equal(nearest_region(mdp, tables), np.where(column > 4, 1, 0))  # a tie at 4.5
    assert nearest_centroid(mdp, tables)[column == 4.5][0] == 1
    wide = tables_of("(F[0,3] (0 <= x <= 5)) | (F[0,3] (4 <= x <= 6))")  # both regions hold 4.5: the nearer centroid
    assert nearest_region(mdp, wide)[column == 4.5][0] == 1
    assert nearest_region(mdp, wide)[column == 3.5][0] == 0
    assert not first_disjunct(mdp, tables).any()


def test_choices_go_by_name():
    assert disjunct_choice("nearest_centroid") is nearest_centroid
    assert list(DISJUNCT_CHOICES) == ["nearest_centroid", "nearest_region", "first_disjunct"]
    with pytest.raises(ConfigurationError, match="no choice of the disjunct 'best'; use nearest_centroid, "):
        disjunct_choice("best")


def test_state_letters_by_hand():
    mdp = GridWorld(3).mdp()
    (table,) = tables_of("F[0,1] (x <= 1) & F[3,4] (y <= 1)")
    letters = state_letters(mdp, table).reshape(3, 3, 4)
    assert (letters[0, 0], letters[0, 2], letters[1, 0], letters[2, 2]) == pytest.approx((3, 1, 2, 0))


def test_extended_states_need_a_table():
    with pytest.raises(ConfigurationError, match="give the formula's tables"):
        automaton_memory(GridWorld(2).mdp(), ())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": [2]}, "names a state beyond its 2"),
        ({"start": [-1]}, "names a state beyond its 2"),
        ({"delta": [[0], [2]]}, "names a state beyond its 2"),
        ({"letter": [[[1]]]}, "letter is beyond its 1 letters"),
    ],
)
def test_a_memory_is_checked(changes: dict[str, list[object]], message: str):
    fields = {"start": [0], "delta": [[0], [1]], "letter": [[[0]]]}
    with pytest.raises(DataError, match=message):
        Memory(**{name: np.array(array) for name, array in (fields | changes).items()})


def test_a_memory_is_a_copy_that_cannot_be_written():
    delta = np.zeros((1, 1), dtype=np.int32)
    memory = Memory(np.zeros(1), delta, np.zeros((1, 1, 1)))
    delta[0, 0] = 5
    assert memory.delta[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        memory.delta[0, 0] = 0
