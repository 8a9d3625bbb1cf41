from __future__ import annotations

import os
import shutil
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.test_cli import Tickwise
from tickwise.cli import checkup
from tickwise.cli.checkup import ABSENT, BROKEN, OK, WARN, Finding, examine


def by_name(*findings: Finding) -> dict[str, Finding]:
    return {each.name: each for each in findings}


def test_it_looks_at_everything_and_this_installation_works(tickwise: Tickwise):
    answer = tickwise("doctor", "--json")
    assert (answer.status, answer.err) == (0, "")
    document = answer.document
    assert document["ok"] is True
    found = {check["name"]: check for check in document["checks"]}
    assert found.keys() >= {
        "Python", "tickwise", "numpy", "numba", "typer", "pyarrow", "distributed", "kernels", "cache", "threads",
        "cores", "current folder", "temporary folder", "encoding", "C compiler", "chromium", "java", "dot",
    }  # fmt: skip
    for check in document["checks"]:
        assert check.keys() == {"group", "name", "status", "found", "remedy"}
        assert check["status"] in (OK, ABSENT, WARN)
        assert check["found"]
        assert bool(check["remedy"]) == (check["status"] != OK)
    assert found["numpy"]["group"] == "libraries"
    assert found["pyarrow"]["group"] == "extra parquet"
    assert "pytest" not in found  # what developing needs is not looked for


def test_a_line_for_each_check_in_a_pipe(tickwise: Tickwise):
    answer = tickwise("doctor")
    assert answer.status == 0
    header, *lines = answer.out.splitlines()
    assert header.split("\t") == ["status", "group", "name", "found", "remedy"]
    assert all(line.count("\t") == 4 for line in lines)
    assert len(lines) == len(list(examine()))
    assert answer.err.startswith("nothing is broken (")


def test_what_is_broken_is_told_and_is_the_exit_status(tickwise: Tickwise, monkeypatch: pytest.MonkeyPatch):
    def found():
        yield Finding("libraries", "numpy", BROKEN, "is not installed", "pip install 'numpy>=2.0'")
        yield Finding("machine", "cores", OK, "2")

    # the package's attribute of the module's name is the command
    monkeypatch.setattr(sys.modules["tickwise.cli.doctor"], "examine", found)
    answer = tickwise("doctor")
    assert answer.status == 1
    assert answer.out.splitlines()[1] == "broken\tlibraries\tnumpy\tis not installed\tpip install 'numpy>=2.0'"
    assert answer.err == "broken: numpy; do what is said of each\n"
    document = tickwise("doctor", "--json").document
    assert document["ok"] is False


@pytest.mark.parametrize(
    ("line", "status", "group"),
    [
        ("numpy>=2.0", OK, "libraries"),
        ("numpy>=999.0", BROKEN, "libraries"),
        ("no-such-library>=1.0", BROKEN, "libraries"),
        ('no-such-library>=1.0; extra == "parquet"', ABSENT, "extra parquet"),
        ("no_such-library", BROKEN, "libraries"),
    ],
)
def test_libraries(monkeypatch: pytest.MonkeyPatch, line: str, status: str, group: str):
    class Metadata:
        @staticmethod
        def get_all(_: str) -> list[str]:
            return [line, 'pytest>=8.3; extra == "dev"']

    monkeypatch.setattr(checkup, "metadata", lambda _: Metadata)
    [found] = checkup._libraries()
    assert (found.status, found.group) == (status, group)
    assert bool(found.remedy) == (status != OK)
    assert found.remedy.startswith("pip install '") or status == OK


def test_a_library_that_cannot_be_imported(monkeypatch: pytest.MonkeyPatch):
    def fails(_: str) -> None:
        raise OSError("libfoo.so: cannot open\nmore")

    monkeypatch.setattr(checkup, "import_module", fails)
    found = checkup._library("numpy", "2.0", None)
    assert found.status == BROKEN
    assert "cannot be imported: libfoo.so: cannot open" in found.found


@pytest.mark.parametrize(
    ("version", "numbers"), [("2.0", (2, 0)), ("0.29.2", (0, 29, 2)), ("1.2rc1", (1, 2)), ("x", ())]
)
def test_versions(version: str, numbers: tuple[int, ...]):
    assert checkup._numbers(version) == numbers


def test_compiled_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    found = by_name(*checkup._kernels())
    assert Counter(each.status for each in found.values()) == {OK: 3}
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert by_name(*checkup._kernels())["compiler"].status == WARN
    assert checkup._cache("compiled code", None).status == WARN
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "f.nbc").write_bytes(bytes(2**20))
    assert checkup._cache("compiled code", tmp_path / "sub").found == f"{tmp_path}, 1 files, 1 MiB"
    monkeypatch.setattr("tickwise.logic.parse.parse", lambda _: 1 / 0)
    assert by_name(*checkup._kernels())["kernels"].status == BROKEN


def test_folders(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    assert checkup._folder("here", tmp_path, "go", required=True).status == OK
    assert checkup._folder("here", tmp_path / "none", "go", required=True).status == BROKEN
    assert checkup._folder("here", tmp_path / "none", "go", required=False).status == WARN
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10**9, 10**9, 10**8))
    found = checkup._folder("here", tmp_path, "go", required=True)
    assert (found.status, found.remedy) == (WARN, "make room, or go")


def test_a_container_with_less_than_the_machine(monkeypatch: pytest.MonkeyPatch):
    limits = {"cpu.max": "50000 100000", "memory.max": str(2**30), "memory.current": str(2**29)}
    monkeypatch.setattr(checkup, "_cgroup", lambda name: limits[name])
    found = by_name(*checkup._machine())
    assert found["cores"].status == WARN
    assert found["cores"].remedy == "use --workers 1"
    if Path("/proc/meminfo").exists():
        assert found["memory"].found.startswith("1.0 GiB, 0.5 free")
        assert found["memory"].status == WARN


def test_optional_tools(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert {each.status for each in checkup._tools()} == {ABSENT}
    for name, body in (("gcc", "echo gcc 12"), ("java", "echo openjdk 17 >&2"), ("dot", "exit 1")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{body}\n")
        (tmp_path / name).chmod(0o755)
    found = by_name(*checkup._tools())
    assert found["C compiler"].found == "gcc 12"
    assert found["java"].found == "openjdk 17"
    assert found["dot"].found == os.fspath(tmp_path / "dot")
