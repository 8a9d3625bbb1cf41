from __future__ import annotations

import io
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

import tests
from tests.experiments.tiny import HOPELESS, LONG, TINY
from tickwise.errors import ConfigurationError, DataError, StoreError, TickwiseError
from tickwise.experiments import executors
from tickwise.experiments.executors import default_workers
from tickwise.experiments.job import Job
from tickwise.experiments.progress import Display
from tickwise.experiments.runner import (
    Unit,
    available_methods,
    planned_jobs,
    run_study,
    run_units,
    unfinished,
)
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec

ROOT = Path(tests.__file__).parents[1]
METHODS = ("I", "II", "III", "IV")


def run(spec: StudySpec, folder: Path, workers: int = 1) -> Store:
    return run_study(spec, folder, workers, Display(Console(quiet=True)))


def artefacts(folder: Path) -> dict[str, bytes]:
    """The content of all files that a run must give, whatever the way there."""
    files = (folder / "config.json", *(folder / "artefacts").iterdir())
    return {path.name: path.read_bytes() for path in files if not path.name.startswith("cost-")}


def copy_of(folder: Path, at: Path) -> Path:
    shutil.copytree(folder, at)
    return at


def test_every_job_leaves_its_artefact(finished: Path):
    store = Store.open(finished, TINY.as_dict())
    names = {job.name for job in planned_jobs(TINY, store)}
    learned = {f"learn-{subject}-{run}" for subject in ("source", *METHODS) for run in (0, 1)}
    collected = {f"collect-{task}-{run}" for task in ("source", "target") for run in (0, 1)}
    assert names == learned | collected | {"infer-0", "infer-1", "infer-full-0", "infer-full-1"}
    manifests = {path.stem for path in (finished / "artefacts").glob("*.json")}
    assert manifests == names | {f"cost-{name}" for name in names}
    assert not list(finished.rglob("*.tmp"))
    assert unfinished(TINY, store) is None


def test_the_longest_learning_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    done: list[str] = []
    real = executors.perform

    def noted(job: Job, *rest: Any) -> None:
        done.append(job.name)
        real(job, *rest)

    monkeypatch.setattr(executors, "perform", noted)
    learning = replace(TINY.learning, source_episodes=300, most_episodes={"I": 100, "III": 200, "IV": 50})
    run(replace(TINY, runs=1, full=0, learning=learning), tmp_path / "run")
    assert done[3:] == ["learn-source-0", "learn-III-0", "learn-I-0", "learn-IV-0"]


def test_several_studies_are_carried_out_phase_by_phase(tmp_path: Path):
    other = replace(TINY, name="other", runs=1)
    units = [Unit("a", TINY, tmp_path / "a"), Unit("b", other, tmp_path / "b")]
    stream = io.StringIO()
    stores = run_units(units, 1, Display(Console(file=stream)))
    assert [line for line in stream.getvalue().splitlines() if "jobs" in line] == [
        "Collect: 6 jobs", "Infer: 6 jobs", "Learn: 12 jobs", "Transfer: 3 jobs",
    ]  # fmt: skip
    assert [unfinished(unit.spec, store) for unit, store in zip(units, stores, strict=True)] == [None, None]
    run(other, tmp_path / "alone")
    assert artefacts(tmp_path / "alone") == artefacts(tmp_path / "b")


