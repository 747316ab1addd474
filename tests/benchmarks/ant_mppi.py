"""MuJoCo's ant along a single plan by predictive control (MPPI), and a network distilled from it by DAgger.

    python tests/benchmarks/ant_mppi.py --seeds 220 221 222 223 224

The plans and lines are those of `ant_one_plan.py`, and so are the executions: by the judge, from the environment's own
starts, in RK4. The controller simulates in Euler's integration; an observation of the ant is its state, so it needs no
other. `--track` measures `MPPIController`, which tracks the plan's states instead of its line. Prints a line of JSON
for each result.
"""

import argparse
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from ant_one_plan import ID, MAZE, NOISES, TRAINING, line_along, planned, report

from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.judge import Controller, Judge
from pbcs_ompl.skills.baselines.mppi import FAILED, MPPIController, MPPISettings, weighted_mean
from pbcs_ompl.skills.distill import Distillation, DistillSettings
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.settings import RobotSettings
from pbcs_ompl.skills.side_by_side import SideBySide
from pbcs_ompl.skills.trained_controller import actions_of

SETTINGS = MPPISettings(samples=32, horizon=16, disturbance=0.5, temperature=0.1)
HELD = 4
"""Steps for which a disturbance is held: an ant does not feel one of a single step."""
WINDOW = 1.0
"""Metres that a pointer may move forward in a step."""
AHEAD = 0.5
"""Metres of the line from the pointer to the point that the ant is to come near."""
STRAY, LEAN = 0.5, 0.3
"""Cost of a metre from that point, and of an ant on its side; a metre of progress is worth 1, the goal 1 a step."""
LIMIT = 400
"""Steps after which an execution has failed; the plans have 194 to 284."""


