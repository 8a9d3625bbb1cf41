"""Studies on clusters of real processes; what breaks is started for the test alone."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from tests.experiments.clusters import ROOT, Grid, free_port, grid, interrupt, until
from tests.experiments.test_runner import artefacts
from tests.experiments.tiny import LONG, TINY
from tickwise.cli import main
from tickwise.errors import ClusterError, ConfigurationError, DataError, MissingExtraError, MissingFileError
from tickwise.experiments import cluster
from tickwise.experiments.cluster import Cluster
from tickwise.experiments.executors import Local, executor
from tickwise.experiments.identity import difference, identity
from tickwise.experiments.progress import Board, Display
from tickwise.experiments.remote import GivenUpError
from tickwise.experiments.runner import run_study
from tickwise.experiments.study import StudySpec

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Grid]:
    """Two workers, one of them with two threads."""
    with grid(tmp_path_factory.mktemp("grid"), workers=1) as made:
        made.start_worker(threads=2)
        yield made


class Noting(Display):
    """A display that keeps the boards, and the lines."""

    def __init__(self) -> None:
        self.stream = io.StringIO()
        super().__init__(Console(file=self.stream, soft_wrap=True))
        self.totals: dict[str, list[float]] = {}

    @property
    def lines(self) -> list[str]:
        return self.stream.getvalue().splitlines()

    @contextmanager
    def phase(self, name: str, items: Any, shared: Board, before: int = 0) -> Iterator[Callable[[int], None]]:
        with super().phase(name, items, shared, before) as finish:
            yield finish
            self.totals[name] = shared.rows()[:, 1].tolist()


def run(spec: StudySpec, folder: Path, at: Grid | str, display: Display | None = None) -> Cluster:
    there = Cluster(at if isinstance(at, str) else at.address)
    run_study(spec, folder, there, display or Display(Console(quiet=True)))
    return there


def test_a_cluster_gives_the_same_bytes_and_tells_how_far_it_is(shared: Grid, finished: Path, tmp_path: Path):
    display = Noting()
    there = run(TINY, tmp_path / "run", shared, display)
    assert artefacts(tmp_path / "run") == artefacts(finished)
    assert there.workers in (1, 2, 3)  # a worker may be late
    assert display.totals["Learn"] == [30_000] * 2 + [20_000] * 6
    assert display.totals["Infer"] == [4] * 4
    assert [line for line in display.lines if "done" in line or "jobs" in line][:2] == [
        "Collect: 4 jobs",
        next(line for line in display.lines if line.startswith("Collect: done in ")),
    ]


def test_a_scheduler_file_names_the_address(shared: Grid, finished: Path, tmp_path: Path):
    shutil.copytree(finished, tmp_path / "run")
    for name in ("learn-III-1.json", "learn-IV-0.npz"):
        (tmp_path / "run" / "artefacts" / name).unlink()
    run(TINY, tmp_path / "run", str(shared.file))
    assert artefacts(tmp_path / "run") == artefacts(finished)


def test_the_error_of_a_job_comes_through(shared: Grid, tmp_path: Path):
    never = replace(TINY.source, task=replace(TINY.source.task, reward=-1.0))
    with pytest.raises(DataError, match="no trajectory of the source task got label 1"):
        run(replace(TINY, source=never), tmp_path / "run", shared)


def test_another_version_is_refused(shared: Grid, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    ours = {**identity(), "numba": "0.1"}
    monkeypatch.setattr(cluster, "difference", lambda theirs, _: difference(theirs, ours))
    with pytest.raises(ConfigurationError, match=r"the worker tcp:\S+ has numba") as error:
        run(TINY, tmp_path / "run", shared)
    assert "instead of 0.1; its results would not be the same, so install the same versions" in str(error.value)
    ours["tickwise"] = "9.9"
    with pytest.raises(ConfigurationError, match=r"has tickwise \S+ instead of 9\.9"):
        run(TINY, tmp_path / "run", shared)
    assert not (tmp_path / "run" / "artefacts").exists()


def test_a_machine_without_tickwise_is_refused(shared: Grid, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cluster, "version", lambda _: metadata.version("no-such-package"))
    with pytest.raises(ConfigurationError, match=r"the (worker tcp:\S+|scheduler) has no tickwise of version \d"):
        run(TINY, tmp_path / "run", shared)


def test_other_code_of_the_same_version_is_refused(tmp_path: Path):
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    with (tmp_path / "src" / "tickwise" / "rl" / "kernels.py").open("a") as file:
        file.write("# changed\n")
    with grid(tmp_path, workers=0) as made:
        made.start_worker(PYTHONPATH=str(tmp_path / "src"))
        with pytest.raises(ConfigurationError, match=r"has the code of tickwise \w+ instead of \w+; its results"):
            run(TINY, tmp_path / "run", made)


@pytest.mark.parametrize("address", ["nowhere", "http://host:8786", "tcp://host", "tcp://:8786", "tcp://a b:1", ""])
def test_what_is_no_address_is_refused(address: str):
    with pytest.raises(ConfigurationError, match=re.escape(f"{address!r} is no address of a Dask scheduler; use one")):
        Cluster(address)


@pytest.mark.parametrize(
    "address", ["host:8786", "tcp://10.0.0.1:8786", "tls://node-1.example.org:1", "tcp://[::1]:80"]
)
def test_addresses(address: str):
    assert Cluster(address).address == address


def test_scheduler_files_that_are_none(tmp_path: Path):
    path = tmp_path / "scheduler.json"
    with pytest.raises(MissingFileError, match=r"there is no scheduler file .*dask scheduler --scheduler-file"):
        Cluster(str(path))
    for content in ("", "[]", "{}"):
        path.write_text(content)
        with pytest.raises(ConfigurationError, match="is no scheduler file"):
            Cluster(str(path))
    path.write_text(json.dumps({"address": "tcp://10.0.0.1:8786"}))
    assert Cluster(str(path)).address == str(path)


def test_nobody_at_the_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cluster, "_ANSWER", 1.0)
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(ClusterError, match=f"no Dask scheduler answers at {address}; start one with `dask scheduler`"):
        run(TINY, tmp_path / "run", address)


def test_somebody_else_at_the_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cluster, "_ANSWER", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(ClusterError, match=f"no Dask scheduler answers at {address}"):
            run(TINY, tmp_path / "run", address)


def test_without_dask(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"a cluster needs Dask; pip install tickwise\[cluster\]"):
        Cluster("tcp://host:8786")


def test_who_carries_out_jobs():
    assert executor(3, None) == Local(3)
    assert isinstance(executor(None, "tcp://host:8786"), Cluster)
    with pytest.raises(ConfigurationError, match="a cluster has its own workers; leave --workers out"):
        executor(3, "tcp://host:8786")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--cluster", "nowhere"), "'nowhere' is no address of a Dask scheduler; use one such as"),
        (("--cluster", "tcp://h:1", "--workers", "2"), "a cluster has its own workers; leave --workers out"),
    ],
)
@pytest.mark.parametrize("command", [("reproduce", "case1"), ("reproduce", "all"), ("effect", "rate")])
def test_the_command_line_says_so_in_one_line(
    command: tuple[str, ...], options: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
):
    assert main([*command, *options]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"error: {message}")
    assert err.count("\n") == 1


def test_without_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cluster, "PATIENCE", 1.0)
    display = Noting()
    with grid(tmp_path, workers=0) as made:
        with pytest.raises(ClusterError, match=f"{made.address} had no workers for 1 s; start some, then run the same"):
            run(TINY, tmp_path / "run", made, display)
        assert display.lines[-1] == f"the cluster at {made.address} has no workers; waiting up to 1 s for one"


@contextmanager
def meanwhile(action: Callable[[], None]) -> Iterator[None]:
    """Do something while a study runs."""
    failed: list[BaseException] = []

    def act() -> None:
        try:
            action()
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=act)
    thread.start()
    try:
        yield
    finally:
        thread.join()
    assert failed == []


def test_a_killed_worker_loses_nothing(finished: Path, tmp_path: Path):
    with grid(tmp_path, workers=1) as made:

        def kill_and_replace() -> None:
            until((tmp_path / "run" / "artefacts" / "collect-source-0.json").exists)
            made.workers[0].kill()
            made.start_worker()

        with meanwhile(kill_and_replace):
            run(TINY, tmp_path / "run", made)
    assert artefacts(tmp_path / "run") == artefacts(finished)


def test_a_restarted_scheduler_gets_the_rest(finished: Path, tmp_path: Path):
    display = Noting()
    with grid(tmp_path) as made:

        def restart() -> None:
            until((tmp_path / "run" / "artefacts" / "collect-source-0.json").exists)
            made.stop()
            made.start_scheduler()
            made.start_worker()

        with meanwhile(restart):
            run(TINY, tmp_path / "run", made, display)
        lost = f"lost the cluster at {made.address}; waiting up to 10 min for it to come back"
        back = f"the cluster at {made.address} is back; what it had not finished begins anew"
        assert display.lines.index(lost) < display.lines.index(back)
    assert artefacts(tmp_path / "run") == artefacts(finished)


def test_a_cluster_lost_for_good_leaves_what_is_finished(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(cluster, "PATIENCE", 1.0)
    monkeypatch.setattr(cluster, "_ANSWER", 5.0)
    with grid(tmp_path) as made:

        def stop() -> None:
            until((tmp_path / "run" / "artefacts" / "collect-source-0.json").exists)
            made.stop()

        with (
            meanwhile(stop),
            pytest.raises(
                ClusterError, match=r"did not come back within 1 s; start it, then run the same command again"
            ),
        ):
            run(TINY, tmp_path / "run", made)
    run_study(TINY, tmp_path / "run", 1, Display(Console(quiet=True)))
    assert artefacts(tmp_path / "run") == artefacts(finished)


@pytest.mark.parametrize("method", ["send", "next", "look"])
def test_nothing_is_lost_wherever_the_connection_breaks(
    shared: Grid, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str
):
    real = getattr(cluster._Link, method)
    calls: list[None] = []

    def breaks_at_times(link: Any, *arguments: Any) -> Any:
        calls.append(None)
        if len(calls) in (2, 7):
            raise cluster._LostError
        return real(link, *arguments)

    monkeypatch.setattr(cluster._Link, method, breaks_at_times)
    run(TINY, tmp_path / "run", shared)
    assert artefacts(tmp_path / "run") == artefacts(finished)
    assert method == "look" or len(calls) > 7


def test_a_job_that_is_lost_again_and_again_ends_the_study(
    shared: Grid, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def breaks(_: Any) -> None:
        raise cluster._LostError

    monkeypatch.setattr(cluster._Link, "next", breaks)
    with pytest.raises(
        ClusterError, match=r"collect in the \w+ task, run \d was sent to the cluster at .* 5 times, and"
    ):
        run(TINY, tmp_path / "run", shared)


def test_a_job_that_a_worker_gives_back_is_sent_anew(
    shared: Grid, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    real, calls = cluster._Link.send, list[None]()

    def given_back(link: Any, task: Any) -> None:
        calls.append(None)
        with monkeypatch.context() as patch:
            if len(calls) in (1, 8):
                patch.setattr(cluster, "carry_out", gives_back)
            real(link, task)

    monkeypatch.setattr(cluster._Link, "send", given_back)
    run(TINY, tmp_path / "run", shared)
    assert artefacts(tmp_path / "run") == artefacts(finished)
    assert len(calls) == 18 + 2


def gives_back(*_: object) -> None:
    raise GivenUpError


def test_a_job_that_loses_its_workers_is_named(tmp_path: Path):
    with grid(tmp_path, workers=1, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0") as made:

        def kill() -> None:
            until((tmp_path / "run" / "artefacts" / "infer-1.json").exists)
            until(lambda: "learn" in str(processing(made)))
            made.workers[0].kill()

        with (
            meanwhile(kill),
            pytest.raises(ClusterError, match=r"run \d was lost with one worker after the other, .* fewer threads"),
        ):
            run(LONG, tmp_path / "run", made)


def processing(made: Grid) -> dict[str, Any]:
    """What each worker has to do."""
    from distributed import Client

    with Client(made.address, set_as_default=False) as client:
        return dict(client.processing())


def test_ctrl_c_cancels_what_is_at_the_cluster(shared: Grid, tmp_path: Path):
    folder = tmp_path / "run"
    command = ("reproduce", "long", "--out", folder, "--cluster", shared.address)
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.experiments.tiny", *command], cwd=ROOT, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, start_new_session=True, env={**os.environ, "TERM": "dumb", "NO_COLOR": "1"},
    )  # fmt: skip
    until((folder / "artefacts" / "infer-1.json").exists)
    until(lambda: "learn" in str(processing(shared)))
    interrupt(process)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert out == b""
    lines = [line for line in err.decode().splitlines() if not re.match(r"(Collect|Infer|Learn): ", line)]
    assert lines == [f"interrupted; what is finished is kept in {folder}: run the same command again to go on"]
    until(lambda: not any(processing(shared).values()))
    until(lambda: executing(shared) == 0)  # a job of minutes ended
    assert not list(folder.rglob("*.tmp"))


def executing(made: Grid) -> int:
    """The jobs that workers are at, wanted or not."""
    from distributed import Client

    with Client(made.address, set_as_default=False) as client:
        return sum(client.run(lambda dask_worker: len(dask_worker.active_threads)).values())
