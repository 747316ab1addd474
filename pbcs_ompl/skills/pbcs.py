"""PBCS: a chain of skills, each trained by Backplay, from the goal back to the start; [Matheron2020] Alg. 6."""

import sys
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.skills.activation_sets import (
    ActivationSet,
    ClassifierSettings,
    Target,
    from_arrays,
    kind_of,
    to_arrays,
)
from pbcs_ompl.skills.backplay import Backplay, SkillSettings
from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.method import Snapshot, TrainingMethod
from pbcs_ompl.skills.observed_sets import Entry, entry_from_arrays, entry_kinds, entry_to_arrays
from pbcs_ompl.skills.policy import SkillPolicy, policy_from_arrays, policy_to_arrays
from pbcs_ompl.skills.sequential_test import SequentialTest
from pbcs_ompl.skills.settings import PlannedSettings
from pbcs_ompl.skills.trainer import SkillTrainer

ACTIVATIONS = ("ball", "classifier")
FIRST_TRIALS = 16
"""Executions of a verification side by side before its test is asked; each time as many again follow."""


@dataclass(frozen=True)
class PBCSSettings(PlannedSettings):
    """Settings of the method "pbcs".

    Attributes:
        skill: How one skill is trained.
        activation: "ball", or "classifier": the activation set of a finished skill is learnt from executions that
            start around its start ([Matheron2020] 7.2: balls).
        classifier: How it is learnt.
        warm_start: A new skill starts from the networks of the skill before (ours).
        verify: Execute the complete chain with random actions until `gate` has an answer; where it refuses, PBCS trains
            the weakest skill again ([Matheron2020]: no).
        gate: Of the complete chain. Each time that the judge refuses a verified chain, it allows half as many failures.
    """

    skill: SkillSettings = field(default_factory=SkillSettings)
    activation: str = "ball"
    classifier: ClassifierSettings = field(default_factory=ClassifierSettings)
    warm_start: bool = False
    verify: bool = False
    gate: SequentialTest = field(default_factory=SequentialTest)

    def _check_ranges(self) -> None:
        check_range("activation", self.activation, self.activation in ACTIVATIONS, f"one of {', '.join(ACTIVATIONS)}")


class ChainLink(NamedTuple):
    """A skill by the waypoints between which it leads."""

    start: int
    end: int
    policy: SkillPolicy
    activation: ActivationSet
    entry: Entry


