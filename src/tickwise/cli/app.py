"""The application that the commands belong to, and how their failures become one line and an exit status.

========  ==============================================================================================
status    meaning
========  ==============================================================================================
0         done
1         not done: bad input, a file that cannot be read or written, too little memory, nobody who takes
          the output; of ``doctor``: something that is required is broken
2         there is no such command line
3         a defect of Tickwise itself
130       Ctrl-C; what was found by then is printed, what was finished is kept
========  ==============================================================================================

Results go to standard output and nothing else does; messages, progress and errors go to standard error. Where standard
output is no terminal, a table is lines of cells with tabs between them.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from importlib.metadata import version as package_version
from pathlib import Path
from platform import python_version
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.text import Text

from tickwise._wording import reason
from tickwise.errors import TickwiseError

app = typer.Typer(
    name="tickwise",
    help="Learn when things must happen: MITL formulas, timed automata, and transfer in reinforcement learning.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
)

_PLAIN = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"
# no markup: formulas and file names are full of brackets
output = Console(soft_wrap=True, highlight=False, markup=False, emoji=False, color_system=None if _PLAIN else "auto")
# where colours are not wanted, lines that move are not either
messages = Console(
    stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False,
    color_system=None if _PLAIN else "auto", force_terminal=False if _PLAIN else None,
)  # fmt: skip

DONE, FAILED, MISUSED, DEFECT, INTERRUPTED = 0, 1, 2, 3, 130
"""The exit statuses; what each means is in the table above."""

# typer does not export the class of all errors in a command line, and has it from elsewhere in each version
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]

_log = logging.getLogger("tickwise.cli")

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
    except BrokenPipeError:  # of a help that nobody takes
        _drop_output()
        return FAILED
    return int(status or DONE)


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Turn expected failures into one line and an exit status: no traceback reaches a user."""

    @wraps(function)
    def run(*args: Any, **kwargs: Any) -> None:
        as_json = bool(kwargs.get("as_json"))
        began = time.monotonic()
        try:
            function(*args, **kwargs)
            sys.stdout.flush()
        except (typer.Exit, typer.Abort, _UsageError):
            raise
        except KeyboardInterrupt as interrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not disturb the way out
            with suppress(OSError):
                messages.print(str(interrupt) or "interrupted")
            raise typer.Exit(INTERRUPTED) from None
        except TickwiseError as error:
            _fail(str(error), as_json)
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(FAILED) from None
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            _fail(f"{where}{error.strerror or reason(error)}; check the path and the room on the disk", as_json)
        except MemoryError:
            _fail("out of memory; use fewer --workers, a smaller --depth or fewer trajectories", as_json)
        except Exception as error:
            _log.debug("the defect", exc_info=error)
            _fail(_defect(error), as_json, DEFECT)
        finally:
            _log.debug("%s took %.2f s, and %s", function.__name__, time.monotonic() - began, _memory())

    return run


def _defect(error: Exception) -> str:
    """What there is to say of an error that no one foresaw."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"{type(error).__name__}: {reason(error)} ({Path(place.filename).name}, line {place.lineno}); this is a defect "
        "of tickwise: report it with what tickwise --verbose says of the same command"
    )


def _fail(message: str, as_json: bool, status: int = FAILED) -> NoReturn:
    _tell(message, as_json)
    raise typer.Exit(status)


def _tell(message: str, as_json: bool) -> None:
    try:
        messages.print(Text.assemble(("error:", "bold red"), " ", message))
        if as_json:
            print_json({"error": message})
        sys.stdout.flush()
    except OSError:
        _drop_output()


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON document on a line."""
    print(json.dumps(document, ensure_ascii=False))


@contextmanager
def busy(text: str) -> Iterator[Callable[[str], None]]:
    """Show on a terminal that work goes on; gives what changes the text."""
    if not messages.is_terminal:
        yield lambda _: None
        return
    with messages.status(text) as status:
        yield lambda changed: status.update(changed)


def _drop_output() -> None:
    """Keep Python from complaining at exit about output that nobody can take."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            with suppress(OSError):
                os.dup2(nowhere, stream.fileno())


def _memory() -> str:
    from tickwise.experiments.memory import peak_memory_mib

    return f"{peak_memory_mib():.0f} MiB at the most"


class _Messages(logging.Handler):
    """Shows what is logged among the messages, above whatever moves there."""

    def emit(self, record: logging.LogRecord) -> None:
        """Show one record."""
        with suppress(OSError):
            messages.print(Text(self.format(record), style="dim"))


def _be_verbose(context: typer.Context) -> None:
    """Show what is logged until the command is over."""
    handler, logger = _Messages(), logging.getLogger("tickwise")
    handler.setFormatter(logging.Formatter("%(relativeCreated)7d ms  %(message)s"))
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)

    def undo() -> None:
        logger.removeHandler(handler)
        logger.setLevel(before)

    context.call_on_close(undo)
    _log.debug("tickwise %s, Python %s, %s", package_version("tickwise"), python_version(), sys.platform)


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"tickwise {package_version('tickwise')}")
        raise typer.Exit


@app.callback()
def _options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Say on standard error what is done and how long it takes.")
    ] = False,
) -> None:
    del version
    if verbose:
        _be_verbose(context)
