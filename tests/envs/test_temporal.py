from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.test_environment import walk
from tests.envs.test_tasks import Step, follow
from tests.strategies import intervals
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import best_success_probability, optimal_value, success_probability, worst_value
from tickwise.envs.tasks import ReachStayReach
from tickwise.envs.temporal import ENDINGS, Ending, FormulaTask
from tickwise.errors import ConfigurationError, FormulaError, ParseError, UnknownVariableError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Box, Formula, Interval, Not

WORLD = GridWorld(3)
MDP = WORLD.mdp()
A, B, C = Box.of(x=(0, 1), y=(0, 2)), Box.of(x=(1, 3), y=(2, 3)), Box.of(x=(0, 2))
EVERYWHERE = Box.of(x=(0, 3))
RULE = "F[2,6] G[0,2] (0 <= x <= 1 & 0 <= y <= 2)"


@st.composite
def conjunctions(draw: st.DrawFn) -> SequentialConjunction:
    """One to three primitives with any operator, any of a few regions, or the complement of one."""
    parts: list[Primitive] = []
    for _ in range(draw(st.integers(1, 3))):
        operator = draw(st.sampled_from(Operator))
        window = draw(intervals(4))
        earliest = parts[-1].end + 1 if parts else 0
        box = draw(st.sampled_from((A, A, B, B, C, C, EVERYWHERE)))
        parts.append(
            Primitive(
                operator,
                Interval(window.start + earliest, window.end + earliest),
                draw(st.integers(1, 3)) if operator.nested else 0,
                draw(st.sampled_from((box, Not(box)))),
            )
        )
    return SequentialConjunction(tuple(parts))


@st.composite
def formulas(draw: st.DrawFn) -> Formula:
    """One to three disjuncts, or the negation of a conjunction or a disjunction, normal by duality."""
    kind = draw(st.sampled_from(("plain", "plain", "negated conjunction", "negated disjunction")))
    if kind == "plain":
        disjuncts = draw(st.lists(conjunctions(), min_size=1, max_size=3))
        return SDNF(tuple(disjuncts)).formula
    conjunction = draw(conjunctions())
    if kind == "negated conjunction":
        return Not(conjunction.formula)
    return Not(SDNF(tuple(SequentialConjunction((primitive,)) for primitive in conjunction.primitives)).formula)


@st.composite
def episodes(draw: st.DrawFn) -> tuple[FormulaTask, list[int]]:
    """A task, and states in runs, so that stays and gaps of every length are common."""
    formula = draw(formulas())
    deadline = max(1, formula.end_effect + draw(st.integers(0, 2)))
    pool = draw(st.lists(st.integers(0, MDP.n_states - 1), min_size=1, max_size=3))
    runs = draw(st.lists(st.tuples(st.sampled_from(pool), st.integers(1, 5)), min_size=1, max_size=20))
    states = [state for state, length in runs for _ in range(length)]
    states += [states[-1]] * deadline
    return FormulaTask(str(formula), deadline, 7.0, -3.0, draw(st.sampled_from(list(ENDINGS)))), states[: deadline + 1]


def twin(task: FormulaTask, states: list[int]) -> tuple[list[Step], bool]:
    """Rewards, ends and success from the three-valued semantics of every prefix."""
    formula = parse(task.formula)
    steps: list[Step] = []
    for tick in range(1, task.deadline + 1):
        verdict = formula.verdict(MDP.coordinates[states[: tick + 1]], variables=MDP.variables)
        gained = task.reward if verdict > 0 else task.penalty
        if tick == task.deadline or verdict in ENDINGS[task.ends]:
            return [*steps, (gained, True)], verdict > 0
        steps.append((0.0, False))
    raise AssertionError("an episode has an end")


@given(episodes())
@settings(max_examples=400, deadline=None)
def test_the_table_agrees_with_the_three_valued_semantics(episode: tuple[FormulaTask, list[int]]):
    task, states = episode
    assert follow(task.table(MDP), states) == twin(task, states)


@given(formulas())
@settings(max_examples=60, deadline=None)
def test_an_early_end_changes_no_chance_and_no_undiscounted_value(formula: Formula):
    task = FormulaTask(str(formula), max(1, formula.end_effect))
    late, soon = task.table(MDP), dataclasses.replace(task, ends="decided").table(MDP)
    for measure in (success_probability, best_success_probability, optimal_value, worst_value):
        assert measure(MDP, soon) == pytest.approx(measure(MDP, late), abs=1e-4)


