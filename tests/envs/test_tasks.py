from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tasks import ReachStayReach, Recurrence, TaskMonitor, TaskTable
from tickwise.errors import ConfigurationError, DataError
from tickwise.logic.syntax import Box

WORLD = GridWorld(4)
MDP = WORLD.mdp()
A = Box.of(x=(0, 1), y=(0, 2))
B = Box.of(x=(2, 4), y=(3, 4))
C = Box.of(x=(0, 3), y=(0, 1))  # overlaps A


def member(box: Box, state: int) -> bool:
    i, j, _ = WORLD.place(state)
    centre = {"x": i + 0.5, "y": j + 0.5}
    return all(bound.lower <= centre[bound.variable] <= bound.upper for bound in box.bounds)


Step = tuple[float, bool]


def reach_stay_reach_twin(task: ReachStayReach, states: list[int]) -> tuple[list[Step], bool]:
    """Rewards, ends and success from the definition, on the whole trajectory."""
    steps: list[Step] = [(0.0, False)] * (task.deadline - 1)
    done = any(
        all(member(task.first, states[tick]) for tick in range(t, t + task.stay + 1))
        and any(member(task.second, states[u]) for u in range(t + task.stay + 1, task.deadline + 1))
        for t in range(task.deadline - task.stay + 1)
    )
    return [*steps, (task.reward if done else task.penalty, True)], done


def recurrence_twin(task: Recurrence, states: list[int]) -> tuple[list[Step], bool]:
    def broken_at(now: int) -> bool:
        return all(
            any(
                not any(member(region, states[tick]) for tick in range(t, t + task.period + 1))
                for t in range(now - task.period + 1)
            )
            for region in task.regions
        )

    steps: list[Step] = []
    for now in range(1, task.deadline + 1):
        if broken_at(now):
            return [*steps, (task.penalty, True)], False
        green = any(member(box, states[now]) for box in task.greens)
        steps.append((task.green_reward if green else 0.0, now == task.deadline))
    return steps, True


def follow(table: TaskTable, states: list[int]) -> tuple[list[Step], bool]:
    monitor = TaskMonitor(table)
    monitor.start(states[0])
    steps: list[Step] = []
    for state in states[1:]:
        steps.append(monitor.advance(state))
        assert monitor.tick == len(steps)
        if steps[-1][1]:
            break
    return steps, monitor.success


BOXES = st.sampled_from([A, B, C, Box.of(x=(0, 4)), Box.of(x=(3, 4), y=(0, 1))])


@st.composite
def trajectories(draw: st.DrawFn, deadline: int) -> list[int]:
    """States of few kinds, in runs, so that stays and gaps of every length are common."""
    pool = draw(st.lists(st.integers(0, MDP.n_states - 1), min_size=1, max_size=3))
    runs = draw(st.lists(st.tuples(st.sampled_from(pool), st.integers(1, 5)), min_size=deadline + 1, max_size=30))
    return [state for state, length in runs for _ in range(length)][: deadline + 1]


@st.composite
def reach_stay_reach_episodes(draw: st.DrawFn) -> tuple[ReachStayReach, list[int]]:
    stay = draw(st.integers(0, 4))
    deadline = draw(st.integers(stay + 1, 14))
    task = ReachStayReach(draw(BOXES), stay, draw(BOXES), deadline, reward=7.0, penalty=-3.0)
    return task, draw(trajectories(deadline))


@st.composite
def recurrence_episodes(draw: st.DrawFn) -> tuple[Recurrence, list[int]]:
    deadline = draw(st.integers(1, 14))
    task = Recurrence(
        regions=tuple(draw(st.lists(BOXES, min_size=1, max_size=3))),
        period=draw(st.integers(1, 5)),
        greens=tuple(draw(st.lists(BOXES, max_size=2))),
        deadline=deadline,
        green_reward=2.0,
        penalty=-9.0,
    )
    return task, draw(trajectories(deadline))


@given(episode=reach_stay_reach_episodes())
@settings(max_examples=500, deadline=None)
def test_reach_stay_reach_agrees_with_its_definition(episode: tuple[ReachStayReach, list[int]]):
    task, states = episode
    assert follow(task.table(MDP), states) == reach_stay_reach_twin(task, states)


@given(episode=recurrence_episodes())
@settings(max_examples=500, deadline=None)
def test_recurrence_agrees_with_its_definition(episode: tuple[Recurrence, list[int]]):
    task, states = episode
    assert follow(task.table(MDP), states) == recurrence_twin(task, states)


def test_reach_stay_reach_table_by_hand():
    table = ReachStayReach(A, 1, B, deadline=5).table(MDP)
    # task states: 0 and 1 ticks of the stay, stayed, done; letters: none, first, second, both
    assert table.delta.tolist() == [[0, 1, 0, 1], [0, 2, 0, 2], [2, 2, 3, 3], [3, 3, 3, 3]]
    assert table.final_reward.tolist() == [-10, -10, -10, 100]
    assert table.success.tolist() == [False, False, False, True]
    assert not table.reward.any()
    assert not table.terminated.any()
    assert table.horizon == 5
    assert table.stages == (
        "stay in G: 0 of 2 ticks",
        "stay in G: 1 of 2 ticks",
        "stayed in G; now reach Y",
        "done",
    )
    inside_a, inside_b, nowhere = WORLD.state(0, 1, 2), WORLD.state(3, 3, 0), WORLD.state(1, 2, 1)
    assert table.letter[[inside_a, inside_b, nowhere]].tolist() == [1, 2, 0]


