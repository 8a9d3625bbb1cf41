from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.library.learned import REACH, SETTINGS, STAY, TICKS, learned, problem_of, walks
from tickwise.envs.gridworld import GridWorld
from tickwise.errors import ConfigurationError, DataError, NotTransferableError
from tickwise.inference.fit import Fit
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings
from tickwise.library.entry import Entry
from tickwise.library.handover import transfer, transferred_values
from tickwise.library.outlook import Outlook
from tickwise.library.ranking import Ranking, distance, numbers_of, rank
from tickwise.library.target import Target, cells_space
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.structure import structurally_transferable
from tickwise.rl.qlearning import Problem, evaluate, learn
from tickwise.rl.states import automaton_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.promise import greedy_success, promise
from tickwise.transfer.qtransfer import transfer_q
from tickwise.transfer.rehearsal import Goal

NEW = "F[0,5] (1 <= x <= 2 & 0 <= y <= 2) & F[7,12] (4 <= x <= 5 & 2 <= y <= 4)"
"""The new task, in a world of 5 × 5 cells: the learned one, a cell further on."""

MIRRORED = "F[0,5] (3 <= x <= 4 & 0 <= y <= 2) & F[7,12] (0 <= x <= 1 & 2 <= y <= 4)"
"""The learned one with the regions at the opposite sides of its world."""

SWARM = SwarmSettings(particles=40, iterations=40, restarts=1, stall=10, climbers=4)

GOAL = Goal(level=0.8, most=20_000)
"""What is learned steadily in these worlds."""


def sdnf(text: str) -> SDNF:
    return to_sdnf(parse(text))


def fit_of(text: str) -> Fit:
    return Fit.of(sdnf(text), 1.0, 0.1, InferenceSettings())


@cache
def target(size: int = 4) -> Target:
    mdp = GridWorld(5).mdp()
    settings = InferenceSettings(size=size, rate=0.97)
    return Target.in_world(walks(NEW, mdp), mdp, TICKS, settings, SWARM, goal=GOAL)


def entries() -> list[Entry]:
    """A source of the same structure, one that learned nothing, one of another structure, and two that do not fit."""
    good = learned()
    blank = replace(good, name="blank", q=np.full_like(good.q, 50.0))
    wide = GridWorld(4).mdp()
    wide = replace(wide, successor=wide.successor[:, :2], probability=wide.probability[:, :2])
    two_actions = replace(good, name="two-actions", mdp=wide, q=good.q[..., :2])
    renamed = replace(good.mdp, variables=("u", "v"))
    formula = sdnf(REACH.replace("x", "u").replace("y", "v"))
    return [good, blank, learned("stay", STAY), two_actions, replace(good, name="uv", mdp=renamed, formula=formula)]


@cache
def ranking() -> Ranking:
    return rank(entries(), target())


# ---------------------------------------------------------------- the new task


def test_regions_of_a_new_task_are_whole_cells():
    mdp = GridWorld(5).mdp()
    assert cells_space(mdp, 9) == SearchSpace.grid(5, 9)
    line = replace(mdp, cell_coordinates=mdp.cell_coordinates * [1, 0] + [0, 2])
    assert cells_space(line, 9).edges == ((0, 1, 2, 3, 4, 5), (0, 5))


def test_columns_are_brought_into_the_worlds_order():
    mdp = GridWorld(5).mdp()
    data = walks(NEW, mdp)
    turned = LabelledTrajectories(data.values[..., [1, 0, 1]], data.lengths, data.labels, ("y", "x", "more"), data.ids)
    np.testing.assert_array_equal(Target.in_world(turned, mdp, TICKS).task.data.values, data.values)


def test_a_task_that_does_not_fit_its_world_is_refused():
    mdp = GridWorld(5).mdp()
    data = walks(NEW, mdp)
    with pytest.raises(DataError, match=r"tick \d+: x is 4.5, and the world goes from 0 to 4; name the world that"):
        Target.in_world(data, GridWorld(4).mdp(), TICKS)
    with pytest.raises(DataError, match=r"have no z, which the world has; they have x, y"):
        Target.in_world(data, replace(mdp, variables=("x", "z")), TICKS)
    with pytest.raises(DataError, match=r"goes on until tick 12, and an episode ends at 11; cut it"):
        Target.in_world(data, mdp, TICKS - 1)
    with pytest.raises(ConfigurationError, match="an episode of 0 ticks is none"):
        Target.in_world(data, mdp, 0)
    for make in (lambda some: Target.in_world(some, mdp, TICKS), Target.of_data):
        with pytest.raises(DataError, match="no trajectory has label -1"):
            make(data.select(data.labels == 1))


