"""Break a cluster while it reproduces a study, and compare with a reproduction on this machine alone.

A scheduler and worker processes are started here. While the study runs, one worker is killed, then the scheduler, and
both come back. In the end every artefact has to be the same to the byte as that of a local reproduction.

Run it as ``python benchmarks/cluster.py``; ``--command``, ``--workers`` and ``--folder`` are options.
"""

from __future__ import annotations

import argparse
import shlex
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from kills import artefacts, compare, stable

WAIT = 120.0
"""Seconds for anything to come."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--command", default="reproduce case1 --quick", help="what to carry out")
    parser.add_argument("--workers", type=int, default=2, help="worker processes (2)")
    parser.add_argument("--folder", type=Path, help="where the run folders go (a temporary folder)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="tickwise-cluster-") as temporary:
        return trial(options, (options.folder or Path(temporary)).absolute(), Path(temporary))


def trial(options: argparse.Namespace, folder: Path, scratch: Path) -> int:
    """The whole trial; the exit status."""
    program = [sys.executable, "-m", "tickwise", *shlex.split(options.command)]
    alone, spread = folder / "alone", folder / "spread"
    began = time.monotonic()
    subprocess.run([*program, "--out", str(alone)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print(f"on this machine alone: {time.monotonic() - began:.0f} s, {len(stable(alone))} files to compare", flush=True)
    began = time.monotonic()
    with cluster(scratch, options.workers) as made:
        break_it(made, [*program, "--out", str(spread), "--cluster", made.address], spread)
    compare(spread, alone)
    print(
        f"on {options.workers} workers, a worker killed and the scheduler restarted: {time.monotonic() - began:.0f} s"
    )
    print(f"the same to the byte: {len(artefacts(spread))} artefacts, {len(stable(spread))} files")
    return 0


class Cluster:
    """A scheduler and its workers, each a process of this machine."""

    def __init__(self, scratch: Path) -> None:
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            self.port = str(listener.getsockname()[1])
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.scratch = scratch
        self.scheduler: subprocess.Popen[bytes]
        self.workers: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> None:
        """Start it, always at the same address."""
        self.scheduler = self._dask("scheduler", "--host", "127.0.0.1", "--port", self.port)

    def start_worker(self) -> None:
        """Start one more."""
        # without a nanny, so that a kill is a kill; it would also set the number of threads of libraries to 1
        worker = ("worker", self.address, "--nthreads", "1", "--no-nanny", "--local-directory", str(self.scratch))
        self.workers.append(self._dask(*worker))

    def stop(self) -> None:
        """Kill all of it."""
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()
        self.workers = []

    def _dask(self, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments, "--dashboard-address", "127.0.0.1:0"]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@contextmanager
def cluster(scratch: Path, workers: int) -> Iterator[Cluster]:
    """A cluster that ends with the trial."""
    made = Cluster(scratch)
    made.start_scheduler()
    try:
        for _ in range(workers):
            made.start_worker()
        yield made
    finally:
        made.stop()


def break_it(made: Cluster, program: list[str], folder: Path) -> None:
    """Carry out a study while a worker and the scheduler are killed."""
    process = subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.extend(process.stderr))
    reader.start()
    try:
        kill_and_restart(made, process, folder, lines)
        if process.wait():
            raise SystemExit(f"the reproduction failed: {''.join(lines)[-500:]}")
    finally:
        process.kill()
        reader.join()


def kill_and_restart(made: Cluster, process: subprocess.Popen[str], folder: Path, lines: list[str]) -> None:
    """A worker is killed while jobs of the first phase run, the scheduler while methods learn."""

    def finished(kind: str) -> bool:
        return any(folder.glob(f"artefacts/{kind}-*.json"))

    def until(true: Callable[[], object], what: str) -> None:
        deadline = time.monotonic() + WAIT
        while not true():
            if process.poll() is not None or time.monotonic() > deadline:
                raise SystemExit(f"{what} never came: {''.join(lines)[-500:]}")
            time.sleep(0.01)

    until(lambda: finished("infer"), "the first formula")
    made.workers.pop(0).kill()
    print(f"killed a worker after {len(artefacts(folder))} artefacts", flush=True)
    made.start_worker()
    until(lambda: finished("learn"), "the first method")
    before = len(made.workers)
    made.stop()
    print(f"killed the scheduler and its workers after {len(artefacts(folder))} artefacts", flush=True)
    until(lambda: any(line.startswith("lost the cluster") for line in lines), "word of the loss")
    made.start_scheduler()
    for _ in range(before):
        made.start_worker()
    until(lambda: any("is back" in line for line in lines), "word of the return")
    print("".join(f"  {line}" for line in lines if "the cluster at" in line), end="", flush=True)


if __name__ == "__main__":
    sys.exit(main())
