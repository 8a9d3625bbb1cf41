"""The estimator of the public surface, with scikit-learn's conventions but without importing scikit-learn."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tickwise._seeding import generator
from tickwise._wording import brief
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.exact import ExactSettings
from tickwise.inference.frames import is_frame, split_frame
from tickwise.inference.growth import infer_jointly
from tickwise.inference.objective import ClassWeight
from tickwise.inference.prior import Prior
from tickwise.inference.readable import readable
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree, InferenceSettings, infer_tree, is_satisfying
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Verdict

SEARCHES = ("exact", "joint", "swarm")
"""How parameters may be searched."""

States: TypeAlias = ArrayLike | Sequence[ArrayLike] | Any
"""An array ``(n, ticks, variables)``, a list of ``(ticks, variables)`` arrays, or a data frame in long form."""


class MITLClassifier:
    """Learn the MITL formula that tells trajectories of one label from those of another (Algorithm 1).

    It follows scikit-learn's conventions: parameters are stored as given and checked in `fit`, what is learned ends in
    an underscore, and it works with ``clone``, ``cross_val_score``, ``GridSearchCV``, and as the last step of a
    ``Pipeline``. ``X`` has three dimensions, so the other steps of a pipeline must take and give such arrays.

    A data frame in long form has the columns ``trajectory, tick, <variables…>`` and perhaps ``label``, one row a tick;
    ``y`` may then be left out. scikit-learn would split it between rows, so give its searches an array.

    Attributes:
        formula_: The formula in SDNF; None if no leaf of the tree has the positive label (then all is predicted to have
            the other one).
        tree_: The decision tree; None where all primitives were found together (``search="joint"``).
        classes_: The two labels in ascending order.
        positive_: The label that the formula describes, 1 in the tree and in Problem 1.
        variables_: Names of the columns of ``X``.
        n_features_in_: How many there are.
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
        positive: Any = None,
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
            positive: The label that the formula describes; the greater of the two if None (so ``1`` of 1 and -1, and
                ``"ok"`` of ``"ok"`` and ``"faulty"``).
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
        self.positive = positive

    def __repr__(self) -> str:
        defaults = inspect.signature(type(self)).parameters
        given = [
            f"{name}={value!r}" for name, value in self.get_params().items() if value is not defaults[name].default
        ]
        return f"{type(self).__name__}({', '.join(given)})"

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

    def fit(self, X: States, y: ArrayLike | None = None) -> MITLClassifier:
        """Infer a formula.

        Args:
            X: States, shape ``(n, ticks, variables)``, a list of ``(ticks, variables)`` arrays, or a data frame in long
                form.
            y: Labels of two kinds, such as 1 and -1 or texts, shape ``(n,)``; of a data frame by default its column
                ``label``.

        Returns:
            The fitted estimator itself.

        Raises:
            ConfigurationError: If a parameter is out of range.
            DataError: If the data is malformed, or has not two labels.
        """
        self._check_parameters()
        states, labels = _split(X, y)
        classes, positive = _classes(labels, self.positive)
        data = self._trajectories(states, np.where(labels == positive, 1, -1), self.variables)
        weight = _signed_weight(self.class_weight, classes, positive)
        settings = InferenceSettings(self.size, self.rate, self.information_weight, self.depth, weight)
        space = SearchSpace.from_data(data) if self.space is None else self.space
        prior = space.box_prior(data.horizon) if self.prior is None else self.prior
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
        self.classes_, self.positive_ = classes, positive
        self.variables_ = data.variables
        self.n_features_in_ = len(data.variables)
        self.prior_: Prior = prior
        return self

    def _check_parameters(self) -> None:
        if self.search not in SEARCHES:
            raise ConfigurationError(f"search is {self.search!r}; use {', '.join(map(repr, SEARCHES))}")
        if isinstance(self.random_state, bool) or not isinstance(self.random_state, (int, np.integer)):
            raise ConfigurationError(f"random_state is {self.random_state!r}; use a whole number of 0 or more")
        if self.random_state < 0:
            raise ConfigurationError(f"random_state is {self.random_state}; use a whole number of 0 or more")

    @staticmethod
    def _trajectories(states: Any, labels: NDArray[np.int64], variables: Sequence[str] | None) -> LabelledTrajectories:
        if not isinstance(states, LabelledTrajectories):
            return LabelledTrajectories.from_arrays(states, labels, variables)
        names = states.variables if variables is None else tuple(variables)
        columns = [states.variables.index(name) for name in names if name in states.variables]
        if len(columns) < len(names):
            missing = next(name for name in names if name not in states.variables)
            raise DataError(f"the data frame has no column {missing!r}; it has {', '.join(states.variables)}")
        return LabelledTrajectories(
            states.values[..., columns], states.lengths, labels.astype(np.int8), names, states.ids
        )

    def predict(self, X: States) -> NDArray[Any]:
        """Predict the positive label where the formula's verdict is not FALSE, else the other one.

        Args:
            X: States as in `fit`.

        Returns:
            Labels, shape ``(n,)``; of a data frame in the order of the trajectories' first rows.

        Raises:
            DataError: If the estimator is not fitted, or the data is malformed.
        """
        if not hasattr(self, "formula_"):
            raise DataError("this MITLClassifier is not fitted yet; call fit first")
        states, _ = _split(X, None, needed=False)
        data = self._trajectories(states, np.ones(len(states), dtype=np.int64), self.variables_)
        kept = np.zeros(len(data), dtype=np.bool_)
        if self.formula_ is not None:
            formula = self.formula_.formula
            verdicts = formula.verdict(data.values, variables=data.variables, lengths=data.lengths)
            kept = np.asarray(verdicts) != Verdict.FALSE
        positive = int(np.flatnonzero(self.classes_ == self.positive_)[0])
        predicted: NDArray[Any] = self.classes_[np.where(kept, positive, 1 - positive)]
        return predicted

    def score(self, X: States, y: ArrayLike | None = None, sample_weight: ArrayLike | None = None) -> float:
        """The classification rate on other data.

        Args:
            X: States as in `fit`.
            y: Labels as in `fit`, shape ``(n,)``.
            sample_weight: What each trajectory counts, shape ``(n,)``; all the same if None.

        Returns:
            The rate in [0, 1].

        Raises:
            DataError: If the estimator is not fitted, or the data is malformed.
        """
        predicted = self.predict(X)
        _, labels = _split(X, y)
        return float(
            np.average(
                predicted == labels, weights=None if sample_weight is None else np.asarray(sample_weight, dtype=float)
            )
        )


