"""The command ``tickwise doctor``."""

from __future__ import annotations

from dataclasses import asdict

import typer
from rich.table import Table
from rich.text import Text

from tickwise.cli.app import FAILED, JsonFlag, command, messages, output, print_json
from tickwise.cli.checkup import ABSENT, BROKEN, OK, WARN, Finding, examine
from tickwise.cli.listing import show

_STYLES = {OK: "green", ABSENT: "dim", WARN: "yellow", BROKEN: "bold red"}


@command
def doctor(as_json: JsonFlag = False) -> None:
    """Look at this installation and this machine: libraries, compiled code, cores, memory, disk, optional tools.

    The exit status is 1 if something is broken that Tickwise cannot do without; what is absent or warned of is not.

    For example: tickwise doctor
    """
    found = list(examine())
    broken = [each for each in found if each.status == BROKEN]
    if as_json:
        print_json({"ok": not broken, "checks": [asdict(each) for each in found]})
    else:
        _show(found)
        messages.print(_conclusion(found))
    if broken:
        raise typer.Exit(FAILED)


def _show(found: list[Finding]) -> None:
    if not output.is_terminal:
        table = Table("status", "group", "name", "found", "remedy")
        for each in found:
            table.add_row(each.status, each.group, each.name, each.found, each.remedy)
        show(table)
        return
    group = ""
    for each in found:
        if each.group != group:
            group = each.group
            output.print(Text(group, style="bold"))
        output.print(Text.assemble("  ", (f"{each.status:7}", _STYLES[each.status]), f"{each.name:17} {each.found}"))
        if each.remedy:
            output.print(Text(f"{'':9}→ {each.remedy}"))


def _conclusion(found: list[Finding]) -> str:
    """How many of each kind there are, in words."""
    counts = {status: sum(each.status == status for each in found) for status in (BROKEN, WARN, ABSENT)}
    if not counts[BROKEN]:
        return f"nothing is broken ({counts[WARN]} warnings, {counts[ABSENT]} optional parts absent)"
    names = ", ".join(each.name for each in found if each.status == BROKEN)
    return f"broken: {names}; do what is said of each"
