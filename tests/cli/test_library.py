"""Libraries of learned tasks on the command line."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.cli.test_bad_input import FORMULA, a_folder, table
from tests.experiments.test_store import files, no_room
from tests.experiments.tiny import TINY
from tests.library.learned import REACH, learned, walks
from tests.library.test_ranking import MIRRORED, NEW
from tests.test_cli import Tickwise
from tickwise.cli.library import library as group
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.inferences import labelled_data
from tickwise.experiments.learned import learned_entry
from tickwise.experiments.store import Store, read_json
from tickwise.inference.reading import write_npz
from tickwise.library.entry_files import read_entry
from tickwise.library.folder import Library
from tickwise.library.worlds import write_world
from tickwise.rl.qlearning import Problem, QSettings, evaluate, learn

pytestmark = pytest.mark.usefixtures("studies")


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library of two entries; not to be changed."""
    folder = tmp_path_factory.mktemp("library") / "tasks"
    for entry in (learned(), learned("mirrored", MIRRORED)):
        Library.open(folder, create=True).add(entry)
    return folder


@pytest.fixture(scope="module")
def new(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Trajectories of a new task, and its world beside them."""
    folder = tmp_path_factory.mktemp("new")
    mdp = GridWorld(5).mdp()
    write_npz(folder / "logs.npz", walks(NEW, mdp))
    write_world(folder / "world.npz", mdp)
    return folder / "logs.npz"


def of_study(finished: Path, folder: Path) -> Path:
    """The trajectories of the tiny study's target task."""
    path = folder / "target.npz"
    write_npz(path, labelled_data(TINY, Store.open(finished, TINY.as_dict()), "target", 0))
    return path


# ---------------------------------------------------------------- the whole loop


def test_from_a_run_to_learning_in_another_task(tickwise: Tickwise, finished: Path, tmp_path: Path):
    """What was learned in the source task is added, ranked for the target task, transferred, and learned on."""
    folder, data, start = tmp_path / "tasks", of_study(finished, tmp_path), tmp_path / "start.npz"
    added = tickwise("library", "add", folder, "tiny", "--run", finished)
    assert (added.status, added.err) == (0, "")
    assert added.out == f"added tiny to {folder}: {Library.open(folder).read('tiny').formula}\n"
    ranked = tickwise("library", "rank", folder, data, "--study", "tiny", "--json").document
    assert [each["name"] for each in ranked["ranked"]] == ["tiny"]
    assert ranked["refused"] == []
    assert ranked["ranked"][0]["why"].startswith("No other entry is transferable; with its values the greedy policy")
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


def test_where_a_run_is_from_is_kept(finished: Path):
    entry = learned_entry(finished, "tiny")
    store = Store.open(finished, TINY.as_dict())
    returns = [store.load(f"learn-source-{run}")["evaluation_returns"][-1] for run in range(2)]
    run = int(np.argmax(returns))
    origin = {key: value for key, value in entry.provenance.items() if key not in ("version", "date")}
    assert origin == {
        "folder": str(finished), "study": "tiny", "task": "source", "method": "source", "protocol": "paper", "seed": 0,
        "run": run, "runs": 2, "episodes": 30_000, "mean_return": float(max(returns)),
        "made_by": read_json(finished / "environment.json")["version"],
    }  # fmt: skip
    np.testing.assert_array_equal(entry.q, store.load(f"learn-source-{run}")["q"])
    inferred = store.load("infer-0")["source"]
    assert str(entry.formula) == inferred["formula"]
    assert entry.facts["rate"] == inferred["rate"]
    assert entry.facts["positives"] == store.load("collect-source-0")["positives"]


# ---------------------------------------------------------------- what each command says


def test_list_as_a_table_and_as_a_document(tickwise: Tickwise, tasks: Path):
    lines = tickwise("library", "list", tasks).out.splitlines()
    assert lines[0].split("\t") == ["name", "from", "episodes", "mean return", "rate", "added", "formula"]
    *cells, added, formula = lines[1].split("\t")
    assert (cells, formula) == (["mirrored", "", "20,000", "", "1"], MIRRORED)
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", added)
    document = tickwise("library", "list", tasks, "--json").document
    assert document["folder"] == str(tasks)
    assert [each["name"] for each in document["entries"]] == ["mirrored", "reach"]
    first = document["entries"][1]
    assert first["formula"] == REACH
    assert first["world"] == {"states": 64, "actions": 3, "variables": ["x", "y"]}
    assert first["facts"] == {"rate": 1.0, "size": 2}
    assert first["provenance"].keys() == {"version", "date", "episodes"}
    assert first["checksum"].startswith("sha256:")


def test_an_empty_library_lists_nothing(tickwise: Tickwise, tmp_path: Path):
    Library.open(tmp_path / "tasks", create=True)
    assert tickwise("library", "list", tmp_path / "tasks", "--json").document["entries"] == []
    assert len(tickwise("library", "list", tmp_path / "tasks").out.splitlines()) == 1


def test_rank_as_a_table_and_as_a_document(tickwise: Tickwise, tasks: Path, new: Path):
    asked = ("library", "rank", tasks, new, "--world", new.with_name("world.npz"))
    document = tickwise(*asked, "--json").document
    assert document["order"] == ["promise", "dissimilarity", "distance"]
    assert [each["name"] for each in document["ranked"]] == ["reach", "mirrored"]
    first, second = document["ranked"]
    assert first["promise"] > second["promise"]
    assert first["distance"] < second["distance"]
    assert document["task"]["formula"] == first["fitted"]
    lines = tickwise(*asked).out.splitlines()
    assert lines[0] == f"task: {first['fitted']} (classification rate {first['rate']:.4f})"
    assert lines[1].split("\t") == ["name", "why", "promise", "dissimilarity", "distance"]
    for line, each in zip(lines[2:], document["ranked"], strict=True):
        numbers = [f"{each[key]:.4f}" for key in ("promise", "dissimilarity", "distance")]
        assert line.split("\t") == [each["name"], each["why"], *numbers]


def test_rank_by_another_number_and_without_a_world(tickwise: Tickwise, tasks: Path, new: Path):
    found = tickwise("library", "rank", tasks, new, "--by", "distance", "--rate", 0.9, "--json").document
    assert found["order"] == ["distance", "promise", "dissimilarity"]
    assert [each["promise"] for each in found["ranked"]] == [None, None]
    assert found["ranked"][0]["distance"] <= found["ranked"][1]["distance"]


def test_what_is_refused_is_listed_with_the_reason(tickwise: Tickwise, tasks: Path, new: Path):
    asked = ("library", "rank", tasks, new, "--world", new.with_name("world.npz"), "--size", 1)
    document = tickwise(*asked, "--json").document
    assert (document["task"], document["ranked"]) == (None, [])
    assert {each["why"] for each in document["refused"]} == {
        "The source's formula has size 2, more than the 1 that are allowed."
    }
    lines = tickwise(*asked).out.splitlines()
    assert lines[1].startswith("mirrored\tRefused: The source's formula has size 2")


def test_transfer_from_a_named_entry(tickwise: Tickwise, tasks: Path, new: Path, tmp_path: Path):
    asked = ("library", "transfer", tasks, new, tmp_path / "start.npz", "--world", new.with_name("world.npz"))
    best = tickwise(*asked, "--json").document
    assert (best["name"], best["npz"], best["json"]) == (
        "reach",
        str(tmp_path / "start.npz"),
        str(tmp_path / "start.json"),
    )
    assert read_entry(tmp_path / "start.npz").provenance["from"] == "reach"
    assert tickwise(*asked, "--entry", "mirrored", "--json").document["name"] == "mirrored"
    assert read_entry(tmp_path / "start.npz").provenance["from"] == "mirrored"
    assert files(tmp_path) == {"start.npz", "start.json"}


# ---------------------------------------------------------------- bad input


def own(folder: Path, **changes: object) -> tuple[object, ...]:
    """The options of an entry from files, with changes."""
    np.save(folder / "q.npy", learned().q)
    write_world(folder / "world.npz", learned().mdp)
    given = {"formula": REACH, "q": folder / "q.npy", "world": folder / "world.npz"} | changes
    return tuple(part for name, value in given.items() if value is not None for part in (f"--{name}", value))


class Given(NamedTuple):
    """A folder to write in, a library, trajectories of a new task, and a finished run."""

    folder: Path
    tasks: Path
    new: Path
    finished: Path


BAD: dict[str, tuple[Callable[[Given], tuple[object, ...]], str]] = {
    "nothing to add": (
        lambda g: ("add", g.folder / "new", "a"),
        "give either --run, or --formula with --q and --world",
    ),
    "two things to add": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.folder, "--formula", FORMULA),
        "give either --run, or --formula",
    ),
    "a formula without a world": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, world=None)),
        "--formula needs --world too",
    ),
    "a run with a world": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.folder, "--world", g.folder),
        "--q, --world and --horizon go with --formula",
    ),
    "a name that is none": (
        lambda g: ("add", g.folder / "new", "../a", *own(g.folder)),
        "the name '../a' is no name of an entry; use up to 64",
    ),
    "a name that is taken": (
        lambda g: ("add", g.tasks, "reach", "--run", g.folder / "none"),
        "has an entry reach already; choose another name, or remove .*json first",
    ),
    "a folder that holds something else": (
        lambda g: ("add", a_folder(g.folder / "other"), "a", *own(g.folder)),
        "holds files but no library .*; choose another folder",
    ),
    "a run that is none": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.folder / "none"),
        r"holds no run \(there is no config.json\); name a folder that reproduce wrote",
    ),
    "a task that is none": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.folder, "--task", "both"),
        "there is no task 'both'; choose source or target",
    ),
    "a method that is none": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.folder, "--task", "target", "--method", "I"),
        "'I' learns no Q-function on extended states; choose source, II, III, IV",
    ),
    "a method of the other task": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.folder, "--method", "IV"),
        "the source task is not learned by 'IV'; leave --method out",
    ),
    "a Q-function that was not kept": (
        lambda g: ("add", g.folder / "new", "a", "--run", g.finished, "--task", "target"),
        "did not keep the Q-function of IV, only that of the source task; use --task source, or give your own",
    ),
    "a formula that is none": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, formula="F[0,")),
        "line 1, column 5: found the end of the text",
    ),
    "a formula for another world": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, formula="F[0,2] (z > 1)")),
        "the formula names z, which the world does not have; it has x, y",
    ),
    "a Q-function of another shape": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, formula="F[0,9] (x > 1)")),
        r"the Q-function of a is of shape .*; the formula and the world need numbers of shape",
    ),
    "a Q-function that is no file": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, q=g.folder / "none.npy")),
        "there is no file .*none.npy; check the path",
    ),
    "a Q-function without the array": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, q=g.folder / "world.npz")),
        "world.npz has no array 'q'; it has cell, ",
    ),
    "a Q-function that is text": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, q=table()(g.folder))),
        "is no npy or npz file of plain arrays .*; write one with numpy",
    ),
    "a world that is none": (
        lambda g: ("add", g.folder / "new", "a", *own(g.folder, world=g.folder / "q.npy")),
        "q.npy holds no world: it is not an npz file",
    ),
    "a library that is not there": (
        lambda g: ("list", g.folder / "none"),
        "there is no library .*none; check the path, or make one with tickwise library add",
    ),
    "a library that is none": (lambda g: ("list", a_folder(g.folder / "other")), "holds files but no library"),
    "a library that is a file": (lambda g: ("list", table()(g.folder)), "cannot read the folder .*: Not a directory"),
    "a damaged entry": (
        lambda g: ("rank", damaged(g.folder), g.new),
        r"reach.json is damaged \(its checksum .*\); remove it and add the entry again",
    ),
    "no data": (lambda g: ("rank", g.tasks, g.folder / "none.csv"), "there is no file .*none.csv; check the path"),
    "data of another world": (
        lambda g: ("rank", g.tasks, g.new, "--study", "tiny"),
        "is 4.5, and the world goes from 0 to 4; name the world that the trajectories are from",
    ),
    "data with other columns": (
        lambda g: ("rank", g.tasks, table()(g.folder), "--study", "tiny"),
        "the trajectories have no y, which the world has; they have x",
    ),
    "a study that is none": (
        lambda g: ("rank", g.tasks, g.new, "--study", "case7"),
        "there is no study 'case7'; choose",
    ),
    "a study and a world": (
        lambda g: ("rank", g.tasks, g.new, "--study", "tiny", "--world", g.folder),
        "--study and --world exclude each other",
    ),
    "a study and a horizon": (
        lambda g: ("rank", g.tasks, g.new, "--study", "tiny", "--horizon", 9),
        "--horizon goes with --world",
    ),
    "a horizon before the end": (
        lambda g: ("rank", g.tasks, g.new, "--world", g.new.with_name("world.npz"), "--horizon", 9),
        "a trajectory goes on until tick 12, and an episode ends at 9; cut it",
    ),
    "a search that is none": (
        lambda g: ("rank", g.tasks, g.new, "--search", "luck"),
        "search is 'luck'; use 'swarm', 'exact'",
    ),
    "a number that is none": (
        lambda g: ("rank", g.tasks, g.new, "--by", "luck"),
        "entries cannot be ranked by luck, .*; use promise, dissimilarity, distance",
    ),
    "a rate above 1": (
        lambda g: ("rank", g.tasks, g.new, "--rate", "1.5"),
        "rate is 1.5; use a number above 0 and at most 1",
    ),
    "a transfer into nowhere": (
        lambda g: ("transfer", g.tasks, g.new, g.folder / "start.npz"),
        "values are transferred into a world; name it with --study or --world",
    ),
    "a transfer of another ending": (
        lambda g: ("transfer", g.tasks, g.new, g.folder / "start.csv"),
        "start.csv does not end in .npz; use that ending",
    ),
    "a transfer of a bad name": (
        lambda g: ("transfer", g.tasks, g.new, g.folder / "my start.npz"),
        "the name 'my start' is no name of an entry",
    ),
    "an entry that is not there": (
        lambda g: ("transfer", g.tasks, g.new, g.folder / "a.npz", "--study", "tiny", "--entry", "none"),
        "there is no entry 'none' in .*; it has mirrored, reach",
    ),
    "nothing that is transferable": (
        lambda g: (
            "transfer", g.tasks, g.new, g.folder / "a.npz", "--world", g.new.with_name("world.npz"), "--size", 1,
        ),
        "no entry is transferable to the new task. mirrored: The source's formula has size 2, .* reach: ",
    ),
}  # fmt: skip


