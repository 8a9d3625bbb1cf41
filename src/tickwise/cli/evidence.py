"""What the commands show of a formula on labelled trajectories: tables on a terminal, tab-separated lines elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tickwise.cli.app import output
from tickwise.cli.listing import show_rows
from tickwise.errors import ConfigurationError, DataError

if TYPE_CHECKING:
    from tickwise.inference.explanation import Confusion, Explanation
    from tickwise.inference.trajectories import LabelledTrajectories
    from tickwise.inference.validation import Validation

_MOST_LISTED = 20  # mistakes on a terminal; the page and JSON have all


def show_confusion(found: Confusion, title: str = "label") -> None:
    """Show how many trajectories of each label are predicted to have which."""
    rows = (
        ("1", str(found.true_positives), str(found.false_negatives)),
        ("-1", str(found.false_positives), str(found.true_negatives)),
    )
    show_rows((title, "predicted 1", "predicted -1"), rows, numbers=1)


def show_explanation(found: Explanation) -> None:
    """Show confusion, what each part separates, and the trajectories that are predicted wrongly."""
    show_confusion(found.confusion)
    if found.separations:
        several = len({separation.disjunct for separation in found.separations}) > 1
        header = ("part", "primitive", "keeps, alone", "reach it", "keeps", "removes")
        show_rows(
            header,
            (
                (
                    separation.name if several else str(separation.position), str(separation.formula),
                    *map(_pair, (separation.alone, separation.reaching, separation.keeping, separation.removing)),
                )
                for separation in found.separations
            ),
            numbers=2,
        )  # fmt: skip
        if output.is_terminal:
            output.print("+ counts trajectories with label 1, − those with label -1", style="dim")
    listed = found.mistakes[:_MOST_LISTED] if output.is_terminal else found.mistakes
    if listed:
        rows = ((each.id, str(each.label), str(each.predicted), each.why) for each in listed)
        show_rows(("misclassified", "label", "predicted", "why"), rows)
    if len(listed) < len(found.mistakes):
        output.print(f"and {len(found.mistakes) - len(listed)} more; --json and --page have all", style="dim")


def _pair(counts: tuple[int, int]) -> str:
    return f"{counts[0]}+ {counts[1]}−"


def show_validation(found: Validation) -> None:
    """Show the held-out error, what its interval is, and its confusion table."""
    output.print(found.sentence())
    output.print(f"({found.note})", style="dim")
    show_confusion(found.confusion, "label, held out")


def read_any(data: Path) -> tuple[LabelledTrajectories, bool]:
    """The trajectories, and whether they have labels."""
    from tickwise.inference.reading import read_trajectories

    try:
        return read_trajectories(data), True
    except DataError:  # where it is not for want of labels, this fails again
        return read_trajectories(data, labelled=False), False


def page_path(path: Path | None) -> Path | None:
    """Check where a page is to be written, before anything long is done.

    Raises:
        ConfigurationError: If it does not end in .html or its folder does not exist.
    """
    if path is None:
        return None
    if path.suffix.lower() not in (".html", ".htm"):
        raise ConfigurationError(f"the page {path} does not end in .html; use that ending")
    if not path.parent.is_dir():
        raise ConfigurationError(f"there is no folder {path.parent} for the page; make it, or choose another")
    return path


def write_page(path: Path, text: str) -> None:
    """Write a page, wholly or not at all."""
    from tickwise._files import write_bytes

    write_bytes(path, text.encode("utf-8"))
