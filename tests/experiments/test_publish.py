from __future__ import annotations

import json
import os
import shutil
from importlib.metadata import version
from pathlib import Path

import pytest
from rich.console import Console

from tests.experiments.test_store import no_room
from tests.experiments.tiny import HOPELESS, TINY
from tickwise.errors import ConfigurationError, MissingFileError, StoreError
from tickwise.experiments import publish as module
from tickwise.experiments.progress import Display
from tickwise.experiments.publish import publish, republish
from tickwise.experiments.runner import run_study
from tickwise.experiments.store import Store, read_json, write_json

pytestmark = pytest.mark.usefixtures("studies")


@pytest.fixture
def run(finished: Path, tmp_path: Path) -> Path:
    """A copy of the finished run."""
    return shutil.copytree(finished, tmp_path / "run")


def shown(folder: Path) -> dict[str, bytes]:
    files = (folder / "summary.json", folder / "report.html", *(folder / "figures").iterdir())
    return {path.name: path.read_bytes() for path in files}


def test_everything_is_there(finished: Path):
    names = {path.name for path in finished.iterdir()}
    assert names == {
        "artefacts", "config.json", "environment.json", "figures", "report.html", "summary.json", "times",
    }  # fmt: skip
    summary = read_json(finished / "summary.json")
    assert {"formulas", "transferable", "v_star", "methods"} <= set(summary)
    assert set(summary["formulas"]) == {"source", "target", "target_without_information"}
    page = (finished / "report.html").read_text(encoding="utf-8")
    assert summary["command"] in page
    assert "A tiny study" in page


def test_the_environment_is_told_apart_from_the_results(finished: Path):
    environment = read_json(finished / "environment.json")
    assert environment["version"] == version("tickwise")
    assert environment["numpy"] == version("numpy")
    assert environment["seconds"] == 1.5
    assert environment["workers"] == 1
    assert environment["job_seconds"] > 0
    assert environment["peak_memory_mib"] > 1
    assert environment["command"].startswith("tickwise reproduce tiny --runs 2 --seed 0 --out ")
    assert environment["command"].endswith(" --workers 1")


def test_a_report_is_rendered_again_the_same(run: Path):
    before = shown(run)
    for path in (run / "summary.json", run / "report.html"):
        path.unlink()
    shutil.rmtree(run / "figures")
    summary = republish(run)
    assert shown(run) == before
    assert summary == read_json(run / "summary.json")


def test_results_do_not_depend_on_how_they_were_made(run: Path, finished: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "draw_figures", lambda *_: {})
    publish(TINY, Store.open(run, TINY.as_dict()), 7, 100.0)
    assert (run / "summary.json").read_bytes() == (finished / "summary.json").read_bytes()
    environment = read_json(run / "environment.json")
    assert environment["seconds"] == 101.5  # with those of the first call
    assert environment["workers"] == 7
    assert environment["peak_memory_mib"] >= read_json(finished / "environment.json")["peak_memory_mib"]


def test_nothing_transferable_is_a_result_too(tmp_path: Path):
    folder = tmp_path / "run"
    store = run_study(HOPELESS, folder, 1, Display(Console(quiet=True)))
    summary = publish(HOPELESS, store, 1, 0.0)
    assert not summary["transferable"]
    assert list(summary["methods"]) == ["I"]
    assert summary["ratios"] == {}
    assert summary["formulas"]["source"] is not None
    assert summary["formulas"]["target"] is None
    assert "violates a constraint of Problem 1" in summary["reason"]
    assert "violates a constraint of Problem 1" in (folder / "report.html").read_text(encoding="utf-8")
    assert republish(folder) == summary


def test_a_run_that_is_not_finished_is_told_how_to_go_on(run: Path):
    (run / "artefacts" / "learn-IV-1.json").unlink()
    with pytest.raises(
        StoreError, match=r"not finished \(Method IV, run 2 is missing\); go on with `tickwise repr.*--out"
    ):
        republish(run)
    (run / "artefacts" / "infer-0.json").unlink()
    with pytest.raises(StoreError, match="infer formulas, run 1 is missing"):
        republish(run)


def test_a_run_without_its_report_is_not_finished(run: Path):
    (run / "environment.json").unlink()
    with pytest.raises(StoreError, match="its report is missing"):
        republish(run)


def test_a_folder_without_a_run_is_named(tmp_path: Path):
    for folder in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(MissingFileError, match=r"holds no run \(there is no config\.json\); name a folder"):
            republish(folder)
    assert not (tmp_path / "nowhere").exists()


def test_the_configuration_of_something_else_is_named(run: Path):
    write_json(run / "config.json", {"name": "tiny"})
    with pytest.raises(StoreError, match=r"no configuration of a run \(there is no 'short'\)"):
        republish(run)
    write_json(run / "config.json", {**TINY.as_dict(), "name": "case9"})
    with pytest.raises(ConfigurationError, match="no study 'case9'"):
        republish(run)
    write_json(run / "config.json", {**TINY.as_dict(), "title": "Another"})
    with pytest.raises(StoreError, match="another configuration"):
        republish(run)


def test_a_full_disk_loses_nothing(run: Path, monkeypatch: pytest.MonkeyPatch):
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(StoreError, match=r"cannot write .*summary\.json: No space left"):
        republish(run)
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before


def test_a_summary_is_json_without_extensions(finished: Path):
    def refuse(constant: str) -> None:
        pytest.fail(f"{constant} is no JSON")

    json.loads((finished / "summary.json").read_text(encoding="utf-8"), parse_constant=refuse)
