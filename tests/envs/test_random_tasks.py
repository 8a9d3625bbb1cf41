from __future__ import annotations

import dataclasses
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from tickwise.envs.catalog import register_all
from tickwise.envs.environment import GridWorldEnv, RandomTaskEnv
from tickwise.envs.planning import best_success_probability, success_probability
from tickwise.envs.random_tasks import KINDS, Kind, RandomTaskSettings, Structure, random_task, structure_text
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import inside
from tickwise.envs.temporal import ENDINGS, FormulaTask
from tickwise.errors import ConfigurationError
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction

register_all()
SETTINGS = RandomTaskSettings()
F, G, FG, GF = Operator.EVENTUALLY, Operator.ALWAYS, Operator.EVENTUALLY_ALWAYS, Operator.ALWAYS_EVENTUALLY

kinds = st.sampled_from(KINDS)
# two likely disjuncts together exceed the greatest chance, so the ones drawn here have a plain box
plain_kinds = st.sampled_from([kind for kind in KINDS if not kind[1]])
structures: st.SearchStrategy[Structure] = st.one_of(
    st.tuples(st.tuples(kinds)),
    st.tuples(st.tuples(kinds, kinds)),
    st.tuples(st.tuples(plain_kinds), st.tuples(plain_kinds, kinds)),
)
seeds = st.integers(0, 2**32 - 1)


def kinds_of(task: FormulaTask) -> Structure:
    return tuple(
        tuple((primitive.operator, primitive.complemented) for primitive in disjunct.primitives)
        for disjunct in task.sdnf.disjuncts
    )


def chance(mdp: TabularMDP, task: FormulaTask, *disjuncts: tuple[Primitive, ...]) -> float:
    """The chance of other disjuncts under the task's deadline, through the text of their formula."""
    sdnf = SDNF(tuple(SequentialConjunction(primitives) for primitives in disjuncts))
    return success_probability(mdp, FormulaTask(str(sdnf), task.deadline).table(mdp))


def check_primitive(primitive: Primitive, mdp: TabularMDP) -> None:
    share = inside(primitive.box, mdp).mean()
    if primitive.complemented:
        assert SETTINGS.complemented_region <= share < 1
    else:
        assert 0 < share <= SETTINGS.region
    for bound in primitive.box.bounds:
        assert bound.lower.is_integer()
        assert bound.upper.is_integer()
    if primitive.operator.nested:
        assert SETTINGS.durations[0] <= primitive.duration <= SETTINGS.durations[1]


@given(seeds, structures)
@settings(max_examples=40, deadline=None)
def test_a_task_is_within_all_bounds(seed: int, structure: Structure):
    spec = random_task(np.random.default_rng(seed), structure)
    task, mdp = spec.task, spec.mdp()
    assert isinstance(task, FormulaTask)
    assert kinds_of(task) == structure
    assert SETTINGS.sizes[0] <= spec.world.size <= SETTINGS.sizes[1]
    assert SETTINGS.deadlines[0] <= task.deadline <= SETTINGS.deadlines[1]
    disjuncts = [disjunct.primitives for disjunct in task.sdnf.disjuncts]
    for primitives in disjuncts:
        for primitive in primitives:
            check_primitive(primitive, mdp)
    table = spec.task_table()
    whole = success_probability(mdp, table)
    assert SETTINGS.chances[0] <= whole <= SETTINGS.chances[1]
    assert best_success_probability(mdp, table) >= SETTINGS.solvable
    for number, primitives in enumerate(disjuncts):
        alone = chance(mdp, task, primitives)
        for index in range(len(primitives)):
            rest = primitives[:index] + primitives[index + 1 :]
            assert not rest or chance(mdp, task, rest) >= SETTINGS.effect * alone
        others = disjuncts[:number] + disjuncts[number + 1 :]
        assert not others or chance(mdp, task, *others) <= (1 - SETTINGS.contribution) * whole


@given(seeds)
@settings(max_examples=6, deadline=None)
def test_the_same_state_gives_the_same_task(seed: int):
    first, second = np.random.default_rng(seed), np.random.default_rng(seed)
    spec = random_task(first)
    assert random_task(second) == spec
    assert first.bit_generator.state == second.bit_generator.state
    assert random_task(first) != spec


@pytest.mark.parametrize("kind", KINDS, ids=[structure_text(((kind,),)) for kind in KINDS])
def test_every_kind_of_primitive_is_found(kind: Kind):
    assert kinds_of(random_task(np.random.default_rng(0), ((kind,),)).task) == ((kind,),)


def test_structures_worlds_and_ends_vary():
    specs = [random_task(np.random.default_rng(seed)) for seed in range(40)]
    assert {len(spec.task.sdnf.disjuncts) for spec in specs} == {1, 2}
    assert {len(disjunct) for spec in specs for disjunct in kinds_of(spec.task)} == {1, 2}
    assert {kind for spec in specs for disjunct in kinds_of(spec.task) for kind in disjunct} == set(KINDS)
    assert {spec.world.size for spec in specs} == {5, 6, 7, 8}
    assert {spec.task.ends for spec in specs} == set(ENDINGS)
    assert len({spec.task.formula for spec in specs}) == 40


