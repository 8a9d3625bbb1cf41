from __future__ import annotations

import gc
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.envs.wrappers.slow import Replay
from tests.envs.wrappers.worlds import frozen_lake, random_episodes
from tickwise.cli.app import app
from tickwise.envs.wrappers import CollectTrajectories, Labelled, TimedTask
from tickwise.envs.wrappers.collect import Episode
from tickwise.envs.wrappers.labelled import FEATURES
from tickwise.envs.wrappers.recording import JOURNAL
from tickwise.errors import ConfigurationError, DataError, StoreError
from tickwise.inference.reading import read_trajectories
from tickwise.inference.trajectories import LabelledTrajectories


def journal(path: Path) -> Path:
    return path.with_name(path.name + JOURNAL)


def assert_holds(data: LabelledTrajectories, X: list[np.ndarray], y: Any) -> None:
    assert data.labels.tolist() == list(y)
    assert data.lengths.tolist() == [len(each) for each in X]
    for row, length, each in zip(data.values, data.lengths, X, strict=True):
        np.testing.assert_array_equal(row[:length], each)


def test_the_file_has_what_happened(tmp_path: Path):
    path = tmp_path / "new" / "lake.npz"
    env = CollectTrajectories(frozen_lake(), path)
    X, y = [], []
    for episode in random_episodes(env, 300, seed=0, longest=1000):
        X.append(np.array([info[FEATURES] for *_, info in episode]))
        y.append(1 if sum(reward for _, reward, *_ in episode) > 0 else -1)
        assert not path.exists()
    env.close()
    assert set(y) == {1, -1}
    data = read_trajectories(path)
    assert data.variables == env.feature_names == ("row", "column")
    assert_holds(data, X, y)
    assert [file.name for file in path.parent.iterdir()] == ["lake.npz"]
    trajectories, labels = env.trajectories()
    assert_holds(LabelledTrajectories.from_arrays(trajectories, labels, env.feature_names), X, y)


def test_terminated_and_truncated_episodes_are_recorded_and_cut_off_ones_are_not():
    rows = [np.arange(2.0 * ticks).reshape(ticks, 2) for ticks in (2, 4, 3)]
    seen: list[Episode] = []
    for truncated in (False, True):
        env = CollectTrajectories(
            Labelled(Replay(rows, truncated), ("x", "y")), label=lambda each: seen.append(each) or each.truncated
        )
        for ticks in (2, 2, 3):  # the second one is left after two of its four ticks
            env.reset()
            for _ in range(ticks - 1):
                env.step(0)
        X, y = env.trajectories()
        assert [each.tolist() for each in X] == [rows[0].tolist(), rows[2].tolist()]
        assert y.tolist() == [1 if truncated else -1] * 2
        assert len(env) == 2
    assert [(episode.total, episode.truncated) for episode in seen] == [(1, False), (3, False), (1, True), (3, True)]
    assert seen[0].info["episode"] == 0


def test_the_label_is_success_where_it_is_told():
    X = np.array([[0.0, 0], [5, 0], [0, 0]])
    for formula, label in (("F[0,1] (x >= 5)", 1), ("F[0,1] (x >= 6)", -1)):
        # rewards would say the contrary
        timed = TimedTask(Labelled(Replay([X]), ("x", "y")), formula, 2, reward=-1.0, penalty=1.0)
        env = CollectTrajectories(timed)
        env.reset()
        while not env.step(0)[2]:
            pass
        assert env.trajectories()[1].tolist() == [label]


def play(env: CollectTrajectories, episodes: int, seed: int) -> None:
    for _ in random_episodes(env, episodes, seed, longest=1000):
        pass


def test_what_is_there_is_neither_overwritten_nor_mixed_unasked(tmp_path: Path):
    path = tmp_path / "lake.npz"
    first = CollectTrajectories(frozen_lake(), path)
    play(first, 3, seed=0)
    with pytest.raises(ConfigurationError, match=r"lake.npz.part is there already; use resume=True"):
        CollectTrajectories(frozen_lake(), path)
    first.close()
    with pytest.raises(ConfigurationError, match=r"lake.npz is there already; use resume=True to go on with it, or"):
        CollectTrajectories(frozen_lake(), path)
    second = CollectTrajectories(frozen_lake(), path, resume=True)
    assert len(second) == 3
    play(second, 2, seed=9)
    second.close()
    X, y = second.trajectories()
    assert_holds(read_trajectories(path), X, y)
    for ours, theirs in zip(X, first.trajectories()[0], strict=False):
        np.testing.assert_array_equal(ours, theirs)
    assert len(X) == 5


def test_writing_twice_and_in_between_changes_nothing(tmp_path: Path):
    path = tmp_path / "lake.npz"
    env = CollectTrajectories(frozen_lake(), path)
    env.write()
    assert not path.exists()  # there is nothing yet
    for _ in range(3):
        play(env, 2, seed=1)
        env.write()
        env.write()
        assert not journal(path).exists()
        assert_holds(read_trajectories(path), *env.trajectories())