@given(formulas())
@settings(max_examples=60, deadline=None)
def test_a_task_state_is_reached_and_stays_once_decided(formula: Formula):
    table = FormulaTask(str(formula), max(1, formula.end_effect), ends="decided").table(MDP)
    reached = {0}
    frontier = [0]
    while frontier:
        fresh = set(table.delta[frontier].ravel().tolist()) - reached
        reached |= fresh
        frontier = sorted(fresh)
    assert reached == set(range(table.n_states))
    assert table.delta.shape[1] == len(set(table.letter.tolist()))
    for state in np.flatnonzero(table.terminated):
        assert (table.delta[state] == state).all()
    assert table.stages.count("satisfied") <= 1
    assert table.stages.count("violated") <= 1


def test_many_predicates_need_few_letters():
    """Eight predicates would make 256 letters; a world of nine cells has nine at most."""
    parts = [f"{kind}[{10 * step},{10 * step + 4}] ({low} <= x <= {low + 1} & {low} <= y <= 3)"
             for kind in "FG" for step, low in ((0, 0), (1, 1), (2, 2), (3, 0))]  # fmt: skip
    task = FormulaTask(f"{' & '.join(parts[:4])} | {' & '.join(parts[4:])}", 40)
    assert task.sdnf.size == 8
    assert task.table(MDP).delta.shape[1] <= 9


def test_windows_only_make_the_task_of_a_case_study_harder():
    """What satisfies F[0,6] G[0,2] first & F[9,12] second stays in the first region, and later is in the second."""
    mdp = GridWorld(4, slip=0.0, turn_failure=0.0).mdp()
    plain = ReachStayReach(Box.of(x=(1, 2), y=(0, 1)), 2, Box.of(x=(3, 4), y=(0, 1)), 12)
    timed = FormulaTask("F[0,6] G[0,2] (1 <= x <= 2 & 0 <= y <= 1) & F[9,12] (3 <= x <= 4 & 0 <= y <= 1)", 12)
    assert 0 < success_probability(mdp, timed.table(mdp)) < success_probability(mdp, plain.table(mdp))


def test_a_table_by_hand():
    """F[1,2] A, one letter for outside and one for in A: tick 0 is not looked at."""
    table = FormulaTask("F[1,2] (0 <= x <= 1 & 0 <= y <= 2)", 4, 5.0, -1.0).table(MDP)
    # start; after tick 0; after tick 1 outside; then done or failed
    start, waiting = 0, table.delta[0, 0]
    assert table.delta[start].tolist() == [waiting, waiting]
    after, done = table.delta[waiting]
    failed = table.delta[after, 0]
    assert table.delta[after].tolist() == [failed, done]
    assert len({start, waiting, after, done, failed}) == table.n_states == 5
    assert table.final_reward[[done, failed]].tolist() == [5, -1]
    assert not table.reward.any()
    assert not table.terminated.any()
    assert np.flatnonzero(table.success).tolist() == [done]
    assert (table.horizon, table.stages[done], table.stages[failed]) == (4, "satisfied", "violated")
    assert table.stages[waiting] == "within ticks 1 to 2, reach A"


def test_what_tick_0_decides_is_paid_at_tick_1():
    task = FormulaTask("F[0,0] (0 <= x <= 1 & 0 <= y <= 2)", 9, 5.0, -1.0, ends="decided")
    inside, outside = WORLD.state(0, 0, 0), WORLD.state(2, 2, 0)
    assert follow(task.table(MDP), [inside, outside, outside]) == ([(5.0, True)], True)
    assert follow(task.table(MDP), [outside, inside, inside]) == ([(-1.0, True)], False)


def test_a_complement_is_followed():
    """G[1,3] outside A, and F[1,3] A, are each other's negation, at every prefix."""
    avoid = FormulaTask("G[1,3] !(0 <= x <= 1 & 0 <= y <= 2)", 3, 1.0, -1.0, ends="decided")
    visit = FormulaTask("F[1,3] (0 <= x <= 1 & 0 <= y <= 2)", 3, -1.0, 1.0, ends="decided")
    inside, outside = WORLD.state(0, 0, 0), WORLD.state(2, 2, 0)
    for states in ([inside, outside, inside, outside], [inside, outside, outside, outside]):
        steps, success = follow(avoid.table(MDP), states)
        assert follow(visit.table(MDP), states) == (steps, not success)


def test_stages_count_stays_and_gaps():
    stay = FormulaTask(f"{RULE} & G[9,12] F[0,3] (1 <= x <= 3 & 2 <= y <= 3)", 20).table(MDP)
    first = "step 1 of 2: within ticks 2 to 6, reach A and stay for 2 more ticks"
    second = "step 2 of 2: at every tick from 9 to 12, return to B within 3 ticks"
    assert {stage for stage in stay.stages if stage.startswith("step 1")} == {
        first, f"{first} (1 of 3 ticks)", f"{first} (2 of 3 ticks)",
    }  # fmt: skip
    assert {stage for stage in stay.stages if stage.startswith("step 2")} == {
        second, *(f"{second} (ticks left: {left})" for left in (1, 2, 3)),
    }  # fmt: skip
    both = FormulaTask(f"{RULE} | F[1,3] !(0 <= x <= 2)", 20).table(MDP)
    assert both.stages[0] == (
        "either within ticks 2 to 6, reach A and stay for 2 more ticks, or within ticks 1 to 3, leave B"
    )