# ---------------------------------------------------------------- numbers


def test_what_remains_of_regions_and_windows_by_hand():
    source = "F[1,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 4) & F[9,12] (3 <= x <= 5)"
    other = "F[3,7] G[0,3] (4 <= x <= 6 & 1 <= y <= 4) & F[11,15] (6 <= x <= 8)"
    # moved by x 3, y 0.5 and 2 ticks; of the sides 0.25 and 0.5 remain on average, of the times 0.4
    found = distance(sdnf(source), sdnf(other), SearchSpace.grid(10, 20))
    assert found == pytest.approx((0.25 / 10 + 0.5 / 10 + 0.4 / 20) / 3)
    # a side that is open in one only is a whole range
    assert distance(sdnf("F[1,5] (x >= 1)"), sdnf("F[1,5] (x <= 1)"), SearchSpace.grid(10, 20)) == 0.5
    assert distance(sdnf("F[1,5] (x >= 1)"), sdnf("F[3,7] (x >= 4)"), SearchSpace.grid(10, 20)) == 0


def test_an_entry_for_its_own_task():
    """Nothing is moved, so what is promised is what was learned, and nothing differs."""
    entry = learned()
    own = Target.in_world(walks(REACH, entry.mdp), entry.mdp, TICKS, goal=Goal(level=0.8))
    found = numbers_of(entry, fit_of(REACH), Outlook(own, entry.formula))
    assert (found.dissimilarity, found.distance) == (0, 0)
    problem = problem_of(REACH, entry.mdp)
    assert found.promise == pytest.approx(greedy_success(problem, entry.q))
    success = (evaluate(problem, entry.q, np.random.SeedSequence(0), 20_000) + 10) / 110  # returns are 100 or -10
    assert found.promise == pytest.approx(success, abs=0.01)
    assert found.promise > 0.5
    assert found.rehearsal == 0


def test_the_numbers_are_those_of_their_modules():
    entry, known = learned(), target()
    found = numbers_of(entry, fit_of(NEW), Outlook(known, sdnf(NEW)))
    memory = automaton_memory(known.mdp, tick_tables(sdnf(NEW), TICKS))
    q = transfer_q(entry.mdp, entry.memory(), entry.q, known.mdp, memory, SETTINGS.initial)
    assert found.promise == promise(sdnf(NEW), TICKS, known.mdp, memory, q)
    # the one region is a cell further on, the other too, and no window is later
    assert (found.dissimilarity, found.distance) == (0, 0)


def test_another_arrangement_by_hand():
    entry, known = learned("mirrored", MIRRORED), target()
    found = numbers_of(entry, fit_of(NEW), Outlook(known, sdnf(NEW)))
    # sides in x differ by -2, -2, 4 and 4, of which 3 remain; those in y and the times are the same
    assert found.distance == pytest.approx((3 / 5 + 0 + 0) / 3)
    # laid over one another by -2, as least as can be, the second region would lie outside the world
    assert found.dissimilarity == 1


def test_a_landmark_moves_what_is_transferred():
    entry, known = learned(), target()
    elsewhere = replace(entry, landmarks=(entry.landmarks[0] + 1,))
    _, ours = transferred_values(entry, sdnf(NEW), known)
    _, theirs = transferred_values(elsewhere, sdnf(NEW), known)
    assert (ours != theirs).any()


# ---------------------------------------------------------------- the order


def test_what_was_learned_in_the_same_structure_comes_first():
    names = [each.entry.name for each in ranking().ranked]
    assert names[:2] == ["reach", "blank"]
    first, second = ranking().ranked[:2]
    assert first.fit.formula == second.fit.formula == ranking().task.formula
    assert first.numbers.promise > second.numbers.promise
    assert first.numbers.dissimilarity == second.numbers.dissimilarity
    assert first.numbers.rehearsal < second.numbers.rehearsal
    assert first.why.startswith("Its values need about ")
    assert "and with blank " in first.why
    assert "and with reach " in second.why
    assert ranking().best is first


def test_what_cannot_be_transferred_says_why():
    found = {each.entry.name: each.why for each in ranking().refused}
    assert found["two-actions"] == "Its world has 2 actions, and the new task's 3."
    assert found["uv"] == "Its world has the variables u, v, and the new task's x, y."
    assert found["stay"].startswith("Logical transferability is not identified: with up to 4 copies")
    assert len(found) == 3


