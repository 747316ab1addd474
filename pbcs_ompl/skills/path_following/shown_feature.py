"""How an observation shows the feature: as entries, or an angle by its cosine and sine."""

import inspect
import json
from dataclasses import dataclass
from typing import Self

import numpy as np

from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.errors import Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.sampling import random_walk

WALK = 20
"""Steps of the random walk that shows whether the feature is observed."""
TOLERANCE = 1e-5
"""Largest difference between a feature and what the observation shows of it, relative to its size."""
NO_SINE = -1
HIDES_POSITION = "exclude_current_positions_from_observation"
"""The option of Gymnasium's robots that leaves their place out of the observation; it is on unless given."""


@dataclass(frozen=True, eq=False)
class ShownFeature:
    """Where in an observation each dimension of the feature stands.

        f_k(o) = o[entries_k], and arctan2(o[sines_k], o[entries_k]) where there is a sine

    Attributes:
        entries: An entry for each dimension [F]; of an angle that is shown by cosine and sine, that of the cosine.
        sines: The entries of the sines [F]; `NO_SINE` for what is no such angle.
    """

    entries: IndexArray
    sines: IndexArray

    @classmethod
    def plain(cls, entries: IndexArray) -> Self:
        """Return a feature that is entries of the observation [F]."""
        return cls(entries, np.full(len(entries), NO_SINE))

    @classmethod
    def of(cls, model: ResettableModel, states: Array, observations: Array) -> Self:
        """Return where the observation shows the feature.

        Args:
            model: It knows features.
            states: [N, D].
            observations: Those of the states [N, O].

        Raises:
            Mismatch: it does not show a dimension of the feature.
        """
        found = []
        for dimension, values in enumerate(model.feature(states).T):
            place = _place(values, observations)
            if place is None:
                raise Mismatch(
                    f"{model.spec.id}: dimension {dimension} of the feature is no entry of the observation, nor an "
                    "angle whose cosine and sine are, so a controller of observations cannot know where it is on the "
                    f"line; {how_to_show(model)}, or use another method than follow")
            found.append(place)
        entries, sines = np.array(found, dtype=np.int64).T
        return cls(entries, sines)

    def __call__(self, observations: Array) -> Array:
        """Return the features [B, F] that observations [B, O] show; angles shown by cosine and sine within a turn."""
        shown: Array = observations[:, self.entries]
        angles = self.sines != NO_SINE
        shown[:, angles] = np.arctan2(observations[:, self.sines[angles]], shown[:, angles])
        return shown

    def periods(self, declared: Array) -> Array:
        """Return the period of each dimension as observations show it [F], 0 for none.

        Cosine and sine show any angle within a turn only, also one that is declared without a period, such as that of a
        joint whose soft limits let it pass half a turn.

        Args:
            declared: The period of each dimension of the feature [F], 0 for none.
        """
        return np.where(self.sines == NO_SINE, declared, 2.0 * np.pi)

    def moved(self, observations: Array, shifts: Array) -> Array:
        """Return observations [B, O] of which the entries that are the feature are larger by `shifts` [B, F].

        Cosines and sines stay as they are: shifts are whole turns.
        """
        plain, moved = self.sines == NO_SINE, observations.copy()
        moved[:, self.entries[plain]] += shifts[:, plain]
        return moved


def _place(values: Array, observations: Array) -> tuple[int, int] | None:
    """Return the entry that shows some values [N] in observations [N, O], or the cosine and the sine that do."""
    tolerance = TOLERANCE * max(1.0, float(np.abs(values).max()))
    errors = np.abs(observations - values[:, None]).max(axis=0)
    if errors.min() <= tolerance:
        return int(errors.argmin()), NO_SINE
    cosine, sine = (int(np.abs(observations - shown[:, None]).max(axis=0).argmin())
                    for shown in (np.cos(values), np.sin(values)))
    away = np.arctan2(observations[:, sine], observations[:, cosine]) - values
    away -= 2.0 * np.pi * np.rint(away / (2.0 * np.pi))
    lengths = np.hypot(observations[:, sine], observations[:, cosine])
    return (cosine, sine) if max(np.abs(away).max(), np.abs(lengths - 1.0).max()) <= tolerance else None


def how_to_show(model: ResettableModel) -> str:
    """Return what to do so that observations show what is explored."""
    known = inspect.signature(type(getattr(model.env, "inner", model.env)).__init__).parameters
    if HIDES_POSITION in known and model.spec.kwargs.get(HIDES_POSITION, True):
        return f"let the robot observe its place, --env-kwargs '{json.dumps({HIDES_POSITION: False})}'"
    return f"explore entries of the observation, such as --feature 'obs[0:{min(3, model.observation_size)}]'"


def observes_feature(model: ResettableModel) -> bool:
    """Return whether observations show every dimension of the feature, in states of a short random walk.

    Raises:
        CallbackFailed: the environment raised.
    """
    with code_of_others("the environment"):
        states = random_walk(model, WALK, np.random.default_rng(0))
        observations = model.observe(states)
    try:
        ShownFeature.of(model, states, observations)
    except Mismatch:
        return False
    return True
