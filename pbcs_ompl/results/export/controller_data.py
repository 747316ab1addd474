"""A trained controller as plain values and arrays: what `pbcs_ompl.deploy` and other formats compute with."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from pbcs_ompl import deploy
from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.robot import Robot
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.results.export.meaning import entry_names
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.observed_sets import ObservedBall, ObservedClassifier
from pbcs_ompl.skills.path_following.chain import FollowChain
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.path_following.shown_feature import NO_SINE
from pbcs_ompl.skills.robots.follower import LOST_AFTER, RobotFollower
from pbcs_ompl.skills.robots.places import periods
from pbcs_ompl.skills.robots.shaking import BURST, waves
from pbcs_ompl.skills.robots.view import LARGEST

PROBES = 16
"""Observations by which a robot's own frame is recognised."""


class ControllerData(NamedTuple):
    """A controller without its classes: `words` are plain values, as JSON holds them."""

    words: dict[str, Any]
    arrays: dict[str, np.ndarray]


def controller_data(controller: SkillChain | FollowChain | RobotFollower, line: Line | None = None) -> ControllerData:
    """Return a controller as plain values and arrays.

    Args:
        controller: The controller.
        line: The line that a robot's follower begins with; None for none.

    Raises:
        InvalidOption: the robot's own frame is of an unknown kind.
    """
    if isinstance(controller, SkillChain):
        return _chain(controller)
    return _robot(controller, line) if isinstance(controller, RobotFollower) else _follower(controller)


def _chain(chain: SkillChain) -> ControllerData:
    policies = [skill.policy for skill in chain.skills]
    transforms = [policy.transform for policy in policies]
    parts = [(index, part) for index, skill in enumerate(chain.skills) for part in skill.entry.parts]
    balls = [(owner, part) for owner, part in parts if isinstance(part, ObservedBall)]
    learnt = [(owner, part) for owner, part in parts if isinstance(part, ObservedClassifier)]
    owners = np.zeros((len(parts), len(policies)))
    owners[np.arange(len(parts)), [owner for owner, _ in [*balls, *learnt]]] = 1.0
    size = len(transforms[0].origin)
    arrays = {"origins": np.array([one.origin for one in transforms]),
              "scales": np.array([one.scale for one in transforms]), "owners": owners,
              "ball.centers": np.array([ball.center for _, ball in balls]).reshape(-1, size),
              "ball.weights": np.array([ball.weights for _, ball in balls]).reshape(-1, size),
              "ball.squares": np.array([ball.radius for _, ball in balls]) ** 2}
    for index, (_, one) in enumerate(learnt):
        arrays |= {f"classifier{index}.{name}": np.asarray(getattr(one, name)) for name in
                   ("origin", "scale", "weights_1", "bias_1", "weights_2", "bias_2", "confidence")}
    words = {"kind": "chain", "classifiers": len(learnt), "memory": {"skill": 0},
             "time_limit": chain.time_limit, "reset_seed": chain.reset_seed}
    return _with_networks(words, arrays, [policy.actor for policy in policies], chain.environment, chain.actions, size)


def _follower(chain: FollowChain) -> ControllerData:
    view, line = chain.view, chain.line
    size = len(view.normaliser.origin)
    arrays = {"line": line.points, "entries": view.shown.entries, "unit": view.unit, "origin": view.normaliser.origin,
              "scale": view.normaliser.scale, "firsts": np.array(chain.firsts),
              "distances": _points(view.distances, line.spacing), "pass_radius": np.array(line.pass_radius)}
    if (view.shown.sines != NO_SINE).any():
        arrays["sines"] = view.shown.sines
    if line.periods is not None:
        arrays["periods"] = line.periods
    words = {"kind": "follower", "memory": {"pointer": 0, "stalled": -1}, "patience": view.patience,
             "lost_after": view.lost_after,
             "reach": _reach(view.window, line.spacing), "spacing": line.spacing, "time_limit": chain.time_limit,
             "reset_seed": chain.reset_seed}
    return _with_networks(words, arrays, chain.policies, chain.environment, chain.actions, size)


def _robot(follower: RobotFollower, line: Line | None) -> ControllerData:
    view, robot = follower.view, follower.view.robot
    size = len(view.normaliser.origin) + 2
    arrays = {"entries": np.array(robot.place), "unit": np.ones(2), "origin": view.normaliser.origin,
              "scale": view.normaliser.scale, "firsts": np.array([0]),
              "distances": _points(view.distances, follower.spacing),
              "half": _points(np.median(view.distances), follower.spacing),
              "side_observations": np.array([one.observation for one in robot.symmetries]),
              "side_actions": np.array([one.action for one in robot.symmetries]), "pass_radius": np.array(np.inf),
              "waves": waves(follower.policy.action_low, follower.policy.action_high)}
    if line is not None:
        arrays["line"] = line.points
    policy, turns, angle = follower.policy, periods(robot), -1
    if turns is not None:
        level, normaliser = _level(robot, size), view.normaliser
        angle = int(np.flatnonzero(level == 0.0)[0])
        seen = np.delete(level, robot.place)
        constants = np.clip((seen - normaliser.origin) / normaliser.scale, -LARGEST, LARGEST)
        policy = _without(policy, np.pad(constants, (0, view.size - len(seen)), constant_values=np.nan))
        arrays |= {"unit": np.array([1.0, 1.0, 1.0 / robot.turning]), "periods": turns,
                   "entries": np.array([*robot.place, angle]), "origin": normaliser.origin[np.isnan(seen)],
                   "scale": normaliser.scale[np.isnan(seen)],
                   "body": np.setdiff1d(np.flatnonzero(np.isnan(level)), robot.place)}
    words = {"kind": "robot follower", "memory": {"pointer": 0, "stalled": -1, "side": -1}, "patience": view.patience,
             "lost_after": LOST_AFTER, "reach": _reach(view.window, follower.spacing), "spacing": follower.spacing,
             "speeds": 0 if turns is not None else _first_speed(robot, size),
             "angle": angle, "burst": 0 if turns is None else BURST}
    return _with_networks(words, arrays, [policy], follower.environment, follower.actions, size)


