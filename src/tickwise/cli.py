"""The command line: ``tickwise`` and ``python -m tickwise``."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import wraps
from importlib.metadata import version as package_version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tickwise.errors import ConfigurationError, TickwiseError

if TYPE_CHECKING:
    from tickwise.experiments.executors import Executor
    from tickwise.experiments.suites import Suite

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

Processes = Annotated[int | None, typer.Option(min=1, help="Processes (one a core).")]
Address = Annotated[str | None, typer.Option(metavar="ADDRESS", help="A Dask cluster that does the jobs.")]
JsonFlag = Annotated[bool, typer.Option("--json", help="Print one JSON document instead.")]
_COLUMNS = "long CSV, Parquet (columns trajectory, tick, the variables, label; also a folder), or NPZ (X, y, names)"
_PROTOCOL = "Whose formulas to learn with: paper (200 negatives, swarm) or full (all negatives, exact search)."


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


def _command(function: Callable[..., None]) -> Callable[..., None]:
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
            _print_json({"error": message})
        sys.stdout.flush()
    except OSError:
        _drop_output()


def _print_json(document: Mapping[str, Any]) -> None:
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


@app.command()
@_command
def reproduce(
    study: Annotated[str, typer.Argument(help="What: case1, case2, random (pairs of tasks), pair-07 (one), or all.")],
    runs: Annotated[int | None, typer.Option(min=1, help="Independent runs (10; 3 with --quick).")] = None,
    tasks: Annotated[int | None, typer.Option(min=1, help="Random pairs of tasks (50; 4 with --quick).")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer runs, episodes and tasks.")] = False,
    out: Annotated[Path | None, typer.Option(help="The run folder (runs/STUDY or runs/STUDY-quick).")] = None,
    workers: Processes = None,
    cluster: Address = None,
    seed: Annotated[int, typer.Option(min=0, help="The root seed.")] = 0,
    protocol: Annotated[str, typer.Option(help=_PROTOCOL)] = "paper",
) -> None:
    """Reproduce the paper's case studies, with a report; a second call goes on where the first one stopped.

    For example: tickwise reproduce case1 --quick --out runs/look
    """
    from tickwise.experiments.case_studies import find_study
    from tickwise.experiments.executors import executor
    from tickwise.experiments.progress import Display
    from tickwise.experiments.reproduce import reproduce_study
    from tickwise.experiments.suites import find_suite

    folder = out or Path("runs") / (f"{study}-quick" if quick else study)
    jobs = executor(workers, cluster)
    if study in ("random", "all"):
        _carry_out(find_suite(study, tasks=tasks, runs=runs, seed=seed, quick=quick, protocol=protocol), folder, jobs)
        return
    spec = find_study(study, quick=quick, runs=runs, seed=seed, protocol=protocol)
    if tasks is not None:
        raise ConfigurationError(f"{study} has no random tasks; leave --tasks out, or reproduce random or all")
    with _resumable(folder):
        summary = reproduce_study(spec, folder, jobs, Display(messages))
    _show(summary, folder)


def _carry_out(suite: Suite, folder: Path, jobs: Executor) -> None:
    """Do all that belongs to a suite, and show what it gave."""
    from tickwise.experiments.progress import Display
    from tickwise.experiments.reproduce import reproduce_suite

    with _resumable(folder):
        summary = reproduce_suite(suite, folder, jobs, Display(messages))
    _show(summary, folder)


@contextmanager
def _resumable(folder: Path) -> Iterator[None]:
    """Say on Ctrl-C that nothing is lost."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted; what is finished is kept in {folder}: run the same command again to go on"
        ) from None


def _show(summary: Mapping[str, Any], folder: Path) -> None:
    """What a run folder shows, and where its report is."""
    from tickwise.experiments.tables import study_tables, suite_tables

    tables = suite_tables if "suite" in summary else study_tables
    for table in tables(summary, folder):
        output.print(table)
    output.print(f"report: {folder / 'report.html'}")


