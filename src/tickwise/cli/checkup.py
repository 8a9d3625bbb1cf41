"""What ``tickwise doctor`` looks at: each check says what it found, and what helps where that is not enough."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path
from platform import platform, python_implementation, python_version

from tickwise._wording import reason

OK, ABSENT, WARN, BROKEN = "ok", "absent", "warn", "broken"
"""How a check can end: as it should, without something optional, with a drawback, without something required."""

_GIB = 2**30
_LEAST_MEMORY, _LEAST_DISK = 2 * _GIB, 1 * _GIB
_REQUIREMENT = re.compile(
    r"\s*(?P<name>[\w.-]+)\s*(?:\[[^\]]*\])?\s*(?:>=\s*(?P<least>[\d.]+))?[^;]*(?:;(?P<when>.*))?"
)
_EXTRA = re.compile(r"""extra\s*==\s*["']([\w-]+)["']""")
_TOOLS = {
    "C compiler": (("gcc", "cc", "clang"), "compares speed with C in make bench", "gcc"),
    "chromium": (("chromium", "chromium-browser", "google-chrome"), "tests the pages of reports", "chromium"),
    "java": (("java",), "runs a second opinion on semantics in tests", "a Java runtime"),
    "dot": (("dot",), "draws what tickwise automaton --format dot prints", "graphviz"),
}
"""Programs that something optional needs: their names, what for, what to install."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What a check found.

    Attributes:
        group: What it belongs to.
        name: What was looked at.
        status: One of `OK`, `ABSENT`, `WARN` and `BROKEN`.
        found: What is there.
        remedy: What helps; empty where nothing has to be done.
    """

    group: str
    name: str
    status: str
    found: str
    remedy: str = ""


def examine() -> Iterator[Finding]:
    """Look at everything, one thing after the other."""
    for check in (_python, _libraries, _kernels, _machine, _storage, _terminal, _tools):
        yield from check()


def _python() -> Iterator[Finding]:
    found = f"{python_implementation()} {python_version()}, {platform(terse=True)}"
    yield Finding("python", "Python", OK, found)
    try:
        yield Finding("python", "tickwise", OK, f"{version('tickwise')} in {Path(__file__).parents[1]}")
    except PackageNotFoundError:
        yield Finding("python", "tickwise", WARN, "is not installed", "pip install it, so that its version is known")


def _libraries() -> Iterator[Finding]:
    try:
        needed = metadata("tickwise").get_all("Requires-Dist") or []
    except PackageNotFoundError:
        return
    for line in needed:
        match = _REQUIREMENT.match(line)
        extra = _EXTRA.search(line)
        if match is None or (extra is not None and extra[1] == "dev"):
            continue
        yield _library(match["name"], match["least"] or "", None if extra is None else extra[1])


def _library(name: str, least: str, extra: str | None) -> Finding:
    """Whether a library is there, is new enough and can be imported."""
    group = "libraries" if extra is None else f"extra {extra}"
    remedy = f"pip install '{name}>={least}'" if extra is None else f"pip install 'tickwise[{extra}]'"
    try:
        found = version(name)
    except PackageNotFoundError:
        return Finding(group, name, BROKEN if extra is None else ABSENT, "is not installed", remedy)
    if least and _numbers(found) < _numbers(least):
        return Finding(group, name, BROKEN, f"{found} is older than {least}", remedy)
    try:
        import_module(name.replace("-", "_"))
    except Exception as error:  # a broken library can fail in any way
        return Finding(group, name, BROKEN, f"{found} cannot be imported: {reason(error)}", f"{remedy} anew")
    return Finding(group, name, OK, found)


def _numbers(text: str) -> tuple[int, ...]:
    """The numbers that a version begins with."""
    begins = re.match(r"\d+(?:\.\d+)*", text)
    return tuple(map(int, begins[0].split("."))) if begins else ()


def _kernels() -> Iterator[Finding]:
    group = "compiled code"
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        yield Finding(group, "compiler", WARN, "is off: everything is slow", "unset NUMBA_DISABLE_JIT")
    try:
        from tickwise._jit import cache_folder, threading_layers

        yield _one_kernel(group)
        folder, layers = cache_folder(), threading_layers()
    except Exception as error:  # whatever is broken below
        yield Finding(group, "kernels", BROKEN, f"do not run: {reason(error)}", "pip install numba anew")
        return
    yield _cache(group, folder)
    yield Finding(group, "threads", OK, f"Python's own; numba's would be {' or '.join(layers) or 'none'}")


def _one_kernel(group: str) -> Finding:
    """Run one kernel from a formula to its verdict."""
    import numpy as np

    from tickwise.logic.parse import parse
    from tickwise.logic.syntax import Verdict

    began = time.monotonic()
    right = parse("F[1,2] (x > 1)").verdict(np.array([[0.0], [0.0], [2.0]])) is Verdict.TRUE
    spent = time.monotonic() - began
    if not right:
        return Finding(group, "kernels", BROKEN, "give a wrong verdict", "remove the cache of compiled code")
    return Finding(group, "kernels", OK, f"run; a first verdict took {spent:.1f} s")


def _cache(group: str, folder: Path | None) -> Finding:
    remedy = "set NUMBA_CACHE_DIR to a folder that can be written, or every start compiles anew"
    if folder is None:
        return Finding(group, "cache", WARN, "there is no folder for it", remedy)
    package = Path(__file__).parents[1]
    root = package if package in folder.parents else folder.parent
    files = [path for ending in ("nbi", "nbc") for path in root.rglob(f"*.{ending}")]
    size = sum(path.stat().st_size for path in files) / 2**20
    found = f"{root}, {len(files)} files, {size:.0f} MiB"
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    if not os.access(nearest, os.W_OK):
        return Finding(group, "cache", WARN, f"{found}, cannot be written", remedy)
    return Finding(group, "cache", OK, found)


def _machine() -> Iterator[Finding]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    quota = _cgroup("cpu.max").split()
    share = int(quota[0]) / int(quota[1]) if len(quota) == 2 and quota[0].isdigit() else float(cores)
    if share < cores:
        remedy = f"use --workers {max(1, round(share))}"
        yield Finding("machine", "cores", WARN, f"{cores}, but no more than {share:g} at a time", remedy)
    else:
        yield Finding("machine", "cores", OK, str(cores))
    total, free = _memory()
    if total:
        found = f"{total / _GIB:.1f} GiB, {free / _GIB:.1f} free"
        few = free < _LEAST_MEMORY
        remedy = "use fewer --workers, and read large data as a folder of Parquet files" if few else ""
        yield Finding("machine", "memory", WARN if few else OK, found, remedy)


def _memory() -> tuple[float, float]:
    """What there is and what is free, in bytes; zeros where the system does not tell."""
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        total, free = (int(lines[key].split()[0]) * 1024.0 for key in ("MemTotal", "MemAvailable"))
    except (OSError, KeyError, ValueError):
        return 0.0, 0.0
    limit, used = _cgroup("memory.max"), _cgroup("memory.current")
    if limit.isdigit() and used.isdigit() and int(limit) < total:
        return float(limit), min(free, float(limit) - float(used))
    return total, free


def _cgroup(name: str) -> str:
    """What a container's limit says; empty where there is none."""
    try:
        return (Path("/sys/fs/cgroup") / name).read_text().strip()
    except OSError:
        return ""


def _storage() -> Iterator[Finding]:
    here, temporary = Path.cwd(), Path(tempfile.gettempdir())
    yield _folder("current folder", here, "choose another one with --out", required=False)
    yield _folder("temporary folder", temporary, "set TMPDIR to a folder that can be written", required=True)


def _folder(name: str, folder: Path, remedy: str, *, required: bool) -> Finding:
    """Whether a file can be written there, and how much room there is."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"tickwise")
        free = shutil.disk_usage(folder).free
    except OSError as error:
        found = f"{folder} cannot be written: {error.strerror}"
        return Finding("storage", name, BROKEN if required else WARN, found, remedy)
    if free < _LEAST_DISK:
        return Finding("storage", name, WARN, f"{folder}, {free / _GIB:.1f} GiB free", f"make room, or {remedy}")
    return Finding("storage", name, OK, f"{folder}, {free / _GIB:.1f} GiB free")


def _terminal() -> Iterator[Finding]:
    encoding = (sys.stdout.encoding or "").lower().replace("-", "")
    if encoding == "utf8":
        yield Finding("terminal", "encoding", OK, "UTF-8")
    else:
        remedy = "set PYTHONUTF8=1, or ρ and ◇ are printed as codes"
        yield Finding("terminal", "encoding", WARN, sys.stdout.encoding or "none", remedy)


def _tools() -> Iterator[Finding]:
    for name, (programs, use, package) in _TOOLS.items():
        path = next(filter(None, map(shutil.which, programs)), None)
        if path is None:
            yield Finding("optional", name, ABSENT, f"{use}: not found", f"install {package}, if you want that")
        else:
            yield Finding("optional", name, OK, _first_line(path, name) or path)


def _first_line(path: str, name: str) -> str:
    """What a program says of its version."""
    options = {"java": "-version", "dot": "-V"}
    run: Callable[..., subprocess.CompletedProcess[str]] = subprocess.run
    try:
        answer = run([path, options.get(name, "--version")], capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return ""
    lines = (answer.stdout or answer.stderr).strip().splitlines()
    return lines[0] if lines and answer.returncode == 0 else ""