@pytest.mark.parametrize("torn", [0, 1, 30])
def test_a_journal_left_behind_is_gone_on_with(tmp_path: Path, torn: int):
    path = tmp_path / "lake.npz"
    env = CollectTrajectories(frozen_lake(), path)
    play(env, 2, seed=0)
    env.write()
    play(env, 3, seed=5)
    kept = journal(path).read_bytes()
    X, y = env.trajectories()
    env.close()
    # as if the process had been killed between writing the file and ending the journal: none counts twice
    journal(path).write_bytes(kept)
    again = CollectTrajectories(frozen_lake(), path, resume=True)
    assert_holds(LabelledTrajectories.from_arrays(*again.trajectories()), X, y)
    again.close()
    # as if it had been killed before, or while it wrote the last line
    fewer = CollectTrajectories(frozen_lake(), tmp_path / "begun.npz")
    play(fewer, 2, seed=0)
    fewer.write()
    (tmp_path / "begun.npz.part").write_bytes(kept[: len(kept) - torn])
    again = CollectTrajectories(frozen_lake(), tmp_path / "begun.npz", resume=True)
    count = 5 if torn == 0 else 4  # the last line was not finished
    assert_holds(LabelledTrajectories.from_arrays(*again.trajectories()), X[:count], y[:count])
    play(again, 1, seed=40)
    again.close()
    assert len(read_trajectories(tmp_path / "begun.npz")) == count + 1


SCRIPT = """
import sys, time
from tests.envs.wrappers.test_collect import CollectTrajectories, frozen_lake, play
env = CollectTrajectories(frozen_lake(), sys.argv[1])
play(env, 25, seed=0)
print("played", flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_nothing_is_lost_when_it_is_stopped(tmp_path: Path, number: signal.Signals):
    path = tmp_path / "lake.npz"
    root = str(Path(__file__).parents[3])
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        cwd=root,
        text=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "played\n"
        time.sleep(0.1)
        process.send_signal(number)
        process.wait(30)
    # Ctrl-C lets the program write the file; a kill does not, but the journal has all
    assert path.exists() == (number == signal.SIGINT)
    assert journal(path).exists() == (number == signal.SIGKILL)
    env = CollectTrajectories(frozen_lake(), path, resume=True)
    env.close()
    expected = CollectTrajectories(frozen_lake())
    play(expected, 25, seed=0)
    assert_holds(read_trajectories(path), *expected.trajectories())


def test_a_wrapper_that_is_dropped_writes_too(tmp_path: Path):
    env = CollectTrajectories(frozen_lake(), tmp_path / "lake.npz")
    play(env, 2, seed=0)
    del env
    gc.collect()
    assert len(read_trajectories(tmp_path / "lake.npz")) == 2


def test_the_command_line_infers_from_it(tmp_path: Path):
    path = tmp_path / "lake.npz"
    env = CollectTrajectories(frozen_lake(), path, lambda episode: episode.features[:4, 0].max() >= 1)
    play(env, 60, seed=0)
    env.close()
    result = CliRunner().invoke(app, ["infer", str(path), "--json", "--size", "1"])
    assert result.exit_code == 0, result.output
    assert '"classification_rate": 1.0' in result.output


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.npz", b"not an archive", "is no recording"),
        ("a.npz.part", b'{"names": ["speed"], "after": 0}\n', "has the features speed, not row, column"),
        ("a.npz.part", b"nonsense\n", "is no journal of a recording"),
        ("a.npz.part", b'{"names": ["row", "column"], "after": 0}\n{}\n', "is no journal of a recording"),
    ],
)
def test_what_cannot_be_gone_on_with_is_refused_and_stays(tmp_path: Path, name: str, content: bytes, message: str):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DataError, match=message) as caught:
        CollectTrajectories(frozen_lake(), tmp_path / "a.npz", resume=True)
    assert "\n" not in str(caught.value)
    assert (tmp_path / name).read_bytes() == content


def test_an_empty_journal_is_none(tmp_path: Path):
    (tmp_path / "a.npz.part").write_bytes(b'{"na')
    assert len(CollectTrajectories(frozen_lake(), tmp_path / "a.npz", resume=True)) == 0


def test_what_does_not_fit_is_refused(tmp_path: Path):
    with pytest.raises(ConfigurationError, match=r"a.csv does not end in .npz"):
        CollectTrajectories(frozen_lake(), tmp_path / "a.csv")
    with pytest.raises(ConfigurationError, match="CollectTrajectories needs named features"):
        CollectTrajectories(gymnasium.make("FrozenLake-v1"))
    (tmp_path / "file").touch()
    env = CollectTrajectories(frozen_lake(), tmp_path / "file" / "a.npz")
    with pytest.raises(StoreError, match=r"cannot write .*a.npz.part"):
        play(env, 1, seed=0)


def test_an_infinite_feature_is_named():
    env = CollectTrajectories(Labelled(Replay([np.array([[0.0, 0], [1, np.inf]])]), ("x", "y")))
    env.reset()
    with pytest.raises(DataError, match="feature 'y' is infinite; trajectories need finite numbers, so clip it"):
        env.step(0)
