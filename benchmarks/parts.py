"""The exact search over a folder of Parquet files: a file at a time, and read all at once; time and memory.

Walks over 9×9 cells, 41 ticks, in 20 files. Each contender works in a fresh process, which has gone through a small
folder before. What it takes of memory is its peak resident size above what it had resident at the start. The pass reads
and codes the files; the search is over the coded bits, and its results have to be the same.
"""

from __future__ import annotations

import importlib
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.exact_search import TICKS, prior_of, walks
from benchmarks.result import OURS, Result
from tickwise.envs.gridworld import GridWorld
from tickwise.inference.exact import ExactResult, ExactSettings
from tickwise.inference.parts import scan_parts
from tickwise.inference.reading import read_parts, read_trajectories
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings

COUNTS = (1_000, 10_000, 100_000)
FILES = 20
SIDE = 9

Reader = Callable[[Path], Iterable[LabelledTrajectories]]
READERS: dict[str, Reader] = {OURS: read_parts, "all at once": lambda folder: [read_trajectories(folder)]}


def write(folder: Path, count: int) -> None:
    """Files of as many trajectories each."""
    arrow, parquet = importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    folder.mkdir()
    rng, world, each = np.random.default_rng(1), GridWorld(SIDE), count // FILES
    for number in range(FILES):
        data = walks(rng, world, each)
        columns: dict[str, Any] = {
            "trajectory": np.repeat(np.arange(each) + number * each, TICKS + 1).astype(str),
            "tick": np.tile(np.arange(TICKS + 1), each),
        }
        columns |= {name: data.values[..., column].ravel() for column, name in enumerate(data.variables)}
        columns["label"] = np.repeat(data.labels, TICKS + 1)
        parquet.write_table(arrow.table(columns), folder / f"part-{number:02}.parquet")


def resident(field: str) -> int:
    """Bytes that this process has resident (``VmRSS``), or had at most (``VmHWM``); Linux tells them."""
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        if line.startswith(field):
            return int(line.split()[1]) * 1024
    raise LookupError(field)


def search(reader: Reader, folder: Path) -> tuple[ExactResult, float, float]:
    """What is found, and the seconds of the pass and of the search."""
    moments = [time.process_time()]

    def watched() -> Iterator[LabelledTrajectories]:
        yield from reader(folder)
        moments.append(time.process_time())

    space, prior = SearchSpace.grid(SIDE, TICKS), prior_of(GridWorld(SIDE))
    found = scan_parts(watched(), space, prior, InferenceSettings(), ExactSettings())
    moments.append(time.process_time())
    begin, read, end = moments
    return found, read - begin, end - read


def child(name: str, small: Path, folder: Path) -> None:
    """Search in this process, and print what that took."""
    search(READERS[name], small)
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the peak counts from here
    before = resident("VmRSS")
    found, reading, searching = search(READERS[name], folder)
    memory = resident("VmHWM") - before
    print(json.dumps({"found": str(found), "pass": reading, "search": searching, "memory": memory}))


def in_fresh_process(name: str, small: Path, folder: Path) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.parts", name, str(small), str(folder)]
    document: dict[str, Any] = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    return document


def compared(count: int, small: Path, folder: Path, repetitions: int) -> list[Result]:
    """All contenders on so many trajectories."""
    taken: dict[str, list[dict[str, Any]]] = {name: [] for name in READERS}
    for _ in range(repetitions):
        for name, runs in taken.items():
            runs.append(in_fresh_process(name, small, folder))
    if len({run["found"] for runs in taken.values() for run in runs}) > 1:
        raise SystemExit(f"data in parts, {count} trajectories: the contenders do not agree")
    results = []
    for phase in ("pass", "search"):
        for name, runs in taken.items():
            seconds = statistics.median(run[phase] for run in runs)
            memory = statistics.median(run["memory"] for run in runs) if phase == "pass" else None
            benchmark = f"data in parts: {phase}"
            results.append(Result(benchmark, "trajectories", count, name, seconds, 1, phase, memory=memory))
    return results


def measure(quick: bool) -> list[Result]:
    counts = (200, 2_000) if quick else COUNTS
    try:
        importlib.import_module("pyarrow")
        resident("VmHWM")
    except (ImportError, OSError) as error:
        return [Result("data in parts: pass", "none", 0, name, None, skipped=str(error)) for name in READERS]
    results = []
    with tempfile.TemporaryDirectory() as name:
        small = Path(name) / "small"
        write(small, 10 * FILES)
        for count in counts:
            folder = Path(name) / str(count)
            write(folder, count)
            results += compared(count, small, folder, 1 if quick or count > 10_000 else 3)
    return results


if __name__ == "__main__":
    child(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