@app.command()
@_command
def infer(
    data: Annotated[Path, typer.Argument(help=f"Labelled trajectories: {_COLUMNS}.")],
    size: Annotated[int, typer.Option(min=1, help="The most primitives, ϱ_th.")] = 4,
    rate: Annotated[float, typer.Option(help="The least classification rate, ζ.")] = 0.95,
    information_weight: Annotated[float, typer.Option(min=0, help="The weight of the information gain, λ.")] = 0.01,
    depth: Annotated[int, typer.Option(min=1, help="The depth of the decision tree, h_max.")] = 2,
    class_weight: Annotated[str | None, typer.Option(help="'balanced' lets both labels count the same.")] = None,
    search: Annotated[str, typer.Option(help="exact, joint (all primitives at once) or the paper's swarm.")] = "exact",
    seconds: Annotated[float | None, typer.Option(help="The most that one exact search may take.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="The seed of the swarm.")] = 0,
    as_json: JsonFlag = False,
) -> None:
    """Infer the formula that tells trajectories with label 1 from those with label -1.

    Ctrl-C ends an exact search with the best formula so far. For example: tickwise infer logs.csv --search joint
    """
    from tickwise.inference.classifier import MITLClassifier
    from tickwise.inference.exact import ExactSettings
    from tickwise.inference.information import information_gain
    from tickwise.inference.reading import read_trajectories
    from tickwise.inference.tree import classification_rate
    from tickwise.logic.render import to_english

    known = read_trajectories(data).require_both_classes()
    model = MITLClassifier(
        size=size, rate=rate, information_weight=information_weight, depth=depth, class_weight=class_weight,
        random_state=seed, variables=known.variables, search=search,
        limits=ExactSettings(seconds=seconds, threads=os.cpu_count() or 1),
    )  # fmt: skip
    began = time.monotonic()
    with messages.status("searching ...") if messages.is_terminal else nullcontext():
        model.fit([values[:length] for values, length in zip(known.values, known.lengths, strict=True)], known.labels)
    spent = time.monotonic() - began
    formula = model.formula_
    facts = {
        "formula": None if formula is None else str(formula),
        "classification_rate": classification_rate(formula, known),
        "information_gain": None if formula is None else information_gain(formula, model.prior_),
        "size": None if formula is None else formula.size,
        "satisfying": model.satisfying_,
        "seconds": round(spent, 3), "search": search, "gap": model.gap_, "interrupted": model.interrupted_,
    }  # fmt: skip
    if as_json:
        _print_json(facts)
    elif formula is None:
        output.print("no formula: no leaf of the decision tree has label 1; a greater --depth may help")
    else:
        output.print(facts["formula"])
        output.print(f"in words: {to_english(formula)}")
        output.print(
            f"classification rate {facts['classification_rate']:.4f}, information gain "
            f"{facts['information_gain']:.4f}, size {facts['size']}, "
            f"{'' if facts['satisfying'] else 'not '}satisfying (Problem 1), {spent:.1f} s"
        )
        if model.gap_ is not None:
            proved = model.gap_ <= 1e-12
            output.print("each node's best, proved" if proved else f"a node's J can be {model.gap_:.2g} better at most")
    if model.interrupted_:
        messages.print("interrupted: this is the best so far")
        raise typer.Exit(INTERRUPTED)


@app.command()
@_command
def check(
    formula: Annotated[str, typer.Argument(help="A formula, such as 'F[1,15] G[0,4] (x >= 3)'.")],
    data: Annotated[Path, typer.Argument(help=f"Trajectories, labels are not needed: {_COLUMNS}.")],
    as_json: JsonFlag = False,
) -> None:
    """Check a formula on every trajectory: verdict and robustness.

    For example: tickwise check 'G[0,26] (y >= 21)' logs.npz
    """
    import numpy as np

    from tickwise.inference.reading import read_trajectories
    from tickwise.logic.parse import parse
    from tickwise.logic.syntax import Verdict

    phi = parse(formula)
    known = read_trajectories(data, labelled=False)
    verdicts = phi.verdict(known.values, variables=known.variables, lengths=known.lengths)
    robustness = phi.robustness(known.values, variables=known.variables, lengths=known.lengths)
    rows = [
        (name, Verdict(int(verdict)).name.lower(), float(value) if np.isfinite(value) else None)
        for name, verdict, value in zip(known.ids, np.atleast_1d(verdicts), np.atleast_1d(robustness), strict=True)
    ]
    if as_json:
        keys = ("id", "verdict", "robustness")
        _print_json({"trajectories": [dict(zip(keys, row, strict=True)) for row in rows]})
    elif output.is_terminal:
        table = Table("trajectory", "verdict", "robustness")
        for name, shown, value in rows:
            table.add_row(name, shown, "" if value is None else f"{value:.6g}")
        output.print(table)
    else:
        for name, shown, value in rows:
            print(name, shown, "" if value is None else value, sep="\t")


@app.command()
@_command
def automaton(
    formula: Annotated[str, typer.Argument(help="A formula in sequential disjunctive normal form.")],
    format: Annotated[str, typer.Option(help="dot, json, mermaid or svg.")] = "dot",
) -> None:
    """Print the timed automaton of each sequential conjunctive subformula.

    For example: tickwise automaton 'F[1,15] G[0,4] (x >= 3)' --format mermaid
    """
    from tickwise.automata.build import timed_automata
    from tickwise.automata.interchange import EXPORTERS
    from tickwise.logic.parse import parse

    formats = (*EXPORTERS, "svg")
    if format not in formats:
        raise ConfigurationError(f"there is no format {format!r}; use one of {', '.join(formats)}")
    automata = timed_automata(parse(formula))
    if format == "svg":
        from tickwise.experiments.figures import draw_automata

        print(draw_automata(automata), end="")
        return
    texts = [each.to(format) for each in automata]
    if format == "json":
        print(json.dumps([json.loads(text) for text in texts], indent=1, ensure_ascii=False))
    else:
        print("\n".join(texts), end="")


@app.command()
@_command
def compare(
    source: Annotated[str, typer.Argument(help="A formula in sequential disjunctive normal form.")],
    target: Annotated[str, typer.Argument(help="Another one.")],
    as_json: JsonFlag = False,
) -> None:
    """Tell whether two formulas are structurally equivalent, and the second transferable from the first.

    For example: tickwise compare 'F[1,15] (x >= 3)' 'F[2,9] (y <= 1)'
    """
    from tickwise.logic.parse import parse
    from tickwise.logic.structure import structurally_equivalent, structurally_transferable, structure

    first, second = parse(source), parse(target)
    equivalent = structurally_equivalent(first, second)
    transferable = structurally_transferable(second, first)
    structures = {
        f"{name}_structure": [[str(operator) for operator in part] for part in structure(phi)]
        for name, phi in (("source", first), ("target", second))
    }
    if as_json:
        _print_json({"structurally_equivalent": equivalent, "structurally_transferable": transferable, **structures})
        return
    output.print(f"structurally equivalent: {'yes' if equivalent else 'no'}")
    output.print(f"target structurally transferable from source: {'yes' if transferable else 'no'}")
    for name, parts in structures.items():
        output.print(f"{name.replace('_', ' ')}: {' | '.join(' & '.join(part) for part in parts)}")


@app.command()
@_command
def report(
    folder: Annotated[Path, typer.Argument(help="A run folder that reproduce wrote.")],
) -> None:
    """Render the report of a finished run folder again.

    For example: tickwise report runs/case1
    """
    from tickwise.experiments.publish import republish

    _show(republish(folder), folder)


@app.command()
@_command
def effect(
    name: Annotated[str, typer.Argument(help="The setting, such as rate or tau; another word lists them all.")],
    study: Annotated[str | None, typer.Option(help="The study that it is measured on (the telling one).")] = None,
    runs: Annotated[int | None, typer.Option(min=1, help="Collections a value (3; 1 with --quick).")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few values.")] = False,
    out: Annotated[Path | None, typer.Option(help="The run folder (runs/effect-NAME).")] = None,
    workers: Processes = None,
    cluster: Address = None,
    seed: Annotated[int, typer.Option(min=0, help="The root seed.")] = 0,
) -> None:
    """Measure what a setting does, with a plot: inference, formulas and learning under several values of it.

    For example: tickwise effect rate --quick
    """
    from tickwise.experiments.executors import executor
    from tickwise.experiments.suites import effect_suite

    suite = effect_suite(name, study=study, runs=runs, seed=seed, quick=quick)
    folder = out or Path("runs") / (f"effect-{name}" + "-quick" * quick)
    _carry_out(suite, folder, executor(workers, cluster))
