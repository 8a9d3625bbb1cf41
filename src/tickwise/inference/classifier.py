"""The estimator of the public surface, with scikit-learn's conventions but without importing scikit-learn."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tickwise._seeding import generator
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.exact import ExactSettings
from tickwise.inference.growth import infer_jointly
from tickwise.inference.objective import ClassWeight
from tickwise.inference.prior import BoxPrior, Prior
from tickwise.inference.readable import readable
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree, InferenceSettings, infer_tree, is_satisfying
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Verdict

SEARCHES = ("exact", "joint", "swarm")
"""How parameters may be searched."""


class MITLClassifier:
    """Learn the MITL formula that tells trajectories with label 1 from those with label -1 (Algorithm 1).

    It follows scikit-learn's conventions: parameters are stored as given and checked in `fit`, and it works with
    ``clone``, ``GridSearchCV`` and the like. ``X`` has three dimensions, so pipelines for tables do not apply.

    Attributes:
        formula_: The formula in SDNF; None if no leaf of the tree has label 1 (then all is predicted -1).
        tree_: The decision tree; None where all primitives were found together (``search="joint"``).
        classes_: The labels, ``[-1, 1]``.
        variables_: Names of the columns of ``X``.
        satisfying_: Whether the formula is a satisfying formula for the training data (Problem 1).
        gap_: How much better than the ones found the best primitives of the tree's nodes can be at most, in units of J;
            0 where they are proved to be the best, None where nothing is known.
        interrupted_: Whether Ctrl-C ended the search, and this is the best so far.
    """

    _estimator_type = "classifier"

    def __init__(
        self,
        size: int = 4,
        rate: float = 0.95,
        information_weight: float = 0.01,
        depth: int = 2,
        search: str = "exact",
        class_weight: ClassWeight = None,
        random_state: int = 0,
        variables: Sequence[str] | None = None,
        prior: Prior | None = None,
        space: SearchSpace | None = None,
        swarm: SwarmSettings | None = None,
        limits: ExactSettings | None = None,
    ) -> None:
        """Store the parameters.

        Args:
            size: ϱ_th, the most primitives of a satisfying formula.
            rate: ζ, the least classification rate of a satisfying formula.
            information_weight: λ, the weight of the information gain.
            depth: h_max, the tree's greatest depth.
            search: How parameters are searched: ``"exact"`` gives every node of the greedy tree its best primitive,
                with proof; ``"joint"`` finds all primitives of a formula together; ``"swarm"`` is the paper's.
            class_weight: None, ``"balanced"`` or a mapping from label to weight.
            random_state: The seed, a whole number of 0 or more.
            variables: Names of the columns of ``X``; ``x0, x1, …`` if None.
            prior: The prior of the information gain; if None, independent uniform draws over the data's range.
            space: What boxes and times may be chosen; if None, any over the data's range.
            swarm: How hard the swarm searches.
            limits: The limits of an exact search.
        """
        self.size = size
        self.rate = rate
        self.information_weight = information_weight
        self.depth = depth
        self.search = search
        self.class_weight = class_weight
        self.random_state = random_state
        self.variables = variables
        self.prior = prior
        self.space = space
        self.swarm = swarm
        self.limits = limits

    def get_params(self, deep: bool = True) -> dict[str, Any]:  # noqa: ARG002 (scikit-learn's signature)
        """The parameters by name."""
        return {name: getattr(self, name) for name in inspect.signature(type(self)).parameters}

    def set_params(self, **params: Any) -> MITLClassifier:
        """Set parameters by name.

        Raises:
            ConfigurationError: If there is no such parameter.
        """
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise ConfigurationError(f"there is no parameter {name!r}; use one of {', '.join(known)}")
            setattr(self, name, value)
        return self

    def __sklearn_tags__(self) -> Any:
        """What scikit-learn asks of an estimator; only scikit-learn calls this, so it is there to import."""
        tags = importlib.import_module("sklearn.utils")
        return tags.Tags(
            estimator_type="classifier",
            target_tags=tags.TargetTags(required=True),
            classifier_tags=tags.ClassifierTags(multi_class=False),
            input_tags=tags.InputTags(two_d_array=False, three_d_array=True),
        )

    def fit(self, X: ArrayLike | Sequence[ArrayLike], y: ArrayLike) -> MITLClassifier:
        """Infer a formula.

        Args:
            X: States, shape ``(n, ticks, variables)``, or a list of ``(ticks, variables)`` arrays.
            y: Labels 1 or -1, shape ``(n,)``.

        Returns:
            The fitted estimator itself.

        Raises:
            ConfigurationError: If a parameter is out of range.
            DataError: If the data is malformed, or has only one label.
        """
        if self.search not in SEARCHES:
            raise ConfigurationError(f"search is {self.search!r}; use {', '.join(map(repr, SEARCHES))}")
        if isinstance(self.random_state, bool) or not isinstance(self.random_state, (int, np.integer)):
            raise ConfigurationError(f"random_state is {self.random_state!r}; use a whole number of 0 or more")
        if self.random_state < 0:
            raise ConfigurationError(f"random_state is {self.random_state}; use a whole number of 0 or more")
        settings = InferenceSettings(self.size, self.rate, self.information_weight, self.depth, self.class_weight)
        data = LabelledTrajectories.from_arrays(X, y, self.variables).require_both_classes()
        space = SearchSpace.from_data(data) if self.space is None else self.space
        prior = self._box_prior(data, space) if self.prior is None else self.prior
        limits = ExactSettings() if self.limits is None else self.limits
        self.tree_: DecisionTree | None = None
        self.gap_: float | None = None
        found: SDNF | None
        if self.search == "joint":
            fit = infer_jointly(data, prior, space, settings, limits)
            self.interrupted_, found = fit.interrupted, fit.formula
        else:
            swarm = SwarmSettings() if self.swarm is None else self.swarm
            rng = generator(int(self.random_state), "inference")
            self.tree_ = infer_tree(data, prior, space, settings, limits if self.search == "exact" else swarm, rng)
            gaps = [node.gap for node in self.tree_.nodes() if node.gap is not None]
            self.gap_ = max(gaps, default=None)
            self.interrupted_ = self.tree_.interrupted
            found = self.tree_.formula
        self.formula_: SDNF | None = None if found is None else readable(found, data, space)
        self.satisfying_: bool = is_satisfying(self.formula_, data, settings)
        self.classes_ = np.array([-1, 1])
        self.variables_ = data.variables
        self.prior_: Prior = prior
        return self

    @staticmethod
    def _box_prior(data: LabelledTrajectories, space: SearchSpace) -> BoxPrior:
        ranges = {name: (edges[0], edges[-1]) for name, edges in zip(space.variables, space.edges, strict=True)}
        return BoxPrior(ranges, max(data.horizon, 1))

    def predict(self, X: ArrayLike | Sequence[ArrayLike]) -> NDArray[np.int64]:
        """Predict 1 where the formula's verdict is not FALSE, else -1.

        Args:
            X: States as in `fit`.

        Returns:
            Labels, shape ``(n,)``.

        Raises:
            DataError: If the estimator is not fitted, or the data is malformed.
        """
        if not hasattr(self, "formula_"):
            raise DataError("this MITLClassifier is not fitted yet; call fit first")
        data = LabelledTrajectories.from_arrays(X, np.ones(len(X)), self.variables_)  # type: ignore[arg-type]
        if self.formula_ is None:
            return np.full(len(data), -1)
        formula = self.formula_.formula
        verdicts = formula.verdict(data.values, variables=data.variables, lengths=data.lengths)
        return np.where(np.asarray(verdicts) != Verdict.FALSE, 1, -1)

    def score(self, X: ArrayLike | Sequence[ArrayLike], y: ArrayLike) -> float:
        """The classification rate on other data, every trajectory counting the same.

        Args:
            X: States as in `fit`.
            y: Labels 1 or -1, shape ``(n,)``.

        Returns:
            The rate in [0, 1].
        """
        return float(np.mean(self.predict(X) == np.asarray(y)))
