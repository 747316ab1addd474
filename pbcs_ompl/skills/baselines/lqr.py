"""The time-varying linear-quadratic regulator along a plan."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.skills.baselines.deviation import Deviation
from pbcs_ompl.skills.settings import Settings
from pbcs_ompl.skills.side_by_side import SideBySide
from pbcs_ompl.skills.trained_controller import actions_of

RIDGE = 1e-4
"""Of the least squares, relative to the mean square of the deviations: what they do not show counts as 0."""
CHUNK = 4096
"""Rollouts that are made together."""


@dataclass(frozen=True)
class LQRSettings(Settings):
    """How the plan is linearised, and what the regulator costs.

    Attributes:
        rollouts: From each state of the plan, with disturbed controls (ours).
        depth: Steps of each of them (ours).
        disturbance: Standard deviation of the controls' disturbance, in half-widths of the action box (ours).
        effort: Cost R of squared changes of the controls, in half-widths; squared deviations of observations, in their
            standard deviations along the plan, cost 1 (ours).
        final: Cost of the last deviation (ours).
    """

    rollouts: int = 8
    depth: int = 10
    disturbance: float = 0.3
    effort: float = 0.01
    final: float = 10.0

    def _check_ranges(self) -> None:
        self._check_counts("rollouts", "depth")
        self._check_positive("disturbance", "effort", "final")


class LinearModels(NamedTuple):
    """What deviations become: d' = A_t d + B_t u, in the units of `Deviation` and of half-widths of the action box."""

    A: Array
    """[T, O, O]"""
    B: Array
    """[T, O, A]"""


class LQRController(SideBySide):
    """u = u_t - K_t (o - o_t) in the step t; beyond the plan's end, towards its last observation.

    Source: Riccati's backward recursion along a trajectory, as in Tedrake, Underactuated Robotics, chapter 8. Differs:
    the linear models are fitted to observations of disturbed rollouts, as in Levine and Abbeel 2014, so that the
    regulator needs neither derivatives nor the simulator's state. It goes by the clock: to wait for an execution that
    fell behind, or to let one advance, helped in mazes and did harm to the car and the quadrotor.

    Args:
        plan: Observations [T+1, O] and controls [T, A].
        gains: K_t [T, A, O], in the units of `deviation` and of half-widths of the action box.
        deviation: Of observations from the plan.
        actions: The action space.
    """

    def __init__(self, plan: tuple[Array, Array], gains: Array, deviation: Deviation, actions: ActionMap):
        (self._observations, self._controls), self._gains = plan, gains
        self._deviation, self._actions = deviation, actions
        self.reset()

    @classmethod
    def along(cls, model: ResettableModel, trajectory: Trajectory, settings: LQRSettings | None = None, *,
              rng: np.random.Generator | None = None, counter: Counter | None = None) -> "LQRController":
        """Return the regulator along a plan.

        Args:
            model: The environment, in which the plan is disturbed.
            trajectory: The plan.
            settings: None for the defaults.
            rng: Source of disturbances.
            counter: Counts every transition.
        """
        settings, rng = settings or LQRSettings(), rng or np.random.default_rng(0)
        observations, controls = model.observe(trajectory.states), trajectory.controls
        deviation = Deviation.along(observations)
        models = linear_models(model, trajectory.states, controls, deviation, settings, rng, counter or Counter())
        size, width = observations.shape[1], controls.shape[1]
        gains = riccati(models, np.eye(size), settings.effort * np.eye(width), settings.final * np.eye(size))
        return cls((observations, controls), gains, deviation, actions_of(model))

    def _begin(self, count: int) -> None:
        self._steps = np.zeros(count, dtype=np.int64)

    def _act(self, observations: Array, members: IndexArray) -> Actions:
        steps, last = self._steps[members], len(self._gains) - 1
        self._steps[members] += 1
        at = np.minimum(steps, last)
        deviations = self._deviation(observations, self._observations[np.minimum(steps, last + 1)])
        half = (self._actions.high - self._actions.low) / 2.0
        changes = -half * np.einsum("bao,bo->ba", self._gains[at], deviations)
        return self._actions.to_actions(self._controls[at] + changes)


def riccati(models: LinearModels, state_cost: Array, control_cost: Array, final_cost: Array) -> Array:
    """Return the gains K_t [T, A, O] that minimise sum_t d'Q d + u'R u + d_T' Q_T d_T.

    Backwards from S_T = Q_T: K = (R + B'S B)^-1 B'S A, S = Q + A'S (A - B K).

    Args:
        models: The linear models.
        state_cost, control_cost, final_cost: Q [O, O], R [A, A], Q_T [O, O].
    """
    gains, ahead = [], final_cost
    for a, b in zip(models.A[::-1], models.B[::-1], strict=True):
        gain = np.linalg.solve(control_cost + b.T @ ahead @ b, b.T @ ahead @ a)
        ahead = state_cost + a.T @ ahead @ (a - b @ gain)
        ahead = (ahead + ahead.T) / 2.0
        gains.append(gain)
    return np.array(gains[::-1])


def linear_models(model: ResettableModel, states: Array, controls: Array, deviation: Deviation, settings: LQRSettings,
                  rng: np.random.Generator, counter: Counter) -> LinearModels:
    """Fit a linear model to each step of a plan, by least squares over disturbed rollouts from the states before it.

    Args:
        model: The environment.
        states, controls: Of the plan [T+1, D], [T, A].
        deviation: Of observations from the plan.
        settings: Of the rollouts.
        rng: Source of disturbances.
        counter: Counts every transition.
    """
    total, half = len(controls), (model.action_high - model.action_low) / 2.0
    reference, begins = model.observe(states), np.repeat(np.arange(total), settings.rollouts)
    found: list[tuple[IndexArray, Array, Array, Array]] = []
    for chunk in np.array_split(begins, max(1, -(-len(begins) // CHUNK))):
        step, here = chunk.copy(), states[chunk]
        for _ in range(settings.depth):
            if not len(step):  # the plan is shorter
                break
            given = controls[step] + half * settings.disturbance * rng.standard_normal((len(step), len(half)))
            given = np.clip(given, model.action_low, model.action_high)
            counter.spend(len(step))
            outcome = model.transition(here, given)
            found.append((step, deviation(model.observe(here), reference[step]), (given - controls[step]) / half,
                          deviation(model.observe(outcome.states), reference[step + 1])))
            going = ~outcome.ended & (step + 1 < total)
            step, here = step[going] + 1, outcome.states[going]
    steps, before, changes, after = (np.concatenate(column) for column in zip(*found, strict=True))
    return _fitted(total, steps, np.concatenate([before, changes], axis=1), after)


def _fitted(total: int, steps: IndexArray, inputs: Array, outputs: Array) -> LinearModels:
    """Return the least squares of outputs [N, O] on inputs [N, O + A], for each of `total` steps."""
    size, order = outputs.shape[1], np.argsort(steps, kind="stable")
    bounds = np.searchsorted(steps[order], np.arange(total + 1))
    fits = np.zeros((total, inputs.shape[1], size))
    for t in range(total):
        rows = order[bounds[t]:bounds[t + 1]]
        x, y = inputs[rows], outputs[rows]
        gram = x.T @ x
        ridge = RIDGE * max(float(np.trace(gram)) / len(gram), 1e-12)
        fits[t] = np.linalg.solve(gram + ridge * np.eye(len(gram)), x.T @ y)
    fits = fits.transpose(0, 2, 1)
    return LinearModels(fits[:, :, :size], fits[:, :, size:])
