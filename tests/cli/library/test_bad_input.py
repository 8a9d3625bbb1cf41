"""What the library's commands cannot do is said in one line, and leaves nothing behind."""

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
from tests.library.learned import REACH, learned
from tests.test_cli import Tickwise
from tickwise.cli.library import library as group
from tickwise.library.folder import Library
from tickwise.library.worlds import write_world

pytestmark = pytest.mark.usefixtures("studies")


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
        "entries cannot be ranked by luck, .*; use rehearsal, promise, dissimilarity, distance",
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
