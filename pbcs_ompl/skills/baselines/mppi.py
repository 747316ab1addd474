"""Sampling model-predictive control along a plan: path integrals over rollouts of the simulator."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.resettable.actions import Actions
from pbcs_ompl.skills.baselines.deviation import Deviation
from pbcs_ompl.skills.settings import Settings
from pbcs_ompl.skills.side_by_side import SideBySide
from pbcs_ompl.skills.trained_controller import actions_of

FAILED = 1e3
"""Cost of a rollout that the environment ends without success."""


@dataclass(frozen=True)
class MPPISettings(Settings):
    """How many futures are tried, and how they are weighed.

    Attributes:
        samples: Sequences of controls that are tried in each step (ours).
        horizon: Their length in steps (ours).
        disturbance: Standard deviation of their controls, in half-widths of the action box (ours).
        temperature: The weight of a sequence falls by a factor e for each such difference of costs; squared deviations
            of observations, in their standard deviations along the plan, are summed over the horizon (ours).
        window: Steps of the plan that an execution may advance in one step of its own; it may also wait (ours).
    """

    samples: int = 64
    horizon: int = 15
    disturbance: float = 0.4
    temperature: float = 0.05
    window: int = 4

    def _check_ranges(self) -> None:
        self._check_counts("samples", "horizon", "window")
        self._check_positive("disturbance", "temperature")


class MPPIController(SideBySide):
    """Tries disturbed sequences of controls in the simulator, and makes the first step of their weighted mean.

    It drives one episode at a time, and is privileged: it reads the simulator's state.

    Source: Williams et al. 2017, Information-theoretic MPC. Differs: sequences are disturbed around the last solution,
    beyond its end around the plan, and the cost is the distance from the plan; the plan's own controls and the
    undisturbed sequence are among the samples; disturbances cost nothing by themselves.

    Args:
        model: The simulator; not the environment that is driven.
        trajectory: The plan.
        read_state: Returns the state [D] of the environment that is driven.
        settings: None for the defaults.
        rng: Source of disturbances.
        counter: Counts every transition of the simulator.
    """

    def __init__(self, model: ResettableModel, trajectory: Trajectory, read_state: Callable[[], Array],
                 settings: MPPISettings | None = None, *, rng: np.random.Generator | None = None,
                 counter: Counter | None = None):
        self._model, self._read_state, self._settings = model, read_state, settings or MPPISettings()
        self._rng, self.counter = rng or np.random.default_rng(0), counter or Counter()
        self._controls, self._actions = trajectory.controls, actions_of(model)
        self._observations = model.observe(trajectory.states)
        self._deviation = Deviation.along(self._observations)
        self.reset()

    def _begin(self, count: int) -> None:
        if count != 1:
            raise InvalidOption(f"{count} episodes side by side; model-predictive control reads one state at a time")
        self._step = -1
        self._solution = self._planned(0)

    def _act(self, observations: Array, members: IndexArray) -> Actions:
        settings = self._settings
        self._step = 0 if self._step < 0 else self._nearest(observations)
        planned = self._planned(self._step)
        self._solution = np.concatenate([self._solution[1:], planned[-1:]])
        tried = self._tried(planned)
        costs = self._costs(self._read_state(), tried)
        self._solution = weighted_mean(tried, costs, settings.temperature)
        return self._actions.to_actions(self._solution[:1])

    def _nearest(self, observations: Array) -> int:
        """Return the step of the plan that is nearest, the last of equal ones: a plan may stand still."""
        ahead = np.arange(self._step, min(self._step + self._settings.window, len(self._observations) - 1) + 1)[::-1]
        squares = (self._deviation(observations, self._observations[ahead]) ** 2).sum(axis=1)
        return int(ahead[squares.argmin()])

    def _planned(self, step: int) -> Array:
        """Return the plan's controls from a step on [H, A]; beyond its end, the last one."""
        return self._controls[np.minimum(step + np.arange(self._settings.horizon), len(self._controls) - 1)]

    def _tried(self, planned: Array) -> Array:
        """Return the sequences that are tried [N, H, A]."""
        settings, low, high = self._settings, self._model.action_low, self._model.action_high
        shape = (settings.samples, settings.horizon, len(low))
        noise = settings.disturbance * (high - low) / 2.0 * self._rng.standard_normal(shape)
        tried = self._solution + noise
        tried[0] = self._solution
        tried[-1] = planned
        return np.clip(tried, low, high)

    def _costs(self, state: Array, tried: Array) -> Array:
        """Return what sequences of controls [N, H, A] from a state [D] cost [N]."""
        states, costs = np.tile(state, (len(tried), 1)), np.zeros(len(tried))
        going, last = np.arange(len(tried)), len(self._observations) - 1
        for h in range(tried.shape[1]):
            self.counter.spend(len(going))
            outcome = self._model.transition(states[going], tried[going, h])
            reference = self._observations[min(self._step + 1 + h, last)]
            squares = (self._deviation(self._model.observe(outcome.states), reference) ** 2).sum(axis=1)
            costs[going] += np.where(outcome.success, 0.0, squares + np.where(outcome.ended, FAILED, 0.0))
            states[going] = outcome.states
            going = going[~(outcome.success | outcome.ended)]
            if not len(going):
                break
        return costs


def weighted_mean(controls: Array, costs: Array, temperature: float) -> Array:
    """Return the mean [H, A] of sequences [N, H, A] with the weights exp(-cost / temperature); the best for 0.

    Args:
        controls: The sequences.
        costs: What they cost [N].
        temperature: Of the weights.
    """
    if temperature == 0.0:
        best: Array = controls[costs.argmin()]
        return best
    weights = np.exp(-(costs - costs.min()) / temperature)
    mean: Array = (weights[:, None, None] * controls).sum(axis=0) / weights.sum()
    return mean