def test_the_second_region_counts_only_after_the_last_tick_of_the_stay():
    both = WORLD.state(0, 0, 0)  # in A and in C
    table = ReachStayReach(A, 1, C, deadline=3).table(MDP)
    assert follow(table, [both, both, both, both]) == ([(0.0, False), (0.0, False), (100.0, True)], True)
    elsewhere = WORLD.state(3, 3, 0)
    assert follow(table, [elsewhere, elsewhere, both, both])[1] is False


def test_recurrence_table_of_one_region_by_hand():
    table = Recurrence((A,), 2, (B,), deadline=9).table(MDP)
    # task states: 0, 1, 2 ticks without a visit, broken; letters: away, visit
    assert table.delta.tolist() == [[1, 0], [2, 0], [3, 0], [3, 3]]
    assert table.terminated.tolist() == [False, False, False, True]
    assert table.success.tolist() == [True, True, True, False]
    green, plain = WORLD.state(3, 3, 1), WORLD.state(2, 2, 0)
    assert table.reward[:, green].tolist() == [100, 100, 100, -800]
    assert table.reward[:, plain].tolist() == [0, 0, 0, -800]
    assert not table.final_reward.any()
    assert table.stages[2:] == ("B 2 of 2 ticks away", "the rule is broken")


def test_recurrence_wants_the_same_region_every_time():
    a, b, away = WORLD.state(0, 0, 0), WORLD.state(3, 3, 0), WORLD.state(1, 2, 0)
    table = Recurrence((A, B), 1, (), deadline=20).table(MDP)
    # B is lost at tick 1; then a gap of two ticks without A breaks the rule, though B is visited in it
    assert follow(table, [a, a, away, a, b, b]) == ([(0.0, False)] * 4 + [(-800.0, True)], False)


def test_a_green_region_gives_nothing_at_the_first_tick():
    green = WORLD.state(3, 3, 0)
    table = Recurrence((B,), 3, (B,), deadline=2).table(MDP)
    assert follow(table, [green, green, green]) == ([(100.0, False), (100.0, True)], True)


def test_arrays_have_fixed_types_and_cannot_be_written():
    table = Recurrence((A, B), 3, (C,), deadline=9).table(MDP)
    types = [array.dtype for array in (table.delta, table.letter, table.reward, table.final_reward)]
    assert types == [np.int32, np.int32, np.float32, np.float32]
    assert table.terminated.dtype == table.success.dtype == np.bool_
    assert table.delta.shape == (table.n_states, 4)
    assert table.reward.shape == (table.n_states, MDP.n_states)
    with pytest.raises(ValueError, match="read-only"):
        table.reward[0, 0] = 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"delta": np.zeros((4, 0))}, "delta has shape"),
        ({"reward": np.zeros((4, 1))}, "reward has shape"),
        ({"success": np.zeros(3)}, "success has shape"),
        ({"stages": ("start",)}, "1 stages for 4 task states"),
        ({"delta": np.full((4, 4), 4)}, r"delta has a number outside 0\.\.3"),
        ({"letter": np.full(MDP.n_states, 4)}, r"letter has a number outside 0\.\.3"),
        ({"horizon": 0}, "horizon is 0"),
    ],
)
def test_malformed_tables_are_refused(changes: dict[str, Any], message: str):
    table = ReachStayReach(A, 1, B, deadline=5).table(MDP)
    with pytest.raises((DataError, ConfigurationError), match=message):
        dataclasses.replace(table, **changes)


def test_impossible_numbers_of_ticks_are_refused():
    with pytest.raises(ConfigurationError, match="deadline is 4; use a whole number of ticks, 5 or more"):
        ReachStayReach(A, 4, B, deadline=4)
    with pytest.raises(ConfigurationError, match="stay is -1"):
        ReachStayReach(A, -1, B, deadline=4)
    with pytest.raises(ConfigurationError, match="period is 0"):
        Recurrence((A,), 0, (), deadline=4)
    with pytest.raises(ConfigurationError, match="no region"):
        Recurrence((), 2, (), deadline=4)


def test_a_region_outside_the_world_is_refused():
    with pytest.raises(ConfigurationError, match="contains no cell of the world"):
        ReachStayReach(A, 1, Box.of(x=(4, 5), y=(0, 1)), deadline=5).table(MDP)


def test_landmarks():
    assert [mark.label for mark in ReachStayReach(A, 1, B, deadline=5).landmarks] == ["G", "Y"]
    assert [mark.label for mark in Recurrence((A,), 2, (B, C), deadline=5).landmarks] == ["G", "G", "B"]
    marks = Recurrence((A, B), 2, (C,), deadline=5).landmarks
    assert [(mark.label, mark.colour) for mark in marks] == [("G", "green"), ("B1", "blue"), ("B2", "blue")]