def test_a_structure_that_says_little_is_measured_by_the_formula_of_one_that_says_more():
    """One ◇ alone tells most of these apart, and is easily satisfied; the task is not."""
    once = learned("once", "F[7,12] (3 <= x <= 4 & 2 <= y <= 4)")
    easy = replace(target(), settings=InferenceSettings(size=4, rate=0.6))
    found = rank([once, learned()], easy)
    assert [each.entry.name for each in found.ranked] == ["reach", "once"]
    assert structurally_transferable(found.task.formula, sdnf(REACH))
    last = found.ranked[1]
    memory, q = transferred_values(once, last.fit.formula, easy)
    alone = promise(last.fit.formula, TICKS, easy.mdp, memory, q)
    assert last.numbers.promise < found.ranked[0].numbers.promise < alone


def test_other_numbers_give_another_order():
    """What never learned lies nearer than what learned in another arrangement."""
    some = [learned("mirrored", MIRRORED), replace(learned(), name="near", q=np.full_like(learned().q, 50.0))]
    assert [each.entry.name for each in rank(some, target()).ranked] == ["mirrored", "near"]
    for order in (("dissimilarity",), ("distance", "promise")):
        found = rank(some, target(), order)
        assert [each.entry.name for each in found.ranked] == ["near", "mirrored"]
        assert found.order == order
    for order in ((), ("luck",)):
        with pytest.raises(
            ConfigurationError, match=r"cannot be ranked by .*; use rehearsal, promise, dissimilarity, distance"
        ):
            rank([learned()], target(), order)


def test_the_same_call_gives_the_same_ranking():
    again = rank(entries()[::-1], target())
    assert [(each.entry.name, each.numbers, each.why) for each in again.ranked] == [
        (each.entry.name, each.numbers, each.why) for each in ranking().ranked
    ]
    assert [each.why for each in again.refused] == [each.why for each in ranking().refused]


def test_without_a_world_nothing_is_promised():
    data = target().task.data
    known = Target.of_data(data, InferenceSettings(rate=0.9), SWARM)
    found = rank([learned()], known)
    assert (found.best.numbers.promise, found.best.numbers.rehearsal) == (None, None)
    assert (found.without, found.warning) == (None, None)
    assert 0 <= found.best.numbers.dissimilarity <= 1
    assert found.best.why.startswith("No other entry is ranked; its formula, moved onto the task's, disagrees")
    with pytest.raises(ConfigurationError, match="none is known of the new task; name one"):
        transfer(found.best.entry, found.best.fit, known, "mine")


def test_nothing_to_begin_from():
    found = rank(entries()[-2:], target())
    assert (found.ranked, found.task) == ((), None)
    with pytest.raises(NotTransferableError, match=r"to the new task\. two-actions: Its world has 2 actions.* uv: Its"):
        _ = found.best
    with pytest.raises(NotTransferableError, match=r"no entry is transferable to the new task\.$"):
        _ = rank([], target()).best


def test_a_structure_that_has_no_room_is_refused():
    three = "F[0,1] (x >= 1) & G[2,4] (x >= 2) & F[6,7] (x <= 1)"
    mdp = GridWorld(5).mdp()
    data = walks("F[0,1] (x >= 4)", mdp, ticks=4)
    found = rank([learned("long", three, episodes=0)], Target.in_world(data, mdp, 4))
    assert found.refused[0].why.startswith("It cannot be fitted: 3 primitives one after the other do not fit into 4")


# ---------------------------------------------------------------- the transfer


def test_learning_goes_on_from_what_is_transferred():
    best = ranking().best
    start = transfer(best.entry, best.fit, target(), "mine")
    assert (start.name, start.formula, start.horizon) == ("mine", best.fit.formula, TICKS)
    assert start.facts["rate"] == best.fit.rate
    assert start.provenance["from"] == "reach"
    assert start.provenance["source"] == {"formula": REACH, "episodes": 20_000}
    assert {"version", "date"} <= set(start.provenance)
    problem = Problem(start.mdp, problem_of(NEW, start.mdp).task, start.memory())
    fresh, warm = problem.initial_q(SETTINGS), start.q.copy()
    means = [learn(problem, q, SETTINGS, np.random.default_rng(1), 500).mean() for q in (fresh, warm)]
    assert means[1] > means[0] + 5
