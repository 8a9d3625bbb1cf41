"""What is foreseen in the model of the world, and what a ranking makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.library.learned import TICKS, learned
from tests.library.test_ranking import GOAL, MIRRORED, NEW, fit_of, ranking, sdnf, target
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.temporal import sdnf_table
from tickwise.library import outlook as module
from tickwise.library.entry import Entry
from tickwise.library.handover import transferred_values
from tickwise.library.outlook import RUNS, Outlook
from tickwise.library.ranking import numbers_of, rank
from tickwise.library.standing import Numbers
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.transfer.promise import greedy_success
from tickwise.transfer.rehearsal import Goal, learning_times, rehearsal

HASTY = Goal(most=100)
"""Nothing is learned so soon."""


def sources() -> list[Entry]:
    good = learned()
    return [good, replace(good, name="blank", q=np.full_like(good.q, 50.0)), learned("mirrored", MIRRORED)]


@pytest.mark.parametrize("seed", [0, 1])
def test_the_ranking_is_that_of_rehearsals_one_by_one(seed: int):
    known = replace(target(), seed=seed)
    found = rank(sources(), known)
    table = sdnf_table(found.task.formula, known.mdp, TICKS, ends="decided")
    times = {}
    for entry in sources():
        memory, q = transferred_values(entry, found.task.formula, known)
        times[entry.name] = rehearsal(Problem(known.mdp, table, memory), q, seed, RUNS, goal=GOAL)
    assert {each.entry.name: each.numbers.rehearsal for each in found.ranked} == times
    assert [each.entry.name for each in found.ranked] == sorted(times, key=lambda name: times[name])
    assert len({*times.values()}) == 3
    assert found.without == rehearsal(Problem(known.mdp, table, memory), None, seed, RUNS, goal=GOAL)
    assert found.goal == GOAL


def test_values_of_nothing_learned_are_as_good_as_none():
    first, second = ranking().ranked
    assert (first.entry.name, second.entry.name) == ("reach", "blank")
    assert first.numbers.rehearsal < second.numbers.rehearsal == ranking().without
    assert ranking().warning is None


def test_a_source_that_harms_comes_with_a_warning():
    """What learned to despise all actions has to unlearn that."""
    bad = replace(learned(), name="bad", q=np.full_like(learned().q, -10.0))
    found = rank([bad], target())
    assert found.best.numbers.rehearsal > found.without
    assert found.warning.startswith("No gain is foreseen from bad: its values need at least 20,000 episodes to ")
    # the warning is about the entry that is taken: by another number that may be one that harms
    assert rank([learned(), bad], target()).warning is None
    other = rank([learned(), bad], target(), ("distance",))
    assert (other.best.entry.name, other.warning) == ("bad", found.warning)


def test_what_is_not_learned_in_time_falls_to_the_promise():
    found = rank(sources()[::-1], replace(target(), goal=HASTY))
    assert {each.numbers.rehearsal for each in found.ranked} == {100.0}
    assert found.without == 100
    promises = [each.numbers.promise for each in found.ranked]
    assert promises == sorted(promises, reverse=True)
    assert found.best.why.startswith("Its rehearsal is that of mirrored, but with its values the greedy policy")
    assert found.warning == (
        "Nothing is foreseen of reach, and its other numbers rank it: within 100 episodes the task's formula was "
        "learned in the model of the world neither from its values nor without any."
    )


def test_what_counts_as_learned_is_what_learning_reaches_steadily():
    """Actions go wrong so often here that Q-learning reaches nine tenths of the best by luck."""
    known = replace(target(), goal=Goal(most=20_000))
    found = Outlook(known, sdnf(NEW))
    assert found.goal == Goal(level=0.8, most=20_000)
    problem = found.problem(known.memory(sdnf(NEW)))
    assert found.without == rehearsal(problem, None, 0, RUNS, goal=found.goal)
    times = learning_times(problem, None, 0, RUNS, goal=Goal(level=0.9, most=20_000))
    assert None in times
    easy = replace(known, mdp=GridWorld(5, slip=0.0).mdp())
    assert Outlook(easy, sdnf(NEW)).goal == Goal(level=0.95, most=20_000)


def test_the_form_of_learning_is_the_targets():
    form = QLearning(QSettings(initial=0.0, epsilon=0.3))
    entry, known = learned(), replace(target(), form=form)
    found = numbers_of(entry, fit_of(NEW), Outlook(known, sdnf(NEW)))
    memory, q = transferred_values(entry, sdnf(NEW), known)
    problem = Problem(known.mdp, sdnf_table(sdnf(NEW), known.mdp, TICKS, ends="decided"), memory)
    assert found.rehearsal == rehearsal(problem, q, 0, RUNS, form=form, goal=GOAL)
    assert found.rehearsal != rehearsal(problem, q, 0, RUNS, goal=GOAL)
    assert found.promise == greedy_success(problem, q)


def test_the_task_is_built_once_and_progress_is_told(monkeypatch: pytest.MonkeyPatch):
    built, told = [], []
    monkeypatch.setattr(module, "sdnf_table", lambda *args, **more: built.append(args) or sdnf_table(*args, **more))
    rank(sources()[::-1], replace(target(), goal=HASTY), report=lambda *what: told.append(what))
    assert len(built) == 1
    assert told == [
        ("fitting structure", 0, 1),
        *(("measuring entry", done, 3) for done in range(3)),
    ]


def test_a_task_that_cannot_be_acted_out_refuses_every_entry(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tickwise.envs.temporal.MOST_ENTRIES", 1)
    found = rank(sources()[:1], target())
    assert (found.ranked, found.without, found.warning) == ((), None, None)
    assert found.refused[0].why.startswith("It cannot be transferred: ")


def test_without_a_world_there_is_no_outlook():
    known = replace(target(), mdp=None)
    found = numbers_of(learned(), fit_of(NEW), Outlook(known, sdnf(NEW)))
    assert found == Numbers(None, None, 0, 0)
