"""Controls towards a feature, by a linear model of the dynamics that transitions have shown."""

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array

HORIZONS = (1, 2, 3, 4, 6, 8, 12, 16)
"""For how many steps a control may be held, as far as the model looks ahead."""
NEAR = 0.5
"""Bins from the target at which a control is good enough."""


class Steering:
    """Chooses controls by s' = A s + B u + c, fitted to transitions by least squares.

    The control is the one that, held for the fewest steps, brings the feature next to the target; where none does, the
    one that brings it nearest. It is a guess, right for points and double integrators, wrong for other dynamics: it has
    to be tried in the environment.

    Args:
        model: The environment: its features, bins and bounds of controls.
        states: States [N, D].
        controls: The controls [N, A] that were applied.
        after: What they led to [N, D].
    """

    def __init__(self, model: ResettableModel, states: Array, controls: Array, after: Array):
        self._low, self._high = model.action_low, model.action_high
        self._centre = (self._low + self._high) / 2.0
        size = states.shape[1]
        step = _fit(np.hstack([states, controls]), after)  # [D + A + 1, D]
        whole = _fit(states, model.feature(states) / model.bin_size)  # [D + 1, F]
        of_state, of_control, rest = step[:size], step[size:-1], step[-1]
        free, gain, shift = np.eye(size), np.zeros((len(self._low), size)), np.zeros(size)
        chosen: list[tuple[Array, Array, Array]] = []
        for held in range(1, HORIZONS[-1] + 1):
            free, gain, shift = free @ of_state, gain @ of_state + of_control, shift @ of_state + rest
            if held in HORIZONS:
                chosen.append((free @ whole[:-1], gain @ whole[:-1], shift @ whole[:-1] + whole[-1]))
        self._free, self._gain, self._shift = (np.array(part) for part in zip(*chosen, strict=True))
        self._inverse = np.linalg.pinv(np.nan_to_num(self._gain))  # [H, F, A]

    def control(self, state: Array, target: Array) -> Array:
        """Return the control [A] from a state [D] towards a feature in bins [F]."""
        missing = target - (state @ self._free + self._shift) - self._centre @ self._gain  # [H, F]
        controls = np.clip(self._centre + np.einsum("hf,hfa->ha", missing, self._inverse), self._low, self._high)
        left = np.abs(missing - np.einsum("ha,haf->hf", controls - self._centre, self._gain)).max(axis=1)
        near = left < NEAR
        best: Array = controls[int(near.argmax()) if near.any() else int(np.nan_to_num(left, nan=np.inf).argmin())]
        return best


def _fit(inputs: Array, outputs: Array) -> Array:
    """Return W [I + 1, O] with outputs ~ [inputs, 1] W, by least squares on scaled columns."""
    centre, scale = inputs.mean(axis=0), inputs.std(axis=0)
    scale[scale < 1e-12] = 1.0
    ones = np.ones((len(inputs), 1))
    weights = np.linalg.lstsq(np.hstack([(inputs - centre) / scale, ones]), outputs, rcond=1e-10)[0]
    factors = weights[:-1] / scale[:, None]
    return np.vstack([factors, weights[-1] - centre @ factors])
