"""PBCS: a chain of skills, each learnt by Backplay, from the target back to the start; [Matheron2020] Alg. 6."""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.skills.backplay import Backplay
from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.goals import ActivationSet, Goal
from pbcs_ompl.skills.learner import Learner
from pbcs_ompl.skills.method import Snapshot
from pbcs_ompl.skills.policy import SkillPolicy, policy_from_arrays, policy_to_arrays
from pbcs_ompl.skills.set_arrays import from_arrays, kind_of, to_arrays

VERIFIED_RATE = 0.985
"""Share of noisy executions that must arrive for a chain to be taken as it is.

Well above the 95 of 100 that count as solved: of 500 executions, a chain whose true rate is 0.97 reaches this share in
about one case of sixty, and one whose true rate is 0.985 fails 95 of 100 in about one case of 240."""


class Link(NamedTuple):
    """A skill by the milestones between which it leads."""

    start: int
    goal: int
    policy: SkillPolicy
    activation: ActivationSet


class PBCS:
    """Plan, Backplay, Chain Skills.

    Backplay learns a skill that ends at the target and starts at some milestone K; the next skill ends in the ball of
    K, and so on until one starts at milestone 0.

    Source: [Matheron2020] Alg. 6. Differs: the loop ends when a skill starts at index 0 (Alg. 7 never trains index 0,
    so that Alg. 6 would not end). With `verify_episodes`, the complete chain is executed once without random actions
    and, if it arrives, that many times with them; when it does not, or too many executions fail, the skill in which
    most of them got stuck is taken out and the gap is learnt anew with fresh networks.
    """

    def __init__(self, learner: Learner):
        self.learner = learner
        self.links: list[Link] = []
        """From the start to the target; with a gap while one is being learnt."""
        self.verified = not learner.settings.verify_episodes
        self._begin(learner.milestones.last, 0)

    @property
    def complete(self) -> bool:
        """Whether the links lead from the start to the target without a gap."""
        return self.goal == self.floor

    @property
    def done(self) -> bool:
        """Whether the chain is complete and, if asked for, verified."""
        return self.complete and self.verified

    @property
    def skills(self) -> list[Skill]:
        """The skills so far, in the order of execution."""
        return [Skill(link.policy, link.activation, self._goal_at(link.goal)) for link in self.links]

    @property
    def covered(self) -> float:
        """Share of the plan that the skills so far cover."""
        learnt = self.goal - self.backplay.state.saved if self.backplay.saved_policy and not self.complete else 0
        return (sum(link.goal - link.start for link in self.links) + learnt) / self.learner.milestones.last

    def step(self) -> None:
        """Do one session or one test of the present skill, or verify the complete chain."""
        if self.complete:
            self._verify()
            return
        self.backplay.step()
        if self.backplay.done and self.backplay.saved_policy is not None:
            start = self.backplay.state.saved
            activation = self.learner.activation(start, self.backplay.saved_policy)
            self.links.append(Link(start, self.goal, self.backplay.saved_policy, activation))
            self.links.sort(key=lambda link: link.start)
            self._begin(start, self.floor)

    def _begin(self, goal: int, floor: int) -> None:
        """Learn the way from milestone `floor` to milestone `goal`, unless there is nothing left of it."""
        self.goal, self.floor = goal, floor
        if not self.complete:
            self.learner.begin(goal, self._goal_at(goal))
        self.backplay = Backplay(self.learner, floor)

    def _goal_at(self, index: int) -> Goal:
        """Return what a skill that ends at milestone `index` aims at: the activation set of the skill from there on."""
        sets: dict[int, Goal] = {link.start: link.activation for link in self.links}
        return sets.get(index, self.learner.milestones.goal(index))

    def _verify(self) -> None:
        learner = self.learner
        chain = SkillChain.of(self.skills, learner.milestones)
        starts = np.repeat(learner.milestones.states[:1], learner.settings.verify_episodes, axis=0)
        tried = chain.rollouts(learner.model, starts[:1])
        learner.counter.count += int(tried.steps.sum())
        if tried.success.all():
            tried = chain.rollouts(learner.model, starts, epsilon=learner.settings.epsilon, rng=learner.rng)
            learner.counter.count += int(tried.steps.sum())
        self.verified = bool(tried.success.mean() >= VERIFIED_RATE)
        if not self.verified:
            weakest = self.links.pop(int(np.bincount(tried.skills[~tried.success]).argmax()))
            learner.restart()
            self._begin(weakest.goal, weakest.start)

    def snapshot(self) -> Snapshot:
        """Return everything needed to go on bit for bit."""
        plain, arrays = self.learner.state()
        saved = self.backplay.saved_policy
        policies = [link.policy for link in self.links] + ([saved] if saved else [])
        for index, policy in enumerate(policies):
            arrays |= {f"policy{index}.{name}": array for name, array in policy_to_arrays(policy).items()}
        for index, link in enumerate(self.links):
            arrays |= to_arrays(link.activation, f"activation{index}")
        return Snapshot({"learner": plain,
                         "links": [[link.start, link.goal, kind_of(link.activation)] for link in self.links],
                         "goal": self.goal, "floor": self.floor, "verified": self.verified,
                         "backplay": self.backplay.to_dict(), "policies": len(policies)}, arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from what `snapshot` returned."""
        plain = snapshot.plain
        policies = [policy_from_arrays({name.partition(".")[2]: array for name, array in snapshot.arrays.items()
                                        if name.startswith(f"policy{index}.")})
                    for index in range(plain["policies"])]
        self.links = [Link(start, goal, policies[index], from_arrays(kind, snapshot.arrays, f"activation{index}"))
                      for index, (start, goal, kind) in enumerate(plain["links"])]
        self.goal, self.floor, self.verified = plain["goal"], plain["floor"], plain["verified"]
        self.learner.restore(plain["learner"], {name: array for name, array in snapshot.arrays.items()
                                                if not name.startswith(("policy", "activation"))})
        self.learner.aim(self.learner.goal_index, self._goal_at(self.learner.goal_index))
        self.backplay = Backplay(self.learner, self.floor)
        self.backplay.restore(plain["backplay"],
                              policies[len(self.links)] if len(policies) > len(self.links) else None)
