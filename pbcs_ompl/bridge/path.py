"""OMPL's PathControl to a trajectory, and back."""

from typing import Any

import numpy as np
from ompl import control as oc

from pbcs_ompl.bridge.layout import blocks, control_reader, state_reader, state_writer
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array


def to_trajectory(path: Any, model: ResettableModel, *, step_size: float = 1.0, planner: str = "",
                  seed: int = 0) -> Trajectory:
    """Return the trajectory of a PathControl.

    A control held for k steps becomes k actions, and the states in between come from stepping the model.
    The path's own states are kept as they are, true or not: `Trajectory.replays_exactly` is their judge.

    Args:
        path: An `ompl.control.PathControl` of the model's problem.
        model: The environment.
        step_size: The propagation step size that the path's durations are multiples of.
        planner, seed: Kept in the trajectory.

    Raises:
        Mismatch: a control is held for something else than a positive number of whole steps.
    """
    read = state_reader(blocks(len(model.state_low), model.feature_dims))
    read_control = control_reader(len(model.action_low))
    states, actions = [np.array(read(path.getState(0)))], []
    for index in range(path.getControlCount()):
        steps = _whole_steps(path.getControlDuration(index), step_size)
        action = np.array(read_control(path.getControl(index)))
        for _ in range(steps - 1):
            states.append(model.transition(states[-1][None], action[None]).states[0])
        states.append(np.array(read(path.getState(index + 1))))
        actions += [action] * steps
    all_states = np.array(states)
    all_actions = np.array(actions).reshape(len(actions), len(model.action_low))
    rewards = model.transition(all_states[:-1], all_actions).rewards if actions else np.empty(0)
    return Trajectory(environment=model.spec, states=all_states,
                      actions=all_actions, rewards=np.asarray(rewards, dtype=np.float64), planner=planner,
                      seed=seed)


def to_path(trajectory: Trajectory, space_information: Any, model: ResettableModel) -> Any:
    """Return the PathControl of a trajectory, with one control for each step."""
    write = state_writer(blocks(len(model.state_low), model.feature_dims))
    path = oc.PathControl(space_information)
    state, control = space_information.allocState(), space_information.allocControl()
    duration = space_information.getPropagationStepSize()
    for values, action in zip(trajectory.states[:-1], trajectory.actions, strict=True):
        write(state, values.tolist())
        _write_control(control, action)
        path.append(state, control, duration)
    write(state, trajectory.states[-1].tolist())
    path.append(state)
    return path


def _whole_steps(duration: float, step_size: float) -> int:
    steps = round(duration / step_size)
    if steps < 1 or abs(duration - steps * step_size) > 1e-9 * step_size:
        raise Mismatch(f"a control of the path is held for {duration}; expected a multiple of {step_size}")
    return steps


def _write_control(control: Any, action: Array) -> None:
    for dim, value in enumerate(action.tolist()):
        control[dim] = value
