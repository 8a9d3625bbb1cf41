"""The application that the commands belong to, and how their failures become one line and an exit status."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from importlib.metadata import version as package_version
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.text import Text

from tickwise.errors import TickwiseError

app = typer.Typer(
    name="tickwise",
    help="Learn when things must happen: MITL formulas, timed automata, and transfer in reinforcement learning.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

# no markup: formulas and file names are full of brackets
output = Console(soft_wrap=True, highlight=False, markup=False, emoji=False)
messages = Console(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False)

FAILED, MISUSED, INTERRUPTED = 1, 2, 130
"""Exit statuses: something that the message names went wrong; no such command line; Ctrl-C."""

# typer does not export the class of all errors in a command line, and has it from elsewhere in each version
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]

JsonFlag = Annotated[bool, typer.Option("--json", help="Print one JSON document instead.")]
COLUMNS = "long CSV, Parquet (columns trajectory, tick, the variables, label; also a folder), or NPZ (X, y, names)"
"""What the help says of data files."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: What stands after ``tickwise``; by default that of the process.

    Returns:
        The exit status.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a narrow encoding must not make printing fail
            stream.reconfigure(errors="backslashreplace")
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        status = app(given or ["--help"], prog_name="tickwise", standalone_mode=False)
    except _UsageError as error:
        context = getattr(error, "ctx", None)
        where = "tickwise" if context is None else context.command_path
        message = error.format_message().rstrip(".")  # type: ignore[attr-defined]
        _tell(f"{message}; see {where} --help", as_json="--json" in given)
        return MISUSED
    return int(status or 0)


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Turn expected failures into one line and an exit status: no traceback reaches a user."""

    @wraps(function)
    def run(*args: Any, **kwargs: Any) -> None:
        as_json = bool(kwargs.get("as_json"))
        try:
            function(*args, **kwargs)
            sys.stdout.flush()
        except KeyboardInterrupt as interrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not disturb the way out
            messages.print(str(interrupt) or "interrupted")
            raise typer.Exit(INTERRUPTED) from None
        except TickwiseError as error:
            _fail(str(error), as_json)
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(FAILED) from None
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            _fail(f"{where}{error.strerror or error}; check the path and the room on the disk", as_json)
        except MemoryError:
            _fail("out of memory; use fewer --workers, a smaller --depth or fewer trajectories", as_json)

    return run


def _fail(message: str, as_json: bool) -> NoReturn:
    _tell(message, as_json)
    raise typer.Exit(FAILED)


def _tell(message: str, as_json: bool) -> None:
    messages.print(Text.assemble(("error:", "bold red"), " ", message))
    try:
        if as_json:
            print_json({"error": message})
        sys.stdout.flush()
    except OSError:
        _drop_output()


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON document on a line."""
    print(json.dumps(document, ensure_ascii=False))


def _drop_output() -> None:
    """Keep Python from complaining at exit about output that nobody can take."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"tickwise {package_version('tickwise')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    del version