def damaged(folder: Path) -> Path:
    path = Library.open(folder / "tasks", create=True).add(learned())
    path.write_text(path.read_text().replace('"episodes": 20000', '"episodes": 30000'))
    return folder / "tasks"


@pytest.mark.parametrize("name", BAD)
def test_bad_input(tickwise: Tickwise, tasks: Path, new: Path, finished: Path, tmp_path: Path, name: str):
    make, message = BAD[name]
    (tmp_path / "other").mkdir()
    arguments = make(Given(tmp_path, tasks, new, finished))
    before = files(tmp_path)
    line = tickwise.fails("library", *arguments)
    assert re.search(message, line), line
    assert len(line.splitlines()[0]) - 3 * len(str(tmp_path)) < 400
    answer = tickwise("library", *arguments, "--json")
    assert (answer.status, answer.document) == (1, {"error": line})
    assert files(tmp_path) == before


def test_a_full_disk(tickwise: Tickwise, tasks: Path, new: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    options = own(tmp_path)
    before = files(tmp_path)
    monkeypatch.setattr(os, "fsync", no_room)
    world = ("--world", new.with_name("world.npz"))
    for arguments in (
        ("add", tmp_path / "new", "a", *options),
        ("transfer", tasks, new, tmp_path / "start.npz", *world),
    ):
        assert "No space left on device; make room" in tickwise.fails("library", *arguments)
        assert files(tmp_path) == before


def test_ctrl_c_while_formulas_are_fitted(
    tickwise: Tickwise, tasks: Path, new: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tickwise.library.ranking.fit_transferable", interrupted)
    world = ("--world", new.with_name("world.npz"))
    for arguments in (("rank", tasks, new, *world), ("transfer", tasks, new, tmp_path / "start.npz", *world)):
        answer = tickwise("library", *arguments)
        assert (answer.status, answer.out, answer.err) == (130, "", "interrupted\n")
    assert files(tmp_path) == set()


def test_usage(tickwise: Tickwise, tasks: Path):
    assert tickwise.fails("library", status=2) == "Missing command; see tickwise library --help"
    line = tickwise.fails("library", "rank", tasks, status=2)
    assert line.endswith("; see tickwise library rank --help")
    assert "'data'" in line
    assert "--seed" in tickwise.fails("library", "rank", tasks, "logs.npz", "--seed", -1, status=2)
    assert "o such command" in tickwise.fails("library", "remove", tasks, status=2)
    assert [command.name for command in group.registered_commands] == ["add", "list", "rank", "transfer"]