class LineMPPI(SideBySide):
    """Makes the first step of the weighted mean of sequences of controls that were tried in the simulator.

    As `MPPIController`, but what a sequence is worth is its progress along a line, and disturbances are held.

    Args:
        model: The simulator.
        line: Where to go.
        seed: Of the disturbances.
    """

    def __init__(self, model: ResettableModel, line: Line, seed: int):
        self._model, self._line, self._rng = model, line, np.random.default_rng(seed)
        self._actions = actions_of(model)
        self.reset()

    @property
    def current(self) -> IndexArray:
        """The only policy."""
        return np.zeros(self._count, dtype=np.int64)

    def _begin(self, count: int) -> None:
        self._pointers = np.zeros(count, dtype=np.int64)
        self._solutions = np.zeros((count, SETTINGS.horizon, len(self._model.action_low)))

    def _act(self, observations: Array, members: IndexArray) -> Any:
        states = np.concatenate([np.zeros((len(observations), 1)), observations], axis=1)
        pointers = self._line.advance(states[:, 1:3], self._pointers[members], WINDOW)
        ahead = np.roll(self._solutions[members], -1, axis=1)
        ahead[:, -1] = 0.0
        tried = self._tried(ahead)
        costs = self._costs(states, pointers, tried)
        self._pointers[members] = pointers
        self._solutions[members] = [weighted_mean(own, cost, SETTINGS.temperature)
                                    for own, cost in zip(tried, costs, strict=True)]
        return self._actions.to_actions(self._solutions[members, 0])

    def _tried(self, ahead: Array) -> Array:
        """Return the sequences that are tried [B, N, H, A]; the first is undisturbed, the last rests."""
        low, high = self._model.action_low, self._model.action_high
        shape = (len(ahead), SETTINGS.samples, -(-SETTINGS.horizon // HELD), len(low))
        noise = SETTINGS.disturbance * (high - low) / 2.0 * self._rng.standard_normal(shape)
        tried = ahead[:, None] + np.repeat(noise, HELD, axis=2)[:, :, :SETTINGS.horizon]
        tried[:, 0], tried[:, -1] = ahead, 0.0
        return np.clip(tried, low, high)

    def _costs(self, states: Array, pointers: IndexArray, tried: Array) -> Array:
        """Return what sequences [B, N, H, A] cost from states [B, D] with pointers [B]: [B, N]."""
        shape = tried.shape[:2]
        here, moved = np.repeat(states, shape[1], axis=0), np.repeat(pointers, shape[1])
        controls, costs = tried.reshape(-1, *tried.shape[2:]), np.zeros(shape[0] * shape[1])
        going = np.arange(len(here))
        for h in range(controls.shape[1]):
            outcome = self._model.transition(here[going], controls[going, h])
            here[going] = outcome.states
            moved[going] = self._line.advance(outcome.states[:, 1:3], moved[going], WINDOW)
            costs[going] += np.where(outcome.success, -1.0, np.where(outcome.ended, FAILED, 0.0))
            going = going[~(outcome.success | outcome.ended)]
            if not len(going):
                break
        aim = self._line.points[np.minimum(moved + round(AHEAD / self._line.spacing), self._line.last)]
        upright = 1.0 - 2.0 * (here[:, 5] ** 2 + here[:, 6] ** 2)
        costs += STRAY * np.linalg.norm(here[:, 1:3] - aim, axis=1) + LEAN * (1.0 - upright)
        return (costs - self._line.spacing * moved).reshape(shape)


class Tracker(SideBySide):
    """`MPPIController` in each episode."""

    def __init__(self, model: ResettableModel, trajectory: Trajectory):
        self._model, self._trajectory, self._rng = model, trajectory, np.random.default_rng(0)
        self.reset()

    def _begin(self, count: int) -> None:
        self._states = np.zeros((count, len(self._model.state_low)))
        self._each = [MPPIController(self._model, self._trajectory, lambda k=k: self._states[k], rng=self._rng)
                      for k in range(count)]

    def _act(self, observations: Array, members: IndexArray) -> Any:
        self._states[members, 1:] = observations
        return np.array([self._each[k].act(observations[i]) for i, k in enumerate(members)])


@dataclass(frozen=True)
class Teacher:
    """What `Distillation` asks of the controller that it learns from; see `TrainedController`."""

    drives: LineMPPI
    start: Array
    environment: Any
    actions: ActionMap
    reset_seed: int | None
    time_limit: int = LIMIT

    def controller(self) -> LineMPPI:
        """Return the controller."""
        return self.drives


class Imitation(Distillation):
    """DAgger on all episodes: predictive control knows what to do wherever the student has led the ant."""

    def trusted(self, success: BoolArray) -> BoolArray:
        """Return all."""
        return np.ones_like(success)


def rates(controller: Controller, episodes: int) -> dict[str, list[int]]:
    """Executions that reach the goal, of how many, by noise; the starts are those of `ant_one_plan.py`."""
    judge, seeds = Judge.of(make(ID, MAZE)), SeedTree(1).child("resets")
    resets = [seeds.child(str(k)).integer() for k in range(episodes)]
    return {f"{noise:.0%} random": [
        sum(execution.success for execution in judge.drive(controller, reset_seeds=resets, max_steps=LIMIT,
                                                           epsilon=noise, seed=1)), episodes] for noise in NOISES}


def measure(seed: int, given: argparse.Namespace) -> None:
    """Print what the controller, and the network that is distilled from it, reach along the plan of a seed."""
    trajectory = planned(seed)
    line, model = line_along(trajectory, RobotSettings()), make(ID, MAZE | TRAINING | {"terminate_on_success": True})
    if given.track:
        began = time.process_time()
        reached = rates(Tracker(model, trajectory), given.teacher_episodes)
        report(seed, {"what": "tracker", **reached, "cpu_seconds": round(time.process_time() - began)})
        return
    began = time.process_time()
    drives = LineMPPI(model, line, seed)
    report(seed, {"what": "MPPI", "line": round(line.length, 1), **rates(drives, given.teacher_episodes),
                  "cpu_seconds": round(time.process_time() - began)})
    teacher = Teacher(drives, trajectory.states[0], model.spec, actions_of(model), trajectory.reset_seed)
    began, settings = time.process_time(), DistillSettings(rounds=given.rounds, episodes=given.episodes)
    distillation = Imitation(teacher, model, settings, seed, None)  # type: ignore[arg-type]
    student, rounds = distillation.rounds()
    spent = time.process_time() - began
    report(seed, {"what": "student", "rounds": rounds, "states": sum(map(len, distillation.labels)),
                  **rates(student.controller(), 100), "cpu_seconds": round(spent)})


def main() -> None:
    """Print a line of JSON for each result."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, nargs="+", default=[220, 221, 222, 223, 224])
    parser.add_argument("--rounds", type=int, default=3, help="of DAgger")
    parser.add_argument("--episodes", type=int, default=12, help="of a round")
    parser.add_argument("--teacher-episodes", type=int, default=5, help="in which MPPI is measured, for each noise")
    parser.add_argument("--track", action="store_true", help="measure MPPI that tracks the plan's states, alone")
    given = parser.parse_args()
    with one_thread():
        for seed in given.seeds:
            measure(seed, given)


if __name__ == "__main__":
    main()