def test_landmarks_are_each_region_once():
    text = f"{RULE} & F[12,14] (x >= 2) | G[1,3] !(0 <= x <= 1 & 0 <= y <= 2) & F[9,9] (y <= 1) & F[12,14] (y >= 2)"
    marks = FormulaTask(text, 20).landmarks
    assert [(mark.label, mark.colour) for mark in marks] == [
        ("A", "green"), ("B", "yellow"), ("C", "blue"), ("D", "green"),
    ]  # fmt: skip
    assert marks[0].box == A


def test_labels_go_beyond_the_alphabet():
    text = " & ".join(f"F[{tick},{tick}] (x >= {tick / 20})" for tick in range(28))
    assert [mark.label for mark in FormulaTask(text, 40).landmarks][-3:] == ["Z", "A1", "B1"]


@pytest.mark.parametrize("ends", list(ENDINGS))
@pytest.mark.parametrize(
    "formula",
    [RULE, f"{RULE} | G[3,7] F[0,2] !(0 <= x <= 2) & F[10,11] (1 <= x <= 3 & 2 <= y <= 3)"],
    ids=["one", "two"],
)
def test_episodes_of_the_environment_equal_a_walk_on_the_arrays(formula: str, ends: Ending):
    spec = EnvironmentSpec("Timed", WORLD, FormulaTask(formula, 13, ends=ends))
    mdp, table = spec.mdp(), spec.task_table()
    env = GridWorldEnv(spec)
    rng, chooser = np.random.default_rng(12), np.random.default_rng(34)
    lengths = set()
    for episode in range(100):
        actions = chooser.choice(3, size=13, p=(0.6, 0.2, 0.2))
        ticks = list(walk(mdp, table, iter(actions), rng))
        lengths.add(len(ticks))
        information = env.reset(seed=12 if episode == 0 else None)[1]
        assert information["state"] == ticks[0][0]
        states = [state for state, _, _ in ticks]
        for (_, following), action in zip(pairwise(ticks), actions, strict=False):
            _, reward, terminated, truncated, information = env.step(action)
            assert (information["state"], reward, terminated, truncated) == (*following, False)
        verdict = parse(formula).verdict(mdp.coordinates[states], variables=mdp.variables)
        assert information["is_success"] == (verdict > 0)
    assert (len(lengths) > 1) == (ends != "deadline")


@pytest.mark.parametrize("render_mode", [None, "rgb_array", "ansi"])
def test_gymnasiums_checker_is_content(render_mode: str | None):
    env = GridWorldEnv(EnvironmentSpec("Timed", WORLD, FormulaTask(RULE, 9, ends="decided")), render_mode=render_mode)
    check_env(env, skip_render_check=True)
    if render_mode:
        env.reset(seed=0)
        assert env.render() is not None


@pytest.mark.parametrize(
    ("formula", "deadline", "error", "message"),
    [
        ("F[1,", 9, ParseError, "expected"),
        ("x >= 1", 9, FormulaError, "outside every temporal operator"),
        ("F[0,3] (x >= 1) & F[2,5] (y >= 1)", 9, FormulaError, "not sequential"),
        ("F[0,9] G[0,3] (x >= 1)", 11, ConfigurationError, "effect until tick 12, past the deadline 11; use .* 12"),
        ("F[0,0] (x >= 1)", 0, ConfigurationError, "deadline is 0; use a whole number of ticks, 1 or more"),
    ],
)
def test_a_task_that_cannot_be_is_refused(formula: str, deadline: int, error: type[Exception], message: str):
    with pytest.raises(error, match=message):
        FormulaTask(formula, deadline)


def test_a_region_that_does_not_fit_the_world_is_refused():
    with pytest.raises(ConfigurationError, match="contains no cell of the world"):
        FormulaTask("F[0,3] (x >= 4)", 5).table(MDP)
    with pytest.raises(UnknownVariableError, match="'z'"):
        FormulaTask("F[0,3] (z >= 4)", 5).table(MDP)


def test_a_table_that_would_be_too_large_is_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tickwise.envs.temporal.MOST_ENTRIES", 40 * MDP.n_states)
    with pytest.raises(ConfigurationError, match="more than 40 states for a disjunction; use fewer disjuncts"):
        FormulaTask(f"{RULE} | {RULE.replace('A', 'B')} | G[0,8] F[0,3] (x >= 2)", 20).table(MDP)
