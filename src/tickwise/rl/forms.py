"""The forms of learning by name, for what takes one as data: a study, the command line, a benchmark."""

from __future__ import annotations

from tickwise.errors import ConfigurationError
from tickwise.rl.actor_critic import ActorCritic
from tickwise.rl.counterfactual import Counterfactual
from tickwise.rl.learner import LearningForm, QLearning
from tickwise.rl.model import ModelBased
from tickwise.rl.shaping import Shaping
from tickwise.rl.trusting import Trusting

FORMS: dict[str, type[LearningForm]] = {
    "q": QLearning,
    "counterfactual": Counterfactual,
    "shaping": Shaping,
    "actor_critic": ActorCritic,
    "trusting": Trusting,
    "model": ModelBased,
}
"""The forms by name; the first is the paper's, and another may be added here.

A form is a frozen dataclass of plain settings with its name as the field ``form``, so that `dataclasses.asdict` tells
which form it is.
"""


def find_form(name: str) -> type[LearningForm]:
    """The form of a name.

    Args:
        name: What `dataclasses.asdict` of the form has under ``form``.

    Returns:
        The class, which called without arguments gives the measured settings.

    Raises:
        ConfigurationError: If there is none.
    """
    if name not in FORMS:
        raise ConfigurationError(
            f"there is no form of learning {name!r}; use {', '.join(FORMS)}, or add yours to FORMS"
        )
    return FORMS[name]