def _with_networks(words: dict[str, Any], arrays: dict[str, Any], policies: Sequence[Policy], environment: EnvSpec,
                   actions: ActionMap, size: int) -> ControllerData:
    """Add what all kinds have: the networks, the task, and the meaning of observations and actions.

    Args:
        words, arrays: What the kind has.
        policies: In the order of execution.
        environment: The task.
        actions: Its action space.
        size: Length O of an observation.
    """
    arrays = {**arrays, "low": policies[0].action_low, "high": policies[0].action_high,
              "first_action": actions.first, "last_action": actions.last}
    for index, policy in enumerate(policies):
        layers = {name: array for name, array in policy.to_arrays().items() if name not in ("low", "high")}
        arrays |= {f"network{index}.{name}": array for name, array in layers.items()}
    action = {"shape": list(actions.shape), "dtype": str(actions.first.dtype), "low": actions.first.tolist(),
              "high": actions.last.tolist()}
    whole = {"format": deploy.FORMAT, **words, "networks": len(policies), "environment": environment.to_dict(),
             "observation": entry_names(environment, size), "action": action}
    return ControllerData(whole, arrays)


def _points(lengths: Array | float, spacing: float) -> np.ndarray:
    """Return lengths of a line as numbers of its points."""
    return np.rint(np.asarray(lengths) / spacing).astype(np.int64)


def _reach(window: float, spacing: float) -> int:
    return max(1, round(window / spacing))


def _first_speed(robot: Robot, size: int) -> int:
    """Return the entry of an observation where the speed of a robot's free joint begins; 0 for one without heading.

    A robot says where it looks and how it turns by functions. The two kinds that files can hold are recognised by what
    these functions return for random observations, so that a wrong guess is not possible.

    Raises:
        InvalidOption: it is of neither kind.
    """
    rng = np.random.default_rng(0)
    seen, angles = rng.normal(size=(PROBES, size)), rng.uniform(-np.pi, np.pi, PROBES)
    if not robot.heading(seen).any() and not robot.fallen(seen).any() and np.array_equal(
            np.delete(robot.turned(seen, np.zeros(PROBES)), robot.place, axis=1), np.delete(seen, robot.place, axis=1)):
        return 0
    for first in range(7, size - 1):
        if _is_free_joint(robot, seen, angles, first):
            return first
    raise InvalidOption(f"{type(robot).__name__} cannot leave the toolkit: its heading and turns are not those of a "
                        "robot without heading, nor of one whose observation begins with place and quaternion of a "
                        "free joint")


def _without(policy: Policy, constants: Array) -> Policy:
    """Return a policy without the inputs that are constant [I], NaN for one that is not: they are part of the bias."""
    weight, bias, *norm = policy.layers[0]
    fixed = np.isfinite(constants)
    first = (weight[~fixed], (bias + constants[fixed] @ weight[fixed]).astype(np.float32), *norm)
    return replace(policy, layers=(first, *policy.layers[1:]))


def _level(robot: Robot, size: int) -> Array:
    """Return an observation [O] of a robot that looks along the x axis, NaN where the heading does not show.

    The robot is one whose heading counts on lines; its first 0 is the heading. It is recognised as in `_first_speed`.

    Raises:
        InvalidOption: its heading is no entry of the observation, or turns change more than entries that show it.
    """
    rng = np.random.default_rng(0)
    seen = rng.normal(size=(PROBES, size))
    headings = robot.heading(seen)
    turned = robot.turned(seen, -headings)
    level: Array = np.where(np.ptp(turned, axis=0) < 1e-9, turned[0], np.nan)
    kept = np.setdiff1d(np.flatnonzero(np.isnan(level)), robot.place)
    angle = np.flatnonzero(level == 0.0)
    if (not len(angle) or not np.array_equal(seen[:, angle[0]], headings) or robot.fallen(seen).any()
            or not np.array_equal(turned[:, kept], seen[:, kept]) or len(robot.symmetries) > 1):
        raise InvalidOption(f"{type(robot).__name__} cannot leave the toolkit: its heading counts on lines, but is no "
                            "entry of the observation, or shows in entries that turn in another way")
    return level


def _is_free_joint(robot: Robot, seen: Array, angles: Array, first: int) -> bool:
    kind = deploy.RobotFrame(first)
    ours, theirs = (np.delete(rows, robot.place, axis=1) for rows in
                    (kind.turned(seen, np.exp(1j * angles)), robot.turned(seen, angles)))
    return bool(np.allclose(np.angle(kind.heading(seen)), robot.heading(seen)) and np.allclose(ours, theirs)
                and np.array_equal(kind.fallen(seen), robot.fallen(seen)))