def test_a_finished_study_is_left_alone(finished: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(executors, "perform", lambda *_: pytest.fail("done again"))
    stream = io.StringIO()
    run_study(TINY, finished, 3, Display(Console(file=stream)))
    assert stream.getvalue().splitlines() == [
        "Collect: 4 jobs finished before",
        "Infer: 4 jobs finished before",
        "Learn: 8 jobs finished before",
        "Transfer: 2 jobs finished before",
    ]


def test_what_is_missing_is_done_again_the_same(finished: Path, tmp_path: Path):
    folder = copy_of(finished, tmp_path / "run")
    gone = [
        "collect-source-1.npz",
        "infer-1.json",
        "learn-source-0.npz",
        "learn-IV-0.json",
        "learn-IV-0.npz",
        "learn-III-1.json",
    ]
    for name in gone:
        (folder / "artefacts" / name).unlink()
    store = Store.open(folder, TINY.as_dict())
    first = unfinished(TINY, store)
    assert first is not None
    assert first.name == "collect-source-1"
    run(TINY, folder)
    assert artefacts(folder) == artefacts(finished)
    assert unfinished(TINY, store) is None


def test_two_workers_give_the_same_bytes(finished: Path, tmp_path: Path):
    run(TINY, tmp_path / "run", 2)
    assert artefacts(tmp_path / "run") == artefacts(finished)
    assert active_children() == []


def test_another_seed_gives_other_bytes(finished: Path, tmp_path: Path):
    spec = replace(TINY, seed=1, runs=1)
    run(spec, tmp_path / "run")
    ours, theirs = artefacts(tmp_path / "run"), artefacts(finished)
    assert all(ours[name] != theirs[name] for name in ours if name.endswith(".npz"))


def test_more_runs_leave_the_first_ones_as_they_are(finished: Path, tmp_path: Path):
    run(replace(TINY, runs=1), tmp_path / "run")
    ours, theirs = artefacts(tmp_path / "run"), artefacts(finished)
    del ours["config.json"]
    assert ours == {name: theirs[name] for name in ours}
    assert {name.rsplit("-", 1)[1][0] for name in ours} == {"0"}


def test_without_transferability_method_i_is_left(tmp_path: Path):
    store = run(HOPELESS, tmp_path / "run")
    assert available_methods(HOPELESS, store) == ("I",)
    assert {path.stem for path in (tmp_path / "run" / "artefacts").glob("learn-*")} == {"learn-I-0", "learn-I-1"}
    assert unfinished(HOPELESS, store) is None


def test_methods_follow_from_the_formulas(tmp_path: Path):
    good, bad = ({"formula": "F[0,3] (x >= 3)", "satisfying": satisfying} for satisfying in (True, False))
    for plain, target, expected in (
        (good, good["formula"], METHODS),
        (good, None, ("I", "II")),
        (bad, good["formula"], ("I", "III", "IV")),
        (None, None, ("I",)),
    ):
        store = Store.open(tmp_path, TINY.as_dict())
        manifest = {"source": good, "target": {"formula": target}, "target_without_information": plain}
        store.save("infer-0", manifest, {})
        assert available_methods(TINY, store) == expected
    few = replace(TINY, learning=replace(TINY.learning, most_episodes={"III": 10}))
    store.save("infer-0", {**manifest, "target": {"formula": good["formula"]}}, {})
    assert available_methods(few, store) == ("III",)


def test_a_folder_of_another_configuration_is_refused(finished: Path):
    with pytest.raises(StoreError, match="its runs is 2, not 3"):
        run(replace(TINY, runs=3), finished)


def test_at_least_one_worker(tmp_path: Path):
    with pytest.raises(ConfigurationError, match="there are 0 workers; use 1 or more"):
        run(TINY, tmp_path / "run", 0)
    assert not (tmp_path / "run").exists()
    assert 1 <= default_workers() <= (os.cpu_count() or 1)


@pytest.mark.parametrize("workers", [1, 2])
def test_the_error_of_a_job_comes_through(tmp_path: Path, workers: int):
    never = replace(TINY.source, task=replace(TINY.source.task, reward=-1.0))
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(DataError, match="no trajectory of the source task got label 1"):
        run(replace(TINY, source=never), tmp_path / "run", workers)
    assert active_children() == []
    assert signal.getsignal(signal.SIGINT) is before


def test_a_killed_worker_is_explained(tmp_path: Path):
    def kill_one() -> None:
        deadline = time.monotonic() + 30
        while not active_children() and time.monotonic() < deadline:
            time.sleep(0.01)
        active_children()[0].kill()

    killer = threading.Thread(target=kill_one)
    killer.start()
    with pytest.raises(TickwiseError, match=r"a worker process was killed, .*--workers"):
        run(LONG, tmp_path / "run", 2)
    killer.join()
    assert active_children() == []


def test_a_worker_killed_while_another_one_starts_is_explained_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def closed(*_: Any) -> None:
        raise OSError("handle is closed")

    monkeypatch.setattr(executors.ProcessPoolExecutor, "submit", closed)
    with pytest.raises(TickwiseError, match=r"a worker process was killed, .*--workers"):
        run(LONG, tmp_path / "run", 2)
    assert active_children() == []


def test_it_runs_in_any_thread(finished: Path):
    failures: list[BaseException] = []

    def work() -> None:
        try:
            run(TINY, finished)
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert failures == []


def start(study: str, folder: Path, workers: int, temporary: Path) -> subprocess.Popen[bytes]:
    """A process that writes the artefacts of a study, in a group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "tests.experiments.tiny", "artefacts", study, str(folder), str(workers)],
        cwd=ROOT, stderr=subprocess.DEVNULL, start_new_session=True, env={**os.environ, "TMPDIR": str(temporary)},
    )  # fmt: skip


def test_killed_at_any_moment_it_goes_on_to_the_same_bytes(finished: Path, tmp_path: Path):
    folder, rng = tmp_path / "run", random.Random(7)
    for _ in range(3):
        process = start("tiny", folder, 1, tmp_path)
        deadline = time.monotonic() + 30
        before = len(list(folder.rglob("*")))
        while len(list(folder.rglob("*"))) == before and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.005)
        time.sleep(0.8 * rng.random())
        process.kill()
        process.wait()
    run(TINY, folder)
    assert artefacts(folder) == artefacts(finished)
    assert not list(folder.rglob("*.tmp"))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_workers_end_with_a_killed_parent(tmp_path: Path):
    process = start("long", tmp_path / "run", 2, tmp_path)
    deadline = time.monotonic() + 90
    # both workers are at work once something is collected; where nothing is compiled yet, that takes a while
    while not (tmp_path / "run" / "artefacts").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(group(process.pid)) >= 3
    process.kill()
    process.wait()
    deadline = time.monotonic() + 30  # a worker that compiles hears of it between two functions only
    while group(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert group(process.pid) == []


def group(leader: int) -> list[int]:
    """The living processes of a process group."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, pgid = path.read_text().rpartition(")")[2].split()[:3]
        except OSError:  # it has just ended
            continue
        if int(pgid) == leader and state != "Z":
            found.append(int(path.parent.name))
    return found
