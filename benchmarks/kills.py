"""Kill a reproduction again and again at random moments, go on each time, and compare with one that was left alone.

After every kill each finished artefact has to be whole; a finished one is never done again or lost; and in the end all
files have to be the same to the byte, but for those that say how long things took.

Run it as ``python benchmarks/kills.py``; ``--kills``, ``--command``, ``--longest``, ``--folder`` and ``--seed`` are
options.
"""

from __future__ import annotations

import argparse
import os
import random
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tickwise.experiments.store import Store, read_json

TIMED = ("environment.json", "report.html")
"""Files that say how long things took, beside costs and what has times or time in its path."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=100, help="how many kills (100)")
    parser.add_argument("--command", default="reproduce all --quick", help="what to carry out (reproduce all --quick)")
    parser.add_argument("--longest", type=float, default=12.0, help="the longest time until a kill, in seconds (12)")
    parser.add_argument("--folder", type=Path, help="where the run folders go (a temporary folder)")
    parser.add_argument("--seed", type=int, default=0, help="the seed of the moments (0)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="tickwise-kills-") as temporary:
        return trial(options, options.folder or Path(temporary))


def trial(options: argparse.Namespace, folder: Path) -> int:
    """The whole trial; the exit status."""
    program = [sys.executable, "-m", "tickwise", *shlex.split(options.command)]
    rng = random.Random(options.seed)
    began = time.monotonic()
    alone = folder / "alone"
    subprocess.run([*program, "--out", str(alone)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print(f"left alone: {time.monotonic() - began:.0f} s, {len(stable(alone))} files to compare", flush=True)
    kills = rounds = 0
    while kills < options.kills:
        killed = folder / f"killed-{rounds}"
        kills += one_round(program, killed, rng, options.kills - kills, options.longest)
        rounds += 1
        compare(killed, alone)
        shutil.rmtree(killed)
        print(f"{kills} kills: the same to the byte after {rounds} reproductions", flush=True)
    print(f"{kills} kills in {time.monotonic() - began:.0f} s: no finished work was lost, broken or done again")
    return 0


def one_round(program: list[str], folder: Path, rng: random.Random, most: int, longest: float) -> int:
    """Kill and go on until the reproduction is done; how many kills it took, at most so many."""
    kills, finished = 0, {}
    while True:
        process = subprocess.Popen(
            [*program, "--out", str(folder)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
        )
        try:
            errors = process.communicate(timeout=rng.uniform(0.0, longest) if kills < most else None)[1]
        except subprocess.TimeoutExpired:
            if rng.random() < 0.5:
                os.killpg(process.pid, signal.SIGKILL)  # all at once, as when the power fails
            else:
                process.kill()  # the workers find out by themselves
            process.communicate()
            wait_for_group(process.pid)
            kills += 1
        else:
            if process.returncode:
                raise SystemExit(f"going on after {kills} kills failed: {errors.decode()[-500:]}")
            process = None
        now = artefacts(folder)
        lost = [name for name, when in finished.items() if now.get(name) != when]
        if lost:
            raise SystemExit(f"{lost[0]} was finished before and is lost or done again, after {kills} kills")
        finished = now
        if process is None:
            return kills


def wait_for_group(leader: int) -> None:
    """Until no process of a group is left."""
    while True:
        try:
            os.killpg(leader, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)


def artefacts(folder: Path) -> dict[str, int]:
    """When each finished artefact was written; each is read whole."""
    found = {}
    for manifest in folder.rglob("artefacts/*.json"):
        store = Store(manifest.parents[1])
        if not manifest.name.startswith("cost-") and store.has(manifest.stem):
            store.load(manifest.stem)
            found[str(manifest)] = manifest.stat().st_mtime_ns
        else:
            read_json(manifest)
    return found


def stable(folder: Path) -> dict[str, bytes]:
    """The content of every file that does not say how long things took."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not timed(path.relative_to(folder))
    }


def timed(path: Path) -> bool:
    """Whether a file says how long things took."""
    return path.name in TIMED or path.name.startswith("cost-") or "times" in path.parts or path.stem.endswith("-time")


def compare(killed: Path, alone: Path) -> None:
    """End with a message where two reproductions differ."""
    ours, theirs = stable(killed), stable(alone)
    for name in sorted(ours.keys() | theirs.keys()):
        if ours.get(name) != theirs.get(name):
            raise SystemExit(f"{name} differs after the kills, or is only in one of the folders")


if __name__ == "__main__":
    sys.exit(main())
