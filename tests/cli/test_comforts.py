"""What makes the command line pleasant: help, completion, colours that can be left out, tables for pipes, --verbose."""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rich.table import Table
from typer.main import get_command

from tests.test_cli import COMMANDS, PLAIN, ROOT, Tickwise, answer_of
from tickwise.cli import app, completion
from tickwise.cli.app import DEFECT, DONE, FAILED, INTERRUPTED, MISUSED
from tickwise.cli.examples import EXAMPLES
from tickwise.cli.listing import show, tab_separated
from tickwise.experiments.store import read_json
from tickwise.experiments.tables import study_tables

REFERENCE = ROOT / "docs" / "reference" / "command-line.md"
FORMULA = "F[0,2] (x >= 3)"


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    path = tmp_path / "logs.csv"
    path.write_text("trajectory,tick,x,label\na,0,4,1\na,1,4,1\nb,0,2,-1\nb,1,2,-1\n")
    return path


# ---------------------------------------------------------------- help


def commands_of(group: Any, prefix: str = "") -> dict[str, Any]:
    """All commands by what stands after ``tickwise``; groups of commands, and what is in them."""
    found = {}
    for name, command in group.commands.items():
        found[prefix + name] = command
        if hasattr(command, "commands"):
            found |= commands_of(command, f"{prefix}{name} ")
    return found


EVERY = commands_of(get_command(app))


def test_every_command_has_examples_that_are_command_lines(tickwise: Tickwise):
    assert EXAMPLES.keys() <= EVERY.keys()
    assert set(COMMANDS) <= EVERY.keys()
    for name in EVERY:
        answer = tickwise(*name.split(), "-h")
        assert answer.status == 0
        _, _, below = answer.out.partition("\n  Examples:\n")
        lines = below.splitlines()
        assert lines, name
        for line in lines:
            assert line.startswith(f"    tickwise {name}"), line
            assert len(line) <= 80
        assert "For example" not in answer.out
        assert "\x1b" not in answer.out
        assert "\b" not in answer.out


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_examples_name_options_that_there_are(name: str):
    for line in re.findall(r"^ +tickwise (.*)$", EVERY[name].epilog, re.MULTILINE):
        called = max((other for other in EVERY if f"{line} ".startswith(f"{other} ")), key=len)
        known = {option for parameter in EVERY[called].params for option in parameter.opts}
        ours = re.split(r" [|>] ", line)[0]
        assert set(re.findall(r"--[a-z-]+", ours)) <= known, line


# ---------------------------------------------------------------- exit statuses


def test_the_exit_statuses_are_one_table():
    source = (ROOT / "src" / "tickwise" / "cli" / "app.py").read_text(encoding="utf-8")
    in_code = re.findall(r"^(\d+) {2,}\w", source, re.MULTILINE)
    in_docs = re.findall(r"^\| `(\d+)` \|", REFERENCE.read_text(encoding="utf-8"), re.MULTILINE)
    assert in_code == in_docs == [str(status) for status in (DONE, FAILED, MISUSED, DEFECT, INTERRUPTED)]


def test_the_reference_names_all_commands_and_global_options():
    text = REFERENCE.read_text(encoding="utf-8")
    for name in EVERY:
        assert f"tickwise {name}" in text, name
    for parameter in get_command(app).params:
        assert f"`{parameter.opts[0]}`" in text


# ---------------------------------------------------------------- completion


def completed(shell: str, line: str, cwd: Path = ROOT) -> list[str]:
    """What a shell's completion is told for a line that is being typed."""
    words = line.split(" ")
    asked = {"bash": "complete_bash", "zsh": "complete_zsh", "fish": "complete_fish"}[shell]
    answer = subprocess.run(
        [sys.executable, "-m", "tickwise"], cwd=cwd, text=True, capture_output=True, check=False, timeout=60,
        env={
            **os.environ, **PLAIN, "_TICKWISE_COMPLETE": asked, "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1),
            "_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args",
        },
    )  # fmt: skip
    assert answer.stderr == ""
    return re.findall(r'[\w-]+(?=\t|"?:|"|\n|$)', answer.stdout) if shell != "bash" else answer.stdout.split()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("tickwise reproduce c", {"case1", "case2"}),
        ("tickwise automaton x --format m", {"mermaid"}),
        ("tickwise doc", {"doctor"}),
    ],
)
def test_each_shell_is_told_what_fits(shell: str, line: str, expected: set[str]):
    assert expected <= set(completed(shell, line))


