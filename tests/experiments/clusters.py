"""Dask clusters of this machine's processes, to be broken."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import tests

ROOT = Path(tests.__file__).parents[1]


class Grid:
    """A scheduler and its workers, each a process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.file = folder / "scheduler.json"
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self, **environment: str) -> None:
        self.scheduler = self._dask(
            "scheduler", "--host", "127.0.0.1", "--port", self.port, "--dashboard-address", "127.0.0.1:0",
            "--scheduler-file", self.file, **environment,
        )  # fmt: skip

    def start_worker(self, threads: int = 1, **environment: str) -> None:
        process = self._dask(
            "worker", self.address, "--nthreads", threads, "--no-nanny", "--local-directory", self.folder,
            "--dashboard-address", "127.0.0.1:0", **environment,
        )  # fmt: skip
        self.workers.append(process)

    def stop(self) -> None:
        for process in (*self.workers, self.scheduler):
            if process is not None:
                process.kill()
                process.wait()
        self.workers, self.scheduler = [], None

    def _dask(self, *arguments: object, **environment: str) -> subprocess.Popen[bytes]:
        paths = {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
        with (self.folder / "log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "dask", *map(str, arguments)], cwd=self.folder, stdout=log, stderr=log,
                start_new_session=True, env={**os.environ, **paths, **environment},
            )  # fmt: skip


@contextmanager
def grid(folder: Path, workers: int = 2, **environment: str) -> Iterator[Grid]:
    """A scheduler that answers, and workers that may still be on their way."""
    made = Grid(folder)
    try:
        made.start_scheduler(**environment)
        for _ in range(workers):
            made.start_worker()
        until(made.file.exists)
        yield made
    finally:
        made.stop()


def until(true: Callable[[], object], seconds: float = 60) -> None:
    """Wait for something."""
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, "it never came"
        time.sleep(0.02)


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def interrupt(process: subprocess.Popen[bytes]) -> None:
    os.killpg(process.pid, signal.SIGINT)