class PBCS(TrainingMethod):
    """Plan, Backplay, Chain Skills.

    Backplay trains a skill that ends at the goal and starts at some waypoint K; the next skill ends in the ball of K,
    and so on until one starts at waypoint 0.

    Source: [Matheron2020] Alg. 6. Differs: the loop ends when a skill starts at index 0 (Alg. 7 never trains index 0,
    so that Alg. 6 would not end). With `verify`, the complete chain is executed once without random actions and, if it
    succeeds, with them until a sequential test has an answer; when it refuses, the skill in which most executions
    failed is removed and the gap is trained again with new networks. A chain that passes, and that
    the judge refuses, has to pass a stricter test.
    """

    def __init__(self, trainer: SkillTrainer, settings: PBCSSettings):
        self.trainer = trainer
        self.settings = settings
        self.links: list[ChainLink] = []
        """From the start to the goal; with a gap while one is being trained."""
        self.verified = not settings.verify
        self._refusals = 0
        self.metric = trainer.observed_metric()
        self._train_between(0, trainer.waypoints.last)

    @property
    def complete(self) -> bool:
        """Whether the links lead from the start to the goal without a gap."""
        return self.end == self.min_index

    @property
    def done(self) -> bool:
        """Whether the chain is complete and, if asked for, verified."""
        return self.complete and self.verified

    @property
    def refusals(self) -> int:
        """How often the judge has refused the chain."""
        return self._refusals

    def refused(self) -> bool:
        """Verify the chain again, by a stricter test, where chains are verified."""
        if not self.settings.verify:
            return False
        self._refusals += 1
        self.verified = False
        return True

    @property
    def skills(self) -> list[Skill]:
        """The skills so far, in the order of execution."""
        return [Skill(link.policy, link.activation, self._target_at(link.end), link.entry) for link in self.links]

    @property
    def covered(self) -> float:
        """Fraction of the plan that the skills so far cover."""
        trained = self.end - self.backplay.state.saved if self.backplay.saved_policy and not self.complete else 0
        return (sum(link.end - link.start for link in self.links) + trained) / self.trainer.waypoints.last

    @property
    def standing(self) -> str:
        """How far training has come, in words."""
        covered = f"{self.covered:.0%} of the plan covered"
        if self.complete:
            return f"{covered}, but the chain does not pass its verification"
        state, last = self.backplay.state, self.trainer.waypoints.last
        return (f"{covered}; of the episodes that begin at {state.start / last:.0%} of it and are to end at "
                f"{self.end / last:.0%}, {max(0.0, state.best):.0%} succeed in the best session")

    @property
    def longest_step(self) -> int:
        """The most transitions that the next step may take; nothing is known of a verification."""
        episodes = self.trainer.settings
        return sys.maxsize if self.complete else 2 * episodes.beta * episodes.max_steps

    def chain(self, steps_per_skill: int) -> SkillChain | None:
        """Return the skills so far as a chain; None where there are none.

        Args:
            steps_per_skill: Time limit of an execution, in steps for each skill.
        """
        return SkillChain.of(self.skills, self.trainer.waypoints, steps_per_skill) if self.links else None

    def step(self) -> None:
        """Do one session or one test of the present skill, or verify the complete chain."""
        if self.complete:
            self._verify()
            return
        self.backplay.step()
        if self.backplay.done and self.backplay.saved_policy is not None:
            start, policy = self.backplay.state.saved, self.backplay.saved_policy
            activation = self._activation(start, policy)
            self.links.append(ChainLink(start, self.end, policy, activation, self._entry(start, activation)))
            self.links.sort(key=lambda link: link.start)
            self._train_between(self.min_index, start)

    def _train_between(self, min_index: int, end: int) -> None:
        """Train from waypoint `min_index` to waypoint `end` next, unless there is nothing left between them."""
        self.min_index, self.end = min_index, end
        if not self.complete:
            self.trainer.start_skill(end, self._target_at(end), warm_start=self.settings.warm_start)
        self.backplay = Backplay(self.trainer, self.settings.skill, min_index)

    def _activation(self, start: int, policy: SkillPolicy) -> ActivationSet:
        """Return where the finished skill may start; nothing is learnt for the first skill of a chain."""
        if self.settings.activation == "ball" or start == 0:
            return self.trainer.waypoints.ball(start)
        return self.trainer.learn_activation(start, policy, self.settings.classifier)

    def _entry(self, start: int, activation: ActivationSet) -> Entry:
        """Return the same set for observations; the first skill of a chain needs none."""
        if start == 0:
            return Entry()
        return self.trainer.entry(start, activation, self.metric, self.settings.classifier)

    def _target_at(self, index: int) -> Target:
        """Return where a skill that ends at waypoint `index` leads: the activation set of the skill from there on."""
        sets: dict[int, Target] = {link.start: link.activation for link in self.links}
        return sets.get(index, self.trainer.waypoints.target(index))

    def _verify(self) -> None:
        """Test the complete chain; where it is refused, remove the skill in which most executions failed."""
        trainer, settings = self.trainer, self.settings
        gate = settings.gate.with_failures(0.5 ** self._refusals)
        chain = SkillChain.of(self.skills, trainer.waypoints, settings.steps_per_skill)
        failures = self._failures(chain, 1, 0.0)
        verdict = False if len(failures) else None
        trials = 0
        while verdict is None:
            count = min(max(trials, FIRST_TRIALS), gate.most_needed(trials - len(failures), trials))
            failures = np.concatenate([failures, self._failures(chain, count, settings.episodes.epsilon)])
            trials += count
            verdict = gate.verdict(trials - len(failures), trials)
        self.verified = verdict
        if not verdict:
            weakest = self.links.pop(int(np.bincount(failures).argmax()))
            trainer.restart()
            self._train_between(weakest.start, weakest.end)

    def _failures(self, chain: SkillChain, count: int, epsilon: float) -> IndexArray:
        """Return the skills in which those of `count` executions that fail come to their ends [at most count]."""
        trainer = self.trainer
        starts = np.repeat(trainer.waypoints.states[:1], count, axis=0)
        tried = chain.rollouts(trainer.model, starts, epsilon=epsilon, rng=trainer.rng, counter=trainer.counter)
        return tried.skills[~tried.success]

    def snapshot(self) -> Snapshot:
        """Return everything needed to resume bit for bit."""
        plain, arrays = self.trainer.state()
        saved = self.backplay.saved_policy
        policies = [link.policy for link in self.links] + ([saved] if saved else [])
        for index, policy in enumerate(policies):
            arrays |= {f"policy{index}.{name}": array for name, array in policy_to_arrays(policy).items()}
        for index, link in enumerate(self.links):
            arrays |= to_arrays(link.activation, f"activation{index}") | entry_to_arrays(link.entry, f"entry{index}")
        return Snapshot({"trainer": plain,
                         "links": [[link.start, link.end, kind_of(link.activation), entry_kinds(link.entry)]
                                   for link in self.links],
                         "end": self.end, "min_index": self.min_index, "verified": self.verified,
                         "refusals": self._refusals, "backplay": self.backplay.to_dict(),
                         "policies": len(policies)}, arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from what `snapshot` returned."""
        plain = snapshot.plain
        policies = [policy_from_arrays({name.partition(".")[2]: array for name, array in snapshot.arrays.items()
                                        if name.startswith(f"policy{index}.")})
                    for index in range(plain["policies"])]
        self.links = [ChainLink(start, end, policies[index], from_arrays(kind, snapshot.arrays, f"activation{index}"),
                                entry_from_arrays(kinds, snapshot.arrays, f"entry{index}"))
                      for index, (start, end, kind, kinds) in enumerate(plain["links"])]
        self.end, self.min_index, self.verified = plain["end"], plain["min_index"], plain["verified"]
        self._refusals = plain["refusals"]
        self.trainer.restore(plain["trainer"], {name: array for name, array in snapshot.arrays.items()
                                                if not name.startswith(("policy", "activation", "entry"))})
        self.trainer.set_target(self.trainer.end_index, self._target_at(self.trainer.end_index))
        self.backplay = Backplay(self.trainer, self.settings.skill, self.min_index)
        self.backplay.restore(plain["backplay"],
                              policies[len(self.links)] if len(policies) > len(self.links) else None)
