"""The result of a training, with its evidence."""

from dataclasses import dataclass
from typing import Any

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.types import Array
from pbcs_ompl.skills.evaluation import Evaluation
from pbcs_ompl.skills.trained_controller import TrainedController


@dataclass(frozen=True, eq=False)
class TrainResult:
    """What a training has found.

    Attributes:
        solved: In fresh environments, the chain reaches the goal from the start without noise, and in at least 95 of
            100 executions in which a tenth of the actions is random (see `CriterionSettings`).
        reason: Why it is not solved; None when it is.
        complete: Whether the method ended by itself; False when its budget or the planner's search ended first.
        nominal, robust: The two evaluations that decide `solved`; None when training is not complete, or they cannot be
            made (see `NotVerified`).
        model_success_rate: Success rate of the noisy executions in the model that the chain was trained in; None where
            `robust` is.
        chain: The skills; None when there are none.
        trajectory: The plan; None for methods without one, or when none was found.
        waypoints: The states along which skills were trained [N+1, D]; None without a plan.
        plan_transitions, train_transitions: Environment steps of the two phases; evaluations are not counted.
        updates: Gradient steps.
        seconds: Wall time of planning and training.
        seed: Root of all random streams.
        out: The folder; None when none was asked for.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0)
        >>> sorted(set(result.summary()) & {"plan_transitions", "solved", "train_transitions"})
        ['plan_transitions', 'solved', 'train_transitions']
    """

    solved: bool
    reason: str | None
    complete: bool
    nominal: Evaluation | None
    robust: Evaluation | None
    model_success_rate: float | None
    chain: TrainedController | None
    trajectory: Trajectory | None
    waypoints: Array | None
    plan_transitions: int
    train_transitions: int
    updates: int
    seconds: float
    seed: int
    out: str | None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words; `success_rate` and `wilson` are those of the noisy executions."""
        robust, nominal = self.robust, self.nominal
        return {"solved": self.solved, "reason": self.reason, "complete": self.complete,
                "success_rate": robust.success_rate if robust else 0.0,
                "wilson": list(robust.wilson) if robust else None,
                "model_success_rate": self.model_success_rate,
                "nominal_success_rate": nominal.success_rate if nominal else 0.0,
                "steps_median": nominal.steps_median if nominal else None,
                "skills": self.chain.num_policies if self.chain else 0,
                "plan_transitions": self.plan_transitions, "train_transitions": self.train_transitions,
                "updates": self.updates, "seconds": self.seconds, "seed": self.seed, "out": self.out}
