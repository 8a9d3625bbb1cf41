"""The commands about studies: ``tickwise reproduce``, ``report`` and ``effect``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tickwise.cli import completion
from tickwise.cli.app import command, messages, output
from tickwise.cli.listing import show
from tickwise.errors import ConfigurationError

if TYPE_CHECKING:
    from tickwise.experiments.executors import Executor
    from tickwise.experiments.suites import Suite

Processes = Annotated[int | None, typer.Option(min=1, help="Processes (one a core).")]
Address = Annotated[str | None, typer.Option(metavar="ADDRESS", help="A Dask cluster that does the jobs.")]
_STUDY = "What: case1, case2, random (pairs of tasks), pair-07 (one), or all."
_EFFECT = "The setting, such as rate or tau; another word lists them all."
_EFFECT_STUDY = "The study that it is measured on (the telling one)."
_PROTOCOL = "Whose formulas to learn with: paper (200 negatives, swarm) or full (all negatives, exact search)."


@command
def reproduce(
    study: Annotated[str, typer.Argument(help=_STUDY, autocompletion=completion.studies)],
    runs: Annotated[int | None, typer.Option(min=1, help="Independent runs (10; 3 with --quick).")] = None,
    tasks: Annotated[int | None, typer.Option(min=1, help="Random pairs of tasks (50; 4 with --quick).")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer runs, episodes and tasks.")] = False,
    out: Annotated[Path | None, typer.Option(help="The run folder (runs/STUDY or runs/STUDY-quick).")] = None,
    workers: Processes = None,
    cluster: Address = None,
    seed: Annotated[int, typer.Option(min=0, help="The root seed.")] = 0,
    protocol: Annotated[str, typer.Option(help=_PROTOCOL, autocompletion=completion.protocols)] = "paper",
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
        show(table)
    output.print(f"report: {folder / 'report.html'}")


@command
def report(
    folder: Annotated[Path, typer.Argument(help="A run folder that reproduce wrote.")],
) -> None:
    """Render the report of a finished run folder again.

    For example: tickwise report runs/case1
    """
    from tickwise.experiments.publish import republish

    _show(republish(folder), folder)


@command
def effect(
    name: Annotated[str, typer.Argument(help=_EFFECT, autocompletion=completion.effects)],
    study: Annotated[str | None, typer.Option(help=_EFFECT_STUDY, autocompletion=completion.case_studies)] = None,
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
