"""The result of path following: policies along a line, saved, loaded and evaluated as a chain is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.skills.chain_files import ChainContent
from pbcs_ompl.skills.path_following.follower import Follower, LineView
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.path_following.shown_feature import ShownFeature
from pbcs_ompl.skills.path_following.task import FollowTask
from pbcs_ompl.skills.policy import ObservationTransform, SkillPolicy
from pbcs_ompl.skills.trained_controller import TaskValues, TrainedController, actions_of
from pbcs_ompl.skills.waypoints import Waypoints


@dataclass(frozen=True, eq=False)
class FollowChain(TrainedController):
    """Policies that take over from each other along one line, from the environment's start to its goal.

    Attributes:
        policies: In the order of execution.
        firsts: The pointer from which each of them acts.
        line: Along the plan.
        view: What the policies see.
        start, environment, time_limit, actions, reset_seed: See `TrainedController`.
    """

    kind = "follower"
    policies: tuple[Policy, ...]
    firsts: tuple[int, ...]
    line: Line
    view: LineView
    start: Array
    environment: EnvSpec
    time_limit: int
    actions: ActionMap
    reset_seed: int | None = None

    @classmethod
    def of(cls, members: Sequence[tuple[int, Policy]], task: FollowTask, waypoints: Waypoints,
           time_limit: int) -> "FollowChain":
        """Return trained policies as a controller.

        Args:
            members: The pointer from which a policy acts, and the policy, in the order of execution.
            task: The line, and what they see.
            waypoints: Those of the plan.
            time_limit: Steps after which an execution counts as failed.
        """
        firsts, policies = zip(*members, strict=True)
        return cls(policies, firsts, task.line, task.view, waypoints.states[0], task.model.spec, time_limit,
                   actions_of(task.model), waypoints.reset_seed)

    @property
    def circles(self) -> Sequence[tuple[Array, float]]:
        """None: policies take over at places of the line."""
        return []

    @property
    def num_policies(self) -> int:
        """Number of policies."""
        return len(self.policies)

    def controller(self) -> Follower:
        """Return the controller of observations, for one episode until its `reset` says otherwise."""
        return Follower(self.policies, self.firsts, self.line, self.view, self.actions)

    @property
    def content(self) -> ChainContent:
        """The line and what policies see as arrays, the pointers from which they act in the structure."""
        view = self.view
        arrays = {"points": self.line.points, "pass_radius": np.array(self.line.pass_radius),
                  "entries": view.shown.entries, "sines": view.shown.sines, "unit": view.unit,
                  "origin": view.normaliser.origin, "scale": view.normaliser.scale, "distances": view.distances}
        if self.line.periods is not None:
            arrays["periods"] = self.line.periods
        structure = {"skills": [{"first": int(first)} for first in self.firsts], "spacing": self.line.spacing,
                     "window": view.window, "patience": view.patience, "lost_after": view.lost_after}
        return ChainContent(structure, arrays, [SkillPolicy(policy, ObservationTransform.identity(view.size))
                                                for policy in self.policies])

    @classmethod
    def from_content(cls, content: ChainContent, task: TaskValues) -> "FollowChain":
        """Return the policies of `content` for a task."""
        structure, arrays, policies = content
        entries = arrays["entries"].astype(np.int64)
        shown = ShownFeature(entries, arrays["sines"].astype(np.int64)) if "sines" in arrays else (
            ShownFeature.plain(entries))  # of older files
        view = LineView(shown, arrays["unit"],
                        ObservationTransform(arrays["origin"], arrays["scale"]), arrays["distances"],
                        structure["window"], structure["patience"], structure.get("lost_after", 0))
        return cls(policies=tuple(policy.actor for policy in policies),
                   firsts=tuple(place["first"] for place in structure["skills"]),
                   line=Line(arrays["points"], structure["spacing"], float(arrays.get("pass_radius", np.inf)),
                             arrays.get("periods")),
                   view=view, **task)
