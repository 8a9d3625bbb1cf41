"""Tell anomalous vessels from normal ones: ten-fold cross-validation on the naval surveillance data.

The data are 2,000 simulated trajectories of vessels (x and y in decametres, 61 samples, one every 5 s), half of them
anomalous (Kong, Jones and Belta, 2014). The folds are those of the data's own permutation. Each formula is inferred on
nine folds and judged on the tenth.

    python examples/naval.py DATA/naval.npz

The command line does the same on folds of its own, once the data have the form that it reads:

    python examples/naval.py DATA/naval.npz --export vessels.npz
    tickwise infer vessels.npz --search joint --size 3 --rate 1 --information-weight 0 --levels 16 --folds 10
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import tickwise as tw
from tickwise.inference.exact import ExactSettings
from tickwise.inference.reading import write_npz

FOLDS = 10


def folds(path: Path) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """For each fold the states and labels to learn from, then those to judge on."""
    with np.load(path) as file:
        states, labels, order = file["X"].transpose(0, 2, 1), file["y"], file["lltinf_perm"]
    order = order - order.min()
    parts = np.split(order, FOLDS)
    rests = [np.setdiff1d(order, part) for part in parts]
    return [(states[rest], labels[rest], states[part], labels[part]) for rest, part in zip(rests, parts, strict=True)]


def vessels(path: Path) -> tw.LabelledTrajectories:
    """All trajectories; label 1 is a normal vessel."""
    with np.load(path) as file:
        return tw.LabelledTrajectories.from_arrays(file["X"].transpose(0, 2, 1), file["y"], ("x", "y"))


def model(threads: int) -> tw.MITLClassifier:
    """The joint mode of Algorithm 1; with λ = 0 the formula with the fewest errors, and of these the simplest."""
    limits = ExactSettings(levels=16, threads=threads)
    return tw.MITLClassifier(
        size=3, rate=1.0, information_weight=0.0, search="joint", variables=("x", "y"), limits=limits
    )


def main() -> None:
    """Print each fold's formula, held-out error and time, and their means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="the file naval.npz")
    parser.add_argument("--threads", type=int, default=2, help="threads of each search")
    parser.add_argument("--export", type=Path, metavar="OUT.npz", help="write the data for tickwise infer, no more")
    arguments = parser.parse_args()
    if arguments.export:
        write_npz(arguments.export, vessels(arguments.data))
        return
    errors, seconds, sizes = [], [], []
    for number, (states, labels, other, truth) in enumerate(folds(arguments.data)):
        began = time.perf_counter()
        fitted = model(arguments.threads).fit(states, labels)
        seconds.append(time.perf_counter() - began)
        errors.append(1 - fitted.score(other, truth))
        sizes.append(fitted.formula_.size if fitted.formula_ else 0)
        print(f"fold {number}: held-out error {errors[-1]:.2%}, {seconds[-1]:.1f} s, {fitted.formula_}", flush=True)
    print(f"mean held-out error {np.mean(errors):.2%}, largest size {max(sizes)}, {sum(seconds):.1f} s in all")


if __name__ == "__main__":
    main()
