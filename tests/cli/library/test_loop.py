"""The whole loop, on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.experiments.tiny import TINY
from tests.test_cli import Tickwise
from tickwise.library.entry_files import read_entry
from tickwise.library.folder import Library
from tickwise.library.worlds import write_world
from tickwise.rl.qlearning import Problem, QSettings, evaluate, learn

pytestmark = pytest.mark.usefixtures("studies")


def test_from_a_run_to_learning_in_another_task(tickwise: Tickwise, finished: Path, study_data: Path, tmp_path: Path):
    """What was learned in the source task is added, ranked for the target task, transferred, and learned on."""
    folder, data, start = tmp_path / "tasks", study_data, tmp_path / "start.npz"
    added = tickwise("library", "add", folder, "tiny", "--run", finished)
    assert (added.status, added.err) == (0, "")
    assert added.out == f"added tiny to {folder}: {Library.open(folder).read('tiny').formula}\n"
    ranked = tickwise("library", "rank", folder, data, "--study", "tiny", "--json").document
    assert [each["name"] for each in ranked["ranked"]] == ["tiny"]
    assert ranked["refused"] == []
    assert ranked["ranked"][0]["why"].startswith("No other entry is ranked; its values need about ")
    made = tickwise("library", "transfer", folder, data, start, "--study", "tiny")
    assert (made.status, made.err) == (0, "")
    assert made.out.splitlines()[0] == f"from tiny: {ranked['ranked'][0]['fitted']}"
    assert made.out.splitlines()[-1] == f"Q-function: {start}, with start.json"

    entry = read_entry(start)
    assert entry.provenance["from"] == "tiny"
    assert entry.provenance["source"]["folder"] == str(finished)
    problem = Problem(entry.mdp, TINY.target.task_table(), entry.memory())
    settings, seed = QSettings(initial=60.0), np.random.SeedSequence(0)
    fresh, warm = problem.initial_q(settings), entry.q.copy()
    assert evaluate(problem, warm, seed, 500) > evaluate(problem, fresh, seed, 500)
    means = [learn(problem, q, settings, np.random.default_rng(0), 2_000).mean() for q in (fresh, warm)]
    assert means[1] > means[0]
    # what was learned on is an entry, too
    np.save(tmp_path / "q.npy", warm)
    write_world(tmp_path / "world.npz", entry.mdp)
    own = ("--formula", entry.formula, "--q", tmp_path / "q.npy", "--world", tmp_path / "world.npz", "--horizon", 14)
    again = tickwise("library", "add", folder, "tiny-target", *own)
    assert again.status == 0
    assert Library.open(folder).names() == ("tiny", "tiny-target")
