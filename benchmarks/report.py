"""The results as a table and as files."""

from __future__ import annotations

import csv
import json
import os
import platform
from dataclasses import asdict, fields
from pathlib import Path

from benchmarks.growth import draw
from benchmarks.result import OURS, Result, duration, size_of

_HEADINGS = ("benchmark", "size", "contender", "time", "per", "speed of tickwise", "memory")


def table(results: list[Result]) -> str:
    """A Markdown table; one column says how many times as fast Tickwise is as the contender."""
    base = {(one.benchmark, one.axis, one.size): one.cost for one in results if one.contender == OURS}
    rows = [_row(one, base.get((one.benchmark, one.axis, one.size))) for one in results]
    widths = [max(len(row[column]) for row in (_HEADINGS, *rows)) for column in range(len(_HEADINGS))]
    lines = [_HEADINGS, tuple("-" * width for width in widths), *rows]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |" for line in lines
    )


def _row(one: Result, ours: float | None) -> tuple[str, ...]:
    size = sized(one)
    if one.cost is None:
        return one.benchmark, size, one.contender, "skipped", one.unit, one.skipped, ""
    ratio = "" if ours is None or one.contender == OURS else times(one.cost / ours)
    memory = "" if one.memory is None else size_of(one.memory)
    return one.benchmark, size, one.contender, duration(one.cost), one.unit, ratio, memory


def sized(one: Result) -> str:
    """The size for people: 9×9, 1,000 ticks, 1 run."""
    if one.axis == "none":
        return ""
    if one.axis == "world":
        return f"{one.size}×{one.size}"
    return f"{one.size:,} {one.axis}" if one.size != 1 else f"1 {one.axis.removesuffix('s')}"


def times(ratio: float) -> str:
    """A ratio for people: 0.97×, 12×, 1,400×."""
    return f"{ratio:.2f}×" if ratio < 10 else f"{float(f'{ratio:.2g}'):,.0f}×"


def write(results: list[Result], folder: Path, quick: bool) -> None:
    """Write ``results.json``, ``results.csv``, ``table.md`` and the picture of the growth."""
    folder.mkdir(parents=True, exist_ok=True)
    columns = [field.name for field in fields(Result)]
    machine = {"processor": _processor(), "python": platform.python_version(), "cores": os.cpu_count(), "quick": quick}
    document = {"machine": machine, "results": [asdict(one) for one in results]}
    (folder / "results.json").write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    with (folder / "results.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(asdict(one) for one in results)
    (folder / "table.md").write_text(table(results) + "\n", encoding="utf-8")
    draw(results, folder / "growth")


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
