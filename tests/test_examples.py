"""The examples do what they say."""

import importlib
import itertools
import json
import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tickwise.inference.reading import read_trajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.structure import structurally_equivalent

ROOT = Path(__file__).parents[1]
NAVAL = ROOT.parent / "shared" / "data" / "naval" / "naval.npz"

Example = Callable[[str], ModuleType]


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch):
    """Loads an example by its name, as Python does that runs it."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    return importlib.import_module


@pytest.mark.skipif(not NAVAL.exists(), reason=f"there is no naval data set at {NAVAL}")
@pytest.mark.parametrize("number", [0, *(pytest.param(fold, marks=pytest.mark.slow) for fold in range(1, 10))])
def test_a_fold_of_the_naval_data(number: int, example: Example):
    naval = example("naval")
    states, labels, other, truth = naval.folds(NAVAL)[number]
    assert len(states) == 1_800
    assert len(other) == 200
    fitted = naval.model(threads=1).fit(states, labels)
    assert fitted.satisfying_
    assert fitted.formula_.size <= 3
    assert 1 - fitted.score(other, truth) <= 0.005


@pytest.mark.skipif(not NAVAL.exists(), reason=f"there is no naval data set at {NAVAL}")
def test_the_naval_data_are_exported_for_the_command_line(tmp_path: Path):
    out = tmp_path / "vessels.npz"
    command = [sys.executable, ROOT / "examples" / "naval.py", NAVAL, "--export", out]
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout == ""
    data = read_trajectories(out)
    assert data.values.shape == (2_000, 61, 2)
    assert data.variables == ("x", "y")
    assert (data.positives, data.negatives) == (1_000, 1_000)
    # by the data's own rule a vessel is anomalous if it dips below y = 20, or ends beyond x = 30
    anomalous = (data.values[:, :, 1].min(axis=1) < 20) | (data.values[:, -1, 0] > 30)
    assert (anomalous == (data.labels == -1)).all()


# environments that others wrote


def test_the_median_and_its_interval_by_hand(example: Example):
    comparison = example("comparison")
    # of 6 values the least and the greatest hold the median unless all are on one side of it: 1 - 2 / 2^6 = 96.9 %
    assert comparison.median_interval([3, 1, 2, 6, 5, 4]) == (3.5, 1, 6)
    # of 20 the sixth and the fifteenth hold it with 95.9 %, the seventh and the fourteenth with 88.5 %
    assert comparison.median_interval(list(range(1, 21))) == (10.5, 6, 15)
    # a run that does not get there is longer than all others
    assert comparison.median_interval([3, 1, None, 6, 5, None]) == (5.5, 1, math.inf)
    for n in range(6, 30):
        _, low, high = comparison.median_interval(list(range(1, n + 1)))
        sides = sum(math.comb(n, k) for k in range(int(low), int(high)))
        assert sides / 2**n >= 0.95


def test_a_level_is_reached_where_ten_evaluations_in_a_row_have_it_in_the_mean(example: Example):
    episodes_to = example("comparison").episodes_to
    assert episodes_to(np.array([0.0] * 5 + [1.0] * 20), 100) == 400  # of the ten from the fifth one is 0
    assert episodes_to(np.array([0.0, 1.0] * 20), 100) is None
    assert episodes_to(np.ones(10), 100) == 0


def test_the_lake_by_its_map(example: Example):
    lake = example("frozenlake").place(0.9)
    assert lake.mdp.variables == ("row", "column")
    assert lake.mdp.n_states == 64
    # where nothing slips the requirement is met surely: 14 moves from tick 12 on arrive at tick 26
    firm = example("frozenlake").place(1.0)
    assert firm.best == pytest.approx(1)
    assert lake.best < 0.95


def test_what_the_lake_s_logs_say_and_what_it_buys(
    example: Example, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    lake = example("frozenlake")
    monkeypatch.setattr(lake, "LEARNING", replace(lake.LEARNING, episodes=30_000, plays=100))
    monkeypatch.setattr(sys, "argv", ["frozenlake", "--out", str(tmp_path), "--seeds", "2", "--threads", "1"])
    lake.main()
    shown = capsys.readouterr().out
    assert "target: G[4,12] (row <= 2.5 & column <= 1.5) & " in shown
    rows = {line[:36].strip(): line.split() for line in shown.splitlines() if line.endswith("of 2")}
    assert rows["state"][-3:] == rows["state and tick"][-3:] == ["0", "of", "2"]
    assert rows["extended state, transferred values"][-3:] == ["2", "of", "2"]
    assert (tmp_path / "frozenlake.png").stat().st_size > 10_000


def test_key_and_door(example: Example):
    pytest.importorskip("minigrid", reason="MiniGrid is not installed")
    doorkey = example("doorkey")
    env = doorkey.Facts(doorkey.gymnasium.make("MiniGrid-DoorKey-5x5-v0"))
    found, _ = env.reset(seed=0)
    facts = env.unwrapped
    assert found.tolist() == [*facts.agent_pos, facts.agent_dir, 0, 0]  # no key yet, and the door is locked
    near = doorkey.place(5, 0)
    assert near.mdp.variables == ("x", "y", "carrying", "door")  # where it looks is no word of formulas
    doors = {(carrying, door) for _, _, carrying, door in near.mdp.coordinates.astype(int).tolist()}
    # the door is unlocked with the key only, and the key is not put down again
    assert doors == {(0, 0), (1, 0), (1, 1), (1, 2)}
    assert near.best == pytest.approx(1)
    # an obvious player of the table and of the environment agree
    rng = np.random.default_rng(0)
    state = int(np.flatnonzero(near.mdp.initial)[0])
    for _ in itertools.repeat(None, 200):
        action = int(rng.integers(5))
        state = int(near.mdp.successor[state, action, 0])
        found, _, ended, *_ = env.step(action)
        assert near.mdp.coordinates[state].tolist() == np.delete(found, 2).tolist()
        if ended:
            break


def test_times_of_key_and_door_are_inferred_and_transferred(example: Example):
    """As in the example, with a layout of the small world and one of a world a little larger."""
    pytest.importorskip("minigrid", reason="MiniGrid is not installed")
    comparison, doorkey = example("comparison"), example("doorkey")
    rng = np.random.default_rng(0)
    places = [list(doorkey.places(size, [100])) for size in (5, 6)]
    settings, _ = doorkey.LOGS[5]
    logs = [comparison.logged(each, settings, 10_000, 1_500, rng) for each in places]
    found = comparison.inferred(
        *logs,
        comparison.InferenceSettings(size=3, rate=0.99, information_weight=0.001),
        comparison.ExactSettings(joint=True, levels=8),
    )
    for formula, data in zip(found.formulas, logs, strict=True):
        kept = formula.formula.verdict(data.values, variables=data.variables) > 0
        assert (kept == (data.labels > 0)).mean() >= 0.99
    learning = replace(doorkey.LEARNING, source_episodes=20_000, episodes=10_000)
    near, far = places[0][0], places[1][0]
    run = comparison.curves(found, near, far, learning, 0)
    alone, helped = (comparison.episodes_to(run[name], learning.step) for name in list(comparison.METHODS)[2:])
    assert helped < alone
    assert run["state and tick"][-20:].mean() < 0.5


@pytest.mark.parametrize("algorithm", ["dqn", "ppo"])
def test_deep_agents_are_compared(
    algorithm: str,
    example: Example,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    """A moment of what the example does; test_deep.py has agents that learn."""
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed; run make sb3")
    deep = example("deep")
    monkeypatch.setattr(deep, "SOURCE_STEPS", {algorithm: 600})
    monkeypatch.setattr(deep, "STEPS", {algorithm: 1_200})
    monkeypatch.setattr(deep, "EVALUATIONS", 12)
    monkeypatch.setattr(deep, "transfer_values", partial(deep.transfer_values, steps=300, updates=50))
    monkeypatch.setattr(sys, "argv", ["deep", "--algorithm", algorithm, "--out", str(tmp_path), "--seeds", "1"])
    deep.main()
    shown = capsys.readouterr()
    assert "seed 0: source " in shown.err
    assert [line[:36].strip() for line in shown.out.splitlines() if line.endswith("of 1")] == [
        "state", "extended state", "extended state, transferred values",
    ]  # fmt: skip
    assert (tmp_path / f"{algorithm}.png").stat().st_size > 10_000


# what predicts transfer


def test_choices_that_tie_share_and_good_ones_are_near_the_best(example: Example):
    ranking = example("ranking")
    chosen = ranking.choices(np.array([[1.0, 3.0, 3.0], [2.0, 1.0, 0.0]]))
    assert chosen.tolist() == [[0, 0.5, 0.5], [1, 0, 0]]
    # 240 is just near enough to 200, 300 is not
    assert ranking.good(chosen, np.array([[300.0, 200.0, 300.0], [240.0, 300.0, 200.0]])).tolist() == [0.5, 1]


def test_statistics_of_rankings_by_hand(example: Example):
    ranking = example("ranking")
    assert ranking.correlation(np.array([1.0, 2.0, 9.0]), np.array([3.0, 5.0, 6.0])) == pytest.approx(1)
    assert ranking.correlation(np.array([1.0, 2.0, 3.0]), np.array([2.0, 3.0, 1.0])) == pytest.approx(-0.5)
    rows = np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 5.0]])
    # of the other row the ranks are 1.5, 1.5 and 3
    assert ranking.correlation(rows, np.array([[2.0, 3.0, 1.0], [4.0, 2.0, 6.0]])) == pytest.approx([0, 3**0.5 / 2])
    # the textbook's interval of 8 in 10
    assert ranking.wilson(0.8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert ranking.geometric(np.array([1.0, 4.0, 16.0])) == pytest.approx(4)
    runs = np.array([[[100] * 4, [500] * 4]])
    assert ranking.ceiling(runs) == 1  # without noise


def test_a_group_of_random_tasks_is_measured_once(
    example: Example, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    similarity = example("similarity")
    short = partial(
        similarity.Plan, sources=2, source_episodes=3_000, walks=(500,), rehearsals=1, goal=similarity.Goal(most=1_000)
    )
    small = replace(similarity.TASKS, sizes=(4, 5), deadlines=(14, 16), windows=(3, 6), durations=(2, 3))
    monkeypatch.setattr(similarity, "Plan", short)
    monkeypatch.setattr(similarity, "TASKS", small)
    arguments = ["--groups", "1", "--runs", "2", "--out", str(tmp_path), "--workers", "1"]
    monkeypatch.setattr(sys, "argv", ["similarity", *arguments])
    similarity.main()
    shown = capsys.readouterr()
    assert [line.split(",")[0] for line in shown.err.splitlines()[1:]] == ["1 of 1 groups"]
    assert "2 pairs in 1 groups" in shown.out
    found = json.loads((tmp_path / "groups" / "000.json").read_text())
    target, *sources = (parse(each["formula"]) for each in (found["target"], *found["sources"]))
    assert len(sources) == 2
    for source in sources:
        assert structurally_equivalent(to_sdnf(source), to_sdnf(target))
    for source in found["sources"]:
        assert len(source["episodes"]) == 2
        assert all(0 <= source["predictors"][f"promise, {model}"] <= 1 for model in ("500 walks", "true model"))
    for name in ("similarity.png", "choices.png"):
        assert (tmp_path / name).stat().st_size > 10_000
    # what is there is not measured again, and nothing changes
    monkeypatch.setattr(similarity, "measured", None)
    before = (tmp_path / "summary.json").read_bytes()
    similarity.main()
    assert (tmp_path / "summary.json").read_bytes() == before
    # but by another plan it would be
    monkeypatch.setattr(sys, "argv", ["similarity", *arguments, "--seed", "1"])
    with pytest.raises(TypeError):
        similarity.main()
