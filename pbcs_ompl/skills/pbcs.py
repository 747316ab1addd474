"""PBCS: a chain of skills, each learnt by Backplay, from the target back to the start; [Matheron2020] Alg. 6."""

from pbcs_ompl.skills.backplay import Backplay
from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.learner import Learner
from pbcs_ompl.skills.method import Snapshot
from pbcs_ompl.skills.policy import SkillPolicy, policy_from_arrays, policy_to_arrays


class PBCS:
    """Plan, Backplay, Chain Skills.

    Backplay learns a skill that ends at the target and starts at some milestone K; the next skill ends in the ball of
    K, and so on until one starts at milestone 0.

    Source: [Matheron2020] Alg. 6. Differs: the loop ends when a skill starts at index 0 (Alg. 7 never trains index 0,
    so that Alg. 6 would not end).
    """

    def __init__(self, learner: Learner):
        self.learner = learner
        self.bounds = [learner.milestones.last]
        """Milestones between skills, from the target backwards."""
        self.policies: list[SkillPolicy] = []
        self._begin()

    @property
    def done(self) -> bool:
        """Whether the chain starts at milestone 0."""
        return self.bounds[-1] == 0

    @property
    def skills(self) -> list[Skill]:
        """The skills so far, in the order of execution."""
        milestones = self.learner.milestones
        backwards = [Skill(policy, milestones.ball(start), milestones.goal(goal))
                     for policy, goal, start in zip(self.policies, self.bounds, self.bounds[1:], strict=False)]
        return backwards[::-1]

    @property
    def covered(self) -> float:
        """Share of the plan that the skills so far cover."""
        start = self.bounds[-1] if self.done or self.backplay.skill is None else self.backplay.state.saved
        return 1.0 - start / self.learner.milestones.last

    def step(self) -> None:
        """Do one session or one test of the present skill; store the skill when it is complete."""
        self.backplay.step()
        if self.backplay.done and self.backplay.saved_policy is not None:
            self.policies.append(self.backplay.saved_policy)
            self.bounds.append(self.backplay.state.saved)
            if not self.done:
                self._begin()

    def _begin(self) -> None:
        self.learner.begin(self.bounds[-1])
        self.backplay = Backplay(self.learner)

    def snapshot(self) -> Snapshot:
        """Return everything needed to go on bit for bit."""
        plain, arrays = self.learner.state()
        policies = [*self.policies, *([self.backplay.saved_policy] if self.backplay.saved_policy else [])]
        for index, policy in enumerate(policies):
            arrays |= {f"policy{index}.{name}": array for name, array in policy_to_arrays(policy).items()}
        return Snapshot({"learner": plain, "bounds": self.bounds, "backplay": self.backplay.to_dict(),
                         "policies": len(policies)}, arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from what `snapshot` returned."""
        plain = snapshot.plain
        policies = [policy_from_arrays({name.partition(".")[2]: array for name, array in snapshot.arrays.items()
                                        if name.startswith(f"policy{index}.")})
                    for index in range(plain["policies"])]
        self.bounds = list(plain["bounds"])
        finished = len(self.bounds) - 1
        self.policies = policies[:finished]
        self.learner.restore(plain["learner"], {name: array for name, array in snapshot.arrays.items()
                                                if not name.startswith("policy")})
        self.backplay = Backplay(self.learner)
        self.backplay.restore(plain["backplay"], policies[finished] if len(policies) > finished else None)