def test_settings_are_kept():
    chosen = RandomTaskSettings(
        sizes=(6, 6), deadlines=(25, 25), durations=(3, 3), windows=(4, 5), disjoint=True, endings=("violated",),
        chances=(0.01, 0.02),
    )  # fmt: skip
    spec = random_task(np.random.default_rng(3), (((FG, False), (F, False)),), settings=chosen)
    assert (spec.world.size, spec.task.deadline, spec.task.ends) == (6, 25, "violated")
    first, second = spec.task.sdnf.disjuncts[0].primitives
    assert first.duration == 3
    assert {primitive.window.end - primitive.window.start + 1 for primitive in (first, second)} <= {4, 5}
    mdp = spec.mdp()
    assert not (inside(first.box, mdp) & inside(second.box, mdp)).any()
    assert 0.01 <= success_probability(mdp, spec.task_table()) <= 0.02


def test_a_structure_may_be_plain_text():
    spec = random_task(np.random.default_rng(1), ((("GF", False),),))  # type: ignore[arg-type]
    assert kinds_of(spec.task) == (((GF, False),),)


def test_structure_text():
    assert structure_text((((FG, False), (F, True)), ((G, False),))) == "FG p & F !p | G p"


def test_what_cannot_be_found_is_said():
    impossible = RandomTaskSettings(chances=(0.9, 1.0), worlds=3, trials=3)
    with pytest.raises(ConfigurationError, match=r"structure G p was found in 3 worlds; widen the settings' chances"):
        random_task(np.random.default_rng(0), (((G, False),),), settings=impossible)
    with pytest.raises(ConfigurationError, match=r"no random task was found in 3 worlds"):
        random_task(np.random.default_rng(0), settings=dataclasses.replace(impossible, region=0.0))
    short = RandomTaskSettings(deadlines=(1, 1), worlds=3)
    with pytest.raises(ConfigurationError, match=r"structure F p & F p & F p was found in 3 worlds"):
        random_task(np.random.default_rng(0), (((F, False),) * 3,), settings=short)


@pytest.mark.parametrize("structure", [(), ((),), ((("U", False),),), (("F", False),), 3])
def test_a_malformed_structure_is_refused(structure: Any):
    with pytest.raises(ConfigurationError, match="is no structure; give for each disjunct its pairs"):
        random_task(np.random.default_rng(0), structure)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sizes": (1, 4)}, r"sizes is \(1, 4\); use a range of whole numbers from 2"),
        ({"deadlines": (9, 8)}, "deadlines is"),
        ({"durations": (0, 3)}, "durations is"),
        ({"region": 1.5}, "region is 1.5"),
        ({"chances": (0.2, 0.1)}, "chances is"),
        ({"effect": 0.5}, "effect is 0.5; use a factor of 1 or more"),
        ({"worlds": 0}, "worlds is 0"),
    ],
)
def test_settings_out_of_range_are_refused(changes: dict[str, Any], message: str):
    with pytest.raises(ConfigurationError, match=message):
        RandomTaskSettings(**changes)


@pytest.mark.parametrize("name", ["tickwise:RandomTask-v0", "tickwise/RandomTask-v0", "RandomTask-v0"])
def test_gymnasium_makes_the_environment_of_a_seed(name: str):
    env = gymnasium.make(name, task_seed=17, render_mode="ansi")
    assert env.unwrapped.specification == random_task(np.random.default_rng(17))
    assert env.unwrapped.specification.id == "RandomTask-v0"
    env.reset(seed=1)
    ended = False
    while not ended:
        *_, ended, truncated, information = env.step(env.action_space.sample())
        assert not truncated
    assert isinstance(information["is_success"], bool)
    assert information["tick"] <= env.unwrapped.specification.task.deadline


@pytest.mark.parametrize("render_mode", [None, "rgb_array", "ansi"])
@pytest.mark.parametrize("task_seed", [0, 17])
def test_gymnasiums_checker_is_content(task_seed: int, render_mode: str | None):
    env = gymnasium.make("RandomTask-v0", task_seed=task_seed, render_mode=render_mode)
    check_env(env.unwrapped)


def test_an_environment_takes_a_structure_and_settings():
    env = RandomTaskEnv(4, structure=(((G, True),),), settings=RandomTaskSettings(sizes=(6, 6)))
    assert isinstance(env, GridWorldEnv)
    assert kinds_of(env.specification.task) == (((G, True),),)
    assert env.observation_space.nvec.tolist() == [6, 6, 4]


@pytest.mark.parametrize("seed", [-1, 2.5, None, True])
def test_a_seed_that_is_none_is_refused(seed: Any):
    with pytest.raises(ConfigurationError, match="task_seed is"):
        RandomTaskEnv(seed)
