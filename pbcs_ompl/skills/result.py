"""What a training answers."""

from dataclasses import dataclass
from typing import Any

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.types import Array
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.evaluation import Evaluation


@dataclass(frozen=True, eq=False)
class TrainResult:
    """A training's answer with its evidence.

    Attributes:
        solved: The chain reaches the target from the start without noise, and in at least 95 of 100 executions in
            which a tenth of the actions is random.
        nominal, robust: Those two evaluations; None when there is no complete chain.
        chain: The skills; None when there are none.
        trajectory: The plan; None for methods without one, or when none was found.
        milestones: The states along which skills were trained [N+1, D]; None without a plan.
        plan_transitions, train_transitions: Environment steps of the two phases; evaluations are not counted.
        updates: Gradient steps.
        seconds: Wall time of planning and training.
        stalled: Why training ended early; None when it did not.
    """

    solved: bool
    nominal: Evaluation | None
    robust: Evaluation | None
    chain: SkillChain | None
    trajectory: Trajectory | None
    milestones: Array | None
    plan_transitions: int
    train_transitions: int
    updates: int
    seconds: float
    seed: int
    out: str | None
    stalled: str | None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words; `success_rate` and `wilson` are those of the noisy executions."""
        robust, nominal = self.robust, self.nominal
        return {"solved": self.solved, "success_rate": robust.success_rate if robust else 0.0,
                "wilson": list(robust.wilson) if robust else None,
                "nominal_success_rate": nominal.success_rate if nominal else 0.0,
                "steps_median": nominal.steps_median if nominal else None,
                "skills": len(self.chain.skills) if self.chain else 0,
                "plan_transitions": self.plan_transitions, "train_transitions": self.train_transitions,
                "updates": self.updates, "seconds": self.seconds, "seed": self.seed, "out": self.out,
                "stalled": self.stalled}
