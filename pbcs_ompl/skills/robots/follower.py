"""A robot's follower: one policy that was trained once, and drives along any line in any maze."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec, EnvValues
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, UnknownName
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.results.files import read_bytes, read_json, write_json
from pbcs_ompl.results.schema import Limit, Positive, Table, check
from pbcs_ompl.skills.path_following.follower import Progress
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.policy import SkillPolicy, load_policies, save_policies
from pbcs_ompl.skills.robots.places import dimensions, line_through
from pbcs_ompl.skills.robots.shaking import CYCLE, stuck, waves
from pbcs_ompl.skills.robots.view import RobotView
from pbcs_ompl.skills.robots.worlds import robot_of
from pbcs_ompl.skills.side_by_side import SideBySide

STRUCTURE, POLICY = "follower.json", "follower.safetensors"
FORMAT, VERSION = "pbcs_ompl robot follower", 1
SHIPPED = Path(__file__).parent / "followers"
LOST_AFTER = CYCLE
"""Steps without progress after which a pointer goes back to the nearest point that it has passed (ours). A robot that
shakes behind a wall takes its pointer along the other side of it. After a cycle shaking continues without a jump."""


class FollowerWords(TypedDict):
    """What follower.json holds."""

    environment: EnvValues
    distances: list[Limit]
    window: Limit
    patience: Positive
    spacing: Limit
    clearance: Limit
    action_shape: list[Positive]
    training: Table
    sha256: dict[str, str]


class RobotController(SideBySide):
    """Drives episodes along one line: a pointer for each of them moves forward on it, and back where one is lost.

    The policy acts as long as the robot stands; one that has fallen shakes, and so does a car that is stuck: see
    `pbcs_ompl.skills.robots.shaking`.

    Attributes:
        progress: How far each episode has come [B].

    Args:
        policy: Its actions are those of the side that leads.
        view: What it sees.
        line: Where to go.
        actions: The action space.
        entries: The entries of an observation that are the robot's observation, in its order; None for all.
    """

    def __init__(self, policy: Policy, view: RobotView, line: Line, actions: ActionMap,
                 entries: IndexArray | None = None):
        self._policy, self._view, self._actions, self._entries = policy, view, actions, entries
        self._waves = waves(policy.action_low, policy.action_high)
        self.line = line
        self.reset()

    def _begin(self, count: int) -> None:
        self.progress = Progress(np.zeros(count, dtype=np.int64), np.full(count, -1, dtype=np.int64))
        self._sides = np.full(count, -1, dtype=np.int64)

    def _act(self, observations: Array, members: IndexArray) -> Actions:
        shown = observations if self._entries is None else observations[:, self._entries]
        moved = self.progress[members].advanced(self.line, self._view.places(shown), self._view.window, LOST_AFTER)
        sides = self._view.leading(shown, self.line, moved, self._sides[members])
        self.progress.pointers[members], self.progress.stalled[members] = moved.pointers, moved.stalled
        self._sides[members] = sides
        controls = self._view.controls(self._policy.act(self._view.inputs(shown, self.line, moved, sides)), sides)
        swinging = self._view.robot.fallen(shown)
        if self._view.robot.turning > 0.0:
            swinging |= stuck(moved.stalled, self._view.patience)
        controls[swinging] = self._waves[moved.stalled[swinging] % CYCLE]
        return self._actions.to_actions(controls)


@dataclass(frozen=True, eq=False)
class RobotFollower:
    """A policy for any line, and what it was trained with.

    Attributes:
        policy: Of the side that leads.
        view: What it sees.
        environment: The robot's.
        actions: Its action space.
        spacing: Between the points of lines.
        clearance: The least distance of lines from walls.
        training: Plain numbers and settings of the training.
    """

    policy: Policy
    view: RobotView
    environment: EnvSpec
    actions: ActionMap
    spacing: float
    clearance: float
    training: dict[str, Any]

    def controller(self, line: Line, entries: Sequence[int] | None = None) -> RobotController:
        """Return the controller for a line.

        Args:
            line: In the plane of the robot's place, whose points are `spacing` apart; see `Line.through`.
            entries: The entries of an observation that are the robot's observation, in its order; None for all.

        Raises:
            InvalidOption: the line is in no plane, or `entries` are of another number.
        """
        size = len(self.view.normaliser.origin) + 2
        expected = dimensions(self.view.robot)
        if line.points.shape[1] != expected:
            raise InvalidOption(f"a line in {line.points.shape[1]} dimensions; expected {expected}, see `line_of`")
        if entries is not None and len(entries) != size:
            raise InvalidOption(f"{len(entries)} entries; expected the {size} of the robot's observation")
        return RobotController(self.policy, self.view, line, self.actions,
                               None if entries is None else np.array(entries, dtype=np.int64))

    def line_of(self, places: Array) -> Line:
        """Return the line along the places [T+1, F] of a plan, without its loops; see `places.places_of`."""
        return line_through(self.view.robot, places, self.spacing)

    @checked
    def save(self, folder: str | Path) -> None:
        """Write follower.json, with checksums, and follower.safetensors."""
        folder = Path(folder)
        save_policies(folder / POLICY, [SkillPolicy(self.policy, self.view.normaliser)])
        words = {"format": FORMAT, "version": VERSION, "environment": self.environment.to_dict(),
                 "distances": self.view.distances.tolist(), "window": self.view.window, "patience": self.view.patience,
                 "spacing": self.spacing, "clearance": self.clearance, "action_shape": list(self.actions.shape),
                 "training": self.training}
        words = json.loads(json.dumps(words))
        write_json(folder / STRUCTURE, {**words, "sha256": {POLICY: _sum(read_bytes(folder / POLICY)),
                                                            STRUCTURE: _sum(_plain(words))}})

    @classmethod
    @checked
    def shipped(cls, name: str) -> "RobotFollower":
        """Return a follower that comes with the package: "ant" (Gymnasium's), "ant-d4rl", "car" or "quadrotor".

        Raises:
            UnknownName: no such follower; the message suggests the closest one.
        """
        known = shipped_followers()
        if name not in known:
            raise UnknownName("follower", name, known)
        return cls.load(known[name])

    @classmethod
    @checked
    def load(cls, folder: str | Path, *, trust: bool = False) -> "RobotFollower":
        """Read a follower that `save` wrote.

        Args:
            folder: The folder.
            trust: Let its environment be made where that imports a module which the folder names.

        Raises:
            DamagedFile: a file is missing, changed, or of another version.
        """
        folder = Path(folder)
        path = folder / STRUCTURE
        words = read_json(path)
        if not isinstance(words, dict) or words.get("format") != FORMAT or words.get("version") != VERSION:
            raise DamagedFile(f"{path} is no robot's follower of version {VERSION}")
        check(path, words, FollowerWords)
        sums = words.pop("sha256")
        (policy,) = load_policies(folder / POLICY, 1)
        for name, content in ((STRUCTURE, _plain(words)), (POLICY, read_bytes(folder / POLICY))):
            if sums.get(name) != _sum(content):
                raise DamagedFile(f"{folder / name} is damaged: its SHA-256 is not the one that {path.name} has")
        environment = EnvSpec.from_dict(words["environment"], trusted=trust)
        model = make(environment)
        view = RobotView(robot_of(model), policy.transform, np.array(words["distances"]), words["window"],
                         words["patience"])
        if policy.actor.observation_size != view.size or len(policy.actor.action_low) != len(model.action_low):
            raise DamagedFile(f"{folder / POLICY} holds a policy of another robot")
        low, high = policy.actor.action_low, policy.actor.action_high
        return cls(policy.actor, view, environment, ActionMap(low, high, tuple(words["action_shape"])),
                   words["spacing"], words["clearance"], words["training"])


def shipped_followers() -> dict[str, Path]:
    """Return the folders of the followers that come with the package, by name."""
    return {path.parent.name: path.parent for path in sorted(SHIPPED.glob(f"*/{STRUCTURE}"))}


def _plain(words: dict[str, Any]) -> bytes:
    return json.dumps(words, sort_keys=True).encode()


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
