from __future__ import annotations

import io
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from benchmarks.kills import artefacts, compare, stable, wait_for_group
from rich.console import Console

import tests
from tests.experiments.tiny_suite import in_place
from tickwise.errors import ConfigurationError, StoreError
from tickwise.experiments.progress import Display
from tickwise.experiments.publish import publish_suite, republish
from tickwise.experiments.runner import run_units
from tickwise.experiments.store import Store, read_json, write_json
from tickwise.experiments.suites import Suite, effect_suite, find_suite, suite_of

ROOT = Path(tests.__file__).parents[1]


@pytest.fixture
def small() -> Iterator[None]:
    """The tiny suite in the place of ``all``."""
    with in_place():
        yield


def carry_out(suite: Suite, folder: Path) -> dict:
    Store.open(folder, suite.as_dict())
    units = suite.units(folder)
    stores = run_units(units.all, 1, Display(Console(file=io.StringIO())))
    return publish_suite(suite, folder, units, stores, 1, 1.0)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the tiny suite; not to be changed."""
    folder = tmp_path_factory.mktemp("suite") / "all"
    with in_place():
        carry_out(find_suite("all", tasks=2, runs=1), folder)
    return folder


def test_suites_by_name():
    assert find_suite("random").tasks == 50
    assert len(find_suite("random", tasks=2).units(Path()).pairs) == 2
    every = find_suite("all", tasks=3, quick=True)
    units = every.units(Path("here"))
    assert [unit.label for unit in units.studies] == ["case1", "case2"]
    assert [unit.folder for unit in units.pairs][:1] == [Path("here/pairs/pair-00")]
    assert {"trajectories", "depth", "information-weight", "rate", "tau"} <= set(units.effects)
    assert every.command == "tickwise reproduce all --tasks 3 --quick --seed 0"
    assert len({unit.folder for unit in units.all}) == len(units.all)
    one = effect_suite("tau", study="case1", runs=2)
    assert list(one.units(Path()).effects) == ["tau"]
    assert not one.units(Path()).pairs
    assert one.command == "tickwise effect tau --study case1 --runs 2 --seed 0"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: find_suite("some"), "no suite 'some'; choose random or all"),
        (lambda: find_suite("random", tasks=0), "0 random tasks shows nothing; use --tasks 1 or more"),
        (lambda: find_suite("all", runs=0), "0 runs show nothing"),
        (lambda: find_suite("all", seed=-1), "the seed is -1"),
        (lambda: effect_suite("size"), "no effect 'size'; choose"),
        (lambda: effect_suite("tau", study="case9"), "no study 'case9'; choose"),
    ],
)
def test_what_there_is_not(call, message: str):
    with pytest.raises(ConfigurationError, match=message):
        call()


def test_a_suite_follows_from_its_configuration():
    for suite in (find_suite("all", tasks=7, runs=2, seed=3, quick=True), effect_suite("rate", runs=1)):
        assert suite_of(suite.as_dict(), Path()) == suite
    with pytest.raises(StoreError, match="no configuration of a suite"):
        suite_of({"suite": "all"}, Path("folder"))


def test_one_report_has_every_part(whole: Path):
    summary = read_json(whole / "summary.json")
    assert set(summary["studies"]) == {"tiny"}
    assert [row["similar"] for row in summary["random"]["pairs"]] == [True, False]
    assert set(summary["effects"]) == {"depth"}
    page = (whole / "report.html").read_text(encoding="utf-8")
    for anchor in ("tiny", "tiny-learning", "random", "random-pairs", "effect-depth", "environment"):
        assert page.count(f'id="{anchor}"') == 1
    assert summary["command"] in page
    assert (whole / "tiny" / "summary.json").exists()
    assert {"pairs.png", "depth.svg", "depth-time.svg"} <= {path.name for path in (whole / "figures").iterdir()}


@pytest.mark.usefixtures("small")
def test_a_suite_is_rendered_again_the_same(whole: Path):
    before = stable(whole)
    page = (whole / "report.html").read_bytes()
    assert republish(whole) == read_json(whole / "summary.json")
    assert stable(whole) == before
    assert (whole / "report.html").read_bytes() == page


@pytest.mark.usefixtures("small")
def test_a_suite_that_is_not_finished_says_how_to_go_on(tmp_path: Path):
    suite = find_suite("all", tasks=1, runs=1)
    Store.open(tmp_path, suite.as_dict())
    with pytest.raises(StoreError, match=r"not finished \(tiny collect in the source task, run 1 is missing\); go on"):
        republish(tmp_path)
    with pytest.raises(StoreError, match="its tasks is 1, not 2"):
        Store.open(tmp_path, find_suite("all", tasks=2, runs=1).as_dict())
    write_json(tmp_path / "config.json", {"suite": "all"})
    with pytest.raises(StoreError, match="no configuration of a suite"):
        republish(tmp_path)


def test_killed_at_random_moments_a_suite_ends_as_if_left_alone(whole: Path, tmp_path: Path):
    """The short form of benchmarks/kills.py."""
    folder, rng = tmp_path / "all", random.Random(3)
    finished: dict[str, int] = {}
    program = [sys.executable, "-m", "tests.experiments.tiny_suite", "reproduce", "all", "--tasks", "2", "--runs", "1"]
    for kill in range(5):
        process = subprocess.Popen(
            [*program, "--out", str(folder), "--workers", str(1 + kill % 2)], cwd=ROOT, start_new_session=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, "TMPDIR": str(tmp_path)},
        )  # fmt: skip
        before, deadline = len(list(folder.rglob("*"))), time.monotonic() + 60
        while process.poll() is None and time.monotonic() < deadline and len(list(folder.rglob("*"))) <= before:
            time.sleep(0.01)
        time.sleep(rng.random())
        if kill % 2:
            os.killpg(process.pid, 9)
        else:
            process.kill()
        process.wait()
        wait_for_group(process.pid)
        now = artefacts(folder)
        assert all(now[name] == when for name, when in finished.items())
        finished = now
    assert finished
    done = subprocess.run(
        [*program, "--out", str(folder), "--workers", "1"], cwd=ROOT, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()[-500:]
    compare(folder, whole)
