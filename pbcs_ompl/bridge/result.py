"""What `plan` answers."""

from dataclasses import dataclass
from typing import Any

from pbcs_ompl.bridge.coverage import Coverage
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.tree import TreeArrays


@dataclass(frozen=True, eq=False)
class PlanResult:
    """The answer of one planner, with its evidence.

    Attributes:
        solved: Whether the goal was reached, exactly.
        transitions: Environment steps that were made.
        collision_checks: How often the environment was asked whether something collides: by every transition, and
            by every state that OMPL made up itself.
        seconds: Wall time of the search alone.
        nodes: Size of the tree.
        path_length: Steps of the trajectory; None when unsolved.
        replay_ok: Whether the trajectory, replayed in a fresh environment, gives the same states bit for
            bit; None when unsolved. False is a failure of the planner or a sign that the environment is not
            deterministic.
        planner, env, seed: What was run.
        out: The folder with the files, None when none was asked for.
        trajectory: The path found, None when unsolved.
        tree: What was explored.
        coverage: How much of the feature space was seen after how many transitions; None unless asked for.
    """

    solved: bool
    transitions: int
    collision_checks: int
    seconds: float
    nodes: int
    path_length: int | None
    replay_ok: bool | None
    planner: str
    env: str
    seed: int
    out: str | None
    trajectory: Trajectory | None
    tree: TreeArrays
    coverage: Coverage | None = None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words, without the arrays."""
        return {"solved": self.solved, "transitions": self.transitions, "collision_checks": self.collision_checks,
                "seconds": self.seconds, "nodes": self.nodes, "path_length": self.path_length,
                "replay_ok": self.replay_ok, "planner": self.planner, "env": self.env, "seed": self.seed,
                "out": self.out}