def _split(X: States, y: ArrayLike | None, *, needed: bool = True) -> tuple[Any, NDArray[Any]]:
    """The states, those of a data frame as trajectories, and the labels."""
    states: Any
    states, own = split_frame(X) if is_frame(X) else (X, None)
    if not hasattr(states, "__len__"):
        raise DataError(f"the trajectories are {brief(states)}; give an array, or a list of arrays")
    if len(states) == 0:
        raise DataError("there is no trajectory; give at least one")
    if y is None and own is None:
        if needed:
            where = "; give y, or a data frame with a column 'label'" if is_frame(X) else "; give y"
            raise DataError(f"there are no labels{where}")
        return states, np.zeros(0)
    labels = np.asarray(own if y is None else y)
    if labels.shape != (len(states),):
        raise DataError(
            f"labels have shape {labels.shape} for {len(states)} trajectories; give one label per trajectory"
        )
    return states, labels


def _classes(labels: NDArray[Any], positive: Any) -> tuple[NDArray[Any], Any]:
    """The two labels in ascending order, and the one that the formula is to describe."""
    try:
        classes = np.unique(labels)
    except TypeError:
        raise DataError("the labels are of several types; use two numbers or two texts") from None
    if classes.dtype.kind == "f" and np.isnan(classes).any():
        raise DataError("a label is NaN; fill it in")
    shown = ", ".join(map(repr, classes[:5].tolist())) + ", …" * (len(classes) > 5)
    if len(classes) > 2:
        raise DataError(f"there are {len(classes)} different labels, {shown}; use two")
    if len(classes) == 1 and classes[0] in (1, -1):
        raise DataError(f"no trajectory has label {-int(classes[0])}; give trajectories of both labels, 1 and -1")
    if len(classes) < 2:
        raise DataError(f"there is only one label, {shown}; give trajectories of two")
    if positive is not None and positive not in classes.tolist():
        raise ConfigurationError(f"positive is {positive!r}, which no trajectory has as its label; use one of {shown}")
    return classes, classes[1] if positive is None else positive


def _signed_weight(weight: Any, classes: NDArray[Any], positive: Any) -> ClassWeight:
    """Class weights by 1 and -1, as the search has the labels."""
    if not isinstance(weight, Mapping):
        return weight  # type: ignore[no-any-return]
    known = classes.tolist()
    for label in weight:
        if label not in known:
            raise ConfigurationError(f"class_weight has label {label!r}; use {' and '.join(map(repr, known))}")
    return {1 if label == positive else -1: value for label, value in weight.items()}
