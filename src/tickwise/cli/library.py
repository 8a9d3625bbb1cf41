"""The commands about libraries of learned tasks: ``tickwise library add``, ``list``, ``rank`` and ``transfer``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tickwise.cli import completion
from tickwise.cli.app import COLUMNS, JsonFlag, busy, command, output, print_json
from tickwise.cli.examples import described, epilog_of
from tickwise.cli.listing import show_rows
from tickwise.errors import ConfigurationError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tickwise.library.entry import Entry
    from tickwise.library.ranking import Ranked, Ranking
    from tickwise.library.target import Target

library = typer.Typer(
    help="Keep learned tasks in a folder, rank them for a new task, and transfer the best one's values.",
    epilog=epilog_of("library"),
    rich_markup_mode=None,
)

_NEW = "Add what a run folder of reproduce learned."
_OWN = "Add your own: its formula, with --q and --world."
_WORLD = "The world, as an NPZ file that write_world wrote."
_TRAJECTORIES = f"The new task's labelled trajectories: {COLUMNS}."
_SEARCH = "How formulas are fitted: by the paper's swarm, or exact."

Folder = Annotated[Path, typer.Argument(help="The library's folder.")]
Data = Annotated[Path, typer.Argument(help=_TRAJECTORIES)]
Study = Annotated[
    str | None,
    typer.Option(
        help="The study whose target task it is: case1, case2, pair-07.", autocompletion=completion.case_studies
    ),
]
World = Annotated[Path | None, typer.Option(metavar="FILE.npz", help=_WORLD)]
Horizon = Annotated[int | None, typer.Option(min=1, help="The last tick of an episode (with --world; the data's).")]
Size = Annotated[int | None, typer.Option(min=1, help="The most primitives, ϱ_th (the study's, or 4).")]
Rate = Annotated[float | None, typer.Option(help="The least classification rate, ζ (the study's, or 0.95).")]
Weight = Annotated[float | None, typer.Option(min=0, help="The weight of the information gain, λ (0.01).")]
Search = Annotated[str, typer.Option(help=_SEARCH)]
By = Annotated[
    str | None, typer.Option(help="rehearsal, promise, dissimilarity or distance.", autocompletion=completion.numbers)
]
Seed = Annotated[int, typer.Option(min=0, help="The seed of fits and rehearsals, and of a random pair.")]


@command
def add(
    folder: Folder,
    name: Annotated[str, typer.Argument(help="The name of the entry.")],
    run: Annotated[Path | None, typer.Option(metavar="FOLDER", help=_NEW)] = None,
    task: Annotated[str, typer.Option(help="Which task of the run: source or target.")] = "source",
    method: Annotated[str | None, typer.Option(help="What learned it (source; IV in the target).")] = None,
    formula: Annotated[str | None, typer.Option(help=_OWN)] = None,
    q: Annotated[Path | None, typer.Option("--q", metavar="FILE", help="The Q-function, as NPY or NPZ.")] = None,
    world: World = None,
    horizon: Annotated[int | None, typer.Option(min=1, help="The last tick of an episode (the formula's).")] = None,
    as_json: JsonFlag = False,
) -> None:
    """Add a learned task to a library, which is made where there is none.

    For example: tickwise library add tasks case1 --run runs/case1 --task source
    """
    from tickwise.library.folder import Library

    if (run is None) == (formula is None):
        raise ConfigurationError("give either --run, or --formula with --q and --world")
    if run is not None and any(each is not None for each in (q, world, horizon)):
        raise ConfigurationError("--q, --world and --horizon go with --formula; a run has its own")
    if (folder / "library.json").exists():
        Library.open(folder).require_free(name)
    entry = _learned(run, name, task, method) if run else _given(name, formula or "", q, world, horizon)
    kept = Library.open(folder, create=True)
    path = kept.add(entry)
    if as_json:
        print_json({"file": str(path), **_document(kept.manifest(name))})
    else:
        output.print(f"added {name} to {folder}: {entry.formula}")


def _learned(run: Path, name: str, task: str, method: str | None) -> Entry:
    from tickwise.experiments.learned import learned_entry

    return learned_entry(run, name, task, method)


def _given(name: str, formula: str, q: Path | None, world: Path | None, horizon: int | None) -> Entry:
    """An entry from files."""
    from tickwise.library.entry import Entry
    from tickwise.library.opening import read_array
    from tickwise.library.worlds import read_world
    from tickwise.logic.parse import parse
    from tickwise.logic.sdnf import to_sdnf

    if q is None or world is None:
        raise ConfigurationError(f"--formula needs --{'q' if q is None else 'world'} too")
    phi = to_sdnf(parse(formula))
    last = max(disjunct.primitives[-1].end for disjunct in phi.disjuncts)
    origin = {"method": "given", "q": str(q), "world": str(world)}
    return Entry(name, phi, read_world(world), horizon or max(last, 1), read_array(q, "q"), provenance=origin)


@command
def list_entries(folder: Folder, as_json: JsonFlag = False) -> None:
    """List what a library has, and where it is from.

    For example: tickwise library list tasks
    """
    from tickwise.library.folder import Library

    known = Library.open(folder)
    found = [_document(known.manifest(name)) for name in known.names()]
    if as_json:
        print_json({"folder": str(folder), "entries": found})
        return
    header = ("name", "from", "episodes", "mean return", "rate", "added", "formula")
    show_rows(header, (_row(each) for each in found))


def _document(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """What is told of an entry; its automata follow from the formula."""
    return {key: value for key, value in manifest.items() if key not in ("format", "version", "automata")}


def _row(entry: Mapping[str, Any]) -> tuple[str, ...]:
    facts, origin = entry["facts"], entry["provenance"]
    source = " ".join(str(origin[key]) for key in ("study", "task") if origin.get(key)) or origin.get("from")
    rest = (origin.get("episodes"), origin.get("mean_return"), facts.get("rate"))
    cells = ("" if each is None else f"{each:,.6g}" if isinstance(each, float) else f"{each:,}" for each in rest)
    return (
        entry["name"],
        str(source or origin.get("method", "")),
        *cells,
        str(origin.get("date", ""))[:10],
        entry["formula"],
    )


@command
def rank(
    folder: Folder,
    data: Data,
    study: Study = None,
    world: World = None,
    horizon: Horizon = None,
    size: Size = None,
    rate: Rate = None,
    information_weight: Weight = None,
    search: Search = "swarm",
    by: By = None,
    seed: Seed = 0,
    as_json: JsonFlag = False,
) -> None:
    """Rank what a library has by how promising a beginning it is for a new task.

    To each structure in the library a formula is fitted; entries whose structure does not fit are refused, with the
    reason. With --study or --world the task is rehearsed there: the entry is best whose values it is learned from in
    the fewest episodes, and where that is no gain over learning without them, a warning says so.
    For example: tickwise library rank tasks logs.npz --study case1
    """
    from tickwise.library.folder import Library
    from tickwise.library.standing import episodes

    known = Library.open(folder)
    target = _target(data, study, world, horizon, size, rate, information_weight, search, seed)
    found = _ranking([known.read(name) for name in known.names()], target, by)
    if as_json:
        print_json(_ranking_document(found))
        return
    if found.task is not None:
        output.print(f"task: {found.task.formula} (classification rate {found.task.rate:.4f})")
    if found.without is not None:
        took = episodes(found.without, found.goal.most)
        output.print(f"without transfer: {took} to {100 * found.goal.level:g} % of the best in a rehearsal")
    _warn(found)
    rows = [(each.entry.name, each.why, *_numbers(each)) for each in found.ranked]
    rows += [(each.entry.name, f"Refused: {each.why}", "", "", "", "") for each in found.refused]
    show_rows(("name", "why", "rehearsal", "promise", "dissimilarity", "distance"), rows, numbers=2)


@command
def transfer(
    folder: Folder,
    data: Data,
    out: Annotated[Path, typer.Argument(metavar="FILE.npz", help="Where to write the Q-function; JSON beside it.")],
    study: Study = None,
    world: World = None,
    entry: Annotated[str | None, typer.Option(help="The entry to transfer from (the best).")] = None,
    horizon: Horizon = None,
    size: Size = None,
    rate: Rate = None,
    information_weight: Weight = None,
    search: Search = "swarm",
    by: By = None,
    seed: Seed = 0,
    as_json: JsonFlag = False,
) -> None:
    """Transfer the Q-function of the best entry, or of a named one, to a new task, whose world has to be known.

    Where no gain is foreseen, it is transferred all the same, with a warning.
    Python goes on from it: tickwise.library.entry_files.read_entry("start.npz") has q and memory().
    For example: tickwise library transfer tasks logs.npz start.npz --study case1
    """
    from tickwise.library.entry import check_name
    from tickwise.library.entry_files import entry_paths, write_entry
    from tickwise.library.folder import Library
    from tickwise.library.handover import transfer as hand_over

    known = Library.open(folder)
    name = check_name(entry_paths(out)[0].stem)
    if study is None and world is None:
        raise ConfigurationError("values are transferred into a world; name it with --study or --world")
    sources = [known.read(each) for each in ([entry] if entry is not None else known.names())]
    target = _target(data, study, world, horizon, size, rate, information_weight, search, seed)
    found = _ranking(sources, target, by)
    best = found.best
    arrays, manifest = write_entry(out, hand_over(best.entry, best.fit, target, name))
    if as_json:
        print_json({"npz": str(arrays), "json": str(manifest), **_ranked_document(best), **_rehearsed_document(found)})
        return
    output.print(f"from {best.entry.name}: {best.fit.formula}")
    output.print(best.why)
    _warn(found)
    output.print(f"Q-function: {arrays}, with {manifest.name}")


def _target(
    data: Path,
    study: str | None,
    world: Path | None,
    horizon: int | None,
    size: int | None,
    rate: float | None,
    weight: float | None,
    search: str,
    seed: int,
) -> Target:
    """The new task."""
    from dataclasses import replace

    from tickwise.experiments.case_studies import find_study
    from tickwise.inference.exact import ExactSettings
    from tickwise.inference.reading import read_trajectories
    from tickwise.inference.swarm import SwarmSettings
    from tickwise.inference.tree import InferenceSettings
    from tickwise.library.target import Target
    from tickwise.library.worlds import read_world

    if study is not None and world is not None:
        raise ConfigurationError("--study and --world exclude each other; use one of them")
    if horizon is not None and world is None:
        raise ConfigurationError("--horizon goes with --world; a study has its own, and so have trajectories")
    if search not in ("swarm", "exact"):
        raise ConfigurationError(f"search is {search!r}; use 'swarm', 'exact'")
    spec = None if study is None else find_study(study, seed=seed)
    asked: dict[str, Any] = {"size": size, "rate": rate, "information_weight": weight}
    settings = replace(
        InferenceSettings() if spec is None else spec.inference,
        **{key: value for key, value in asked.items() if value is not None},
    )
    swarm = SwarmSettings() if spec is None else spec.swarm
    how = swarm if search == "swarm" else ExactSettings(threads=os.cpu_count() or 1)
    mdp = None if world is None else read_world(world)
    known = read_trajectories(data)
    if spec is not None:
        return Target.in_world(
            known, spec.target.mdp(), spec.target.task.deadline, settings, how,
            disjunct=spec.learning.disjunct, form=spec.learning.form("IV"), seed=seed,
        )  # fmt: skip
    if mdp is not None:
        return Target.in_world(known, mdp, horizon or known.horizon, settings, how, seed=seed)
    return Target.of_data(known, settings, how, seed=seed)


def _ranking(entries: Sequence[Entry], target: Target, by: str | None) -> Ranking:
    from tickwise.library.ranking import rank as ranked
    from tickwise.library.standing import ORDER

    order = ORDER if by is None else tuple(dict.fromkeys((by, *ORDER)))
    with busy("fitting formulas ...") as say:
        return ranked(entries, target, order, lambda what, done, of: say(f"{what} {done + 1} of {of} ..."))


def _warn(found: Ranking) -> None:
    if found.warning is not None:
        output.print(f"warning: {found.warning}")


def _numbers(each: Ranked) -> tuple[str, ...]:
    """The cells of an entry's numbers: whole episodes, and shares."""
    rehearsed, *shares = asdict(each.numbers).values()
    first = "" if rehearsed is None else f"{rehearsed:,.0f}"
    return (first, *("" if share is None else f"{share:.4f}" for share in shares))


def _ranked_document(each: Ranked) -> dict[str, Any]:
    return {
        "name": each.entry.name, "formula": str(each.entry.formula), "fitted": str(each.fit.formula),
        "rate": each.fit.rate, "gain": each.fit.gain, **asdict(each.numbers), "why": each.why,
        "provenance": dict(each.entry.provenance),
    }  # fmt: skip


def _rehearsed_document(found: Ranking) -> dict[str, Any]:
    """What the first entry's rehearsal is held against."""
    goal = found.goal
    return {"without": found.without, "level": goal.level, "most": goal.most, "warning": found.warning}


def _ranking_document(found: Ranking) -> dict[str, Any]:
    task = found.task
    return {
        "task": None if task is None else {"formula": str(task.formula), "rate": task.rate, "gain": task.gain},
        "order": list(found.order),
        **_rehearsed_document(found),
        "ranked": [_ranked_document(each) for each in found.ranked],
        "refused": [
            {"name": each.entry.name, "formula": str(each.entry.formula), "why": each.why} for each in found.refused
        ],
    }


for _name, _each in (("add", add), ("list", list_entries), ("rank", rank), ("transfer", transfer)):
    library.command(_name, **described(_each, f"library {_name}"))(_each)