@pytest.mark.parametrize(
    ("provider", "incomplete", "expected"),
    [
        (completion.studies, "", ["case1", "case2", "random", "all", "pair-01"]),
        (completion.studies, "case2", ["case2"]),
        (completion.studies, "z", []),
        (completion.case_studies, "", ["case1", "case2"]),
        (completion.effects, "ra", ["rate"]),
        (completion.protocols, "", ["paper", "full"]),
        (completion.formats, "s", ["svg"]),
        (completion.searches, "", ["exact", "joint", "swarm"]),
        (completion.numbers, "dis", ["dissimilarity", "distance"]),
    ],
)
def test_the_names_offered(provider, incomplete: str, expected: list[str]):
    assert provider(incomplete) == expected


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_can_be_shown_and_installed(tmp_path: Path, shell: str):
    env = {**os.environ, **PLAIN, "HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    shown = answer_of("--show-completion", shell, env=env)
    assert (shown.status, shown.err) == (0, "")
    assert "_TICKWISE_COMPLETE" in shown.out
    installed = answer_of("--install-completion", shell, env=env)
    assert (installed.status, installed.err) == (0, "")
    assert any("_TICKWISE_COMPLETE" in path.read_text() for path in tmp_path.rglob("*") if path.is_file())


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes(tmp_path: Path):
    """Bash itself loads what is shown and asks as it does when Tab is pressed."""
    (tmp_path / "tickwise").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tickwise "$@"\n')
    (tmp_path / "tickwise").chmod(0o755)
    env = {**os.environ, **PLAIN, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    shown = answer_of("--show-completion", "bash", env=env)
    script = (
        shown.out + "\ncomplete -p tickwise >/dev/null || exit 1\n"
        "COMP_WORDS=(tickwise automaton x --format '') COMP_CWORD=4; _tickwise_completion tickwise; "
        'echo "${COMPREPLY[@]}"\n'
    )
    path = {**env, "PATH": f"{tmp_path}{os.pathsep}{PLAIN['PATH']}"}
    found = subprocess.run(
        ["bash", "-c", script], cwd=ROOT, text=True, capture_output=True, check=False, env=path, timeout=60
    )
    assert found.stdout.split()[:3] == ["dot", "json", "mermaid"], found.stderr


# ---------------------------------------------------------------- terminals and pipes


def on_a_terminal(*arguments: object, **env: str) -> tuple[int, str]:
    """The exit status and all that a command prints on a terminal of 80 columns."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    own = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "tickwise", *map(str, arguments)], cwd=ROOT, stdin=theirs, stdout=theirs, stderr=theirs,
        env={**own, "TERM": "xterm-256color", "COLUMNS": "80", **env}, close_fds=True,
    )  # fmt: skip
    os.close(theirs)
    shown = b""
    while True:
        try:
            piece = os.read(ours, 4096)
        except OSError:  # its end
            break
        if not piece:
            break
        shown += piece
    os.close(ours)
    return process.wait(timeout=60), shown.decode()


def test_colours_on_a_terminal_and_none_where_they_are_not_wanted(logs: Path):
    status, shown = on_a_terminal("check", "F[0", logs)
    assert status == 1
    assert "\x1b[1;31merror:\x1b[0m" in shown
    for wish in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
        status, shown = on_a_terminal("check", "F[0", logs, **wish)
        assert status == 1
        assert shown.startswith("error: ")
        assert "\x1b" not in shown
    status, shown = on_a_terminal("infer", logs, "--depth", 1, NO_COLOR="1")  # which shows that it is searching
    assert "classification rate" in shown
    assert "\x1b" not in shown


def test_a_table_is_drawn_on_a_terminal_and_tab_separated_in_a_pipe(logs: Path):
    status, shown = on_a_terminal("check", FORMULA, logs, NO_COLOR="1")
    assert status == 0
    assert "┃" in shown
    assert "\x1b" not in shown
    piped = answer_of("check", FORMULA, logs)
    # x is 4 and 2 from tick 0 on, and F[0,2] is not decided where x stays below 3 and tick 2 is missing
    assert [line.split("\t")[:2] for line in piped.out.splitlines()[1:]] == [["a", "true"], ["b", "unknown"]]
    assert piped.err == ""


def test_any_table_as_lines(capsys: pytest.CaptureFixture[str]):
    table = Table("name", "share", title="One title\nin two lines")
    table.add_row("first\none", "50\t%")
    table.add_row("second", "")
    expected = ["# One title", "# in two lines", "name\tshare", "first one\t50 %", "second\t"]
    assert list(tab_separated(table)) == expected
    show("a [bold] line")
    show(table)
    assert capsys.readouterr().out.splitlines() == ["a [bold] line", *expected]


def test_tables_of_a_study_fit_into_80_columns(finished: Path):
    drawn = io.StringIO()
    console = Console(file=drawn, width=80, soft_wrap=True)
    for table in study_tables(read_json(finished / "summary.json"), finished):
        if isinstance(table, Table):
            console.print(table)
    assert 20 < max(len(line) for line in drawn.getvalue().splitlines() if line[:1] in tuple("┏┃┡│└")) <= 80


# ---------------------------------------------------------------- --verbose


@pytest.mark.parametrize("option", ["--verbose", "-v"])
def test_verbose_tells_what_is_done_on_standard_error(tickwise: Tickwise, logs: Path, option: str):
    plain, told = tickwise("check", FORMULA, logs), tickwise(option, "check", FORMULA, logs)
    assert (plain.status, plain.err) == (0, "")
    assert (told.status, told.out) == (0, plain.out)
    lines = [re.sub(r"^ *\d+ ms  ", "", line) for line in told.err.splitlines()]
    assert re.match(r"tickwise \d.*, Python 3\.\d+\.\d+", lines[0])
    assert f"{logs}: 2 trajectories of x, 2 ticks at the most" in lines
    assert re.fullmatch(r"check took \d+\.\d\d s, and \d+ MiB at the most", lines[-1])
    assert tickwise("check", FORMULA, logs).err == ""  # nothing is left of it
