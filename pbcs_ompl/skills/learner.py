"""An agent that learns one skill after another along the milestones of a plan."""

from collections.abc import Callable
from typing import Any

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.skills.agent_door import Agent
from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.classifier_set import learn_set
from pbcs_ompl.skills.episodes import Act, Episodes, run_episodes
from pbcs_ompl.skills.goals import ActivationSet, Goal
from pbcs_ompl.skills.milestones import Milestones
from pbcs_ompl.skills.policy import Frame, SkillPolicy

SAMPLES = 400
"""Episodes from which a classifier learns where a skill may start."""


class Learner:
    """Collects episodes, trains the agent on them, and tests it; counts every transition.

    Args:
        make_agent: Builds an agent, a stack of one, from a seed.
        milestones: Where episodes start and end.
        counter: Where transitions are counted.
        rng: Start states and exploration noise.
    """

    def __init__(self, make_agent: Callable[[int], Agent], milestones: Milestones, counter: Counter,
                 rng: np.random.Generator):
        self.make_agent = make_agent
        self.milestones = milestones
        self.settings = milestones.settings
        self.model: ResettableModel = milestones.model
        self.counter = counter
        self.rng = rng
        self.updates_due = 0.0
        self.updates_before = 0
        self.agent_seed = int(rng.integers(2**31))
        self.agent = make_agent(self.agent_seed)
        self.aim(milestones.last)

    def aim(self, goal_index: int, goal: Goal | None = None) -> None:
        """Work towards the milestone `goal_index` from now on: its ball, the target at the end, or `goal` around it."""
        self.goal_index = goal_index
        self.goal: Goal = self.milestones.goal(goal_index) if goal is None else goal
        self.frame: Frame = self.milestones.frame(goal_index)

    def begin(self, goal_index: int, goal: Goal | None = None) -> None:
        """Start a new skill that ends at `goal_index`: no replay and, without `warm_start`, new networks."""
        self.aim(goal_index, goal)
        self.agent.clear_replay()
        if not self.settings.warm_start and self.agent.num_updates:
            self.restart()

    def restart(self) -> None:
        """Go on with new networks and an empty replay buffer."""
        self.updates_before += self.agent.num_updates
        self.agent_seed = int(self.rng.integers(2**31))
        self.agent = self.make_agent(self.agent_seed)

    @property
    def updates(self) -> int:
        """Gradient steps so far."""
        return self.updates_before + self.agent.num_updates

    def act(self, states: Array) -> Array:
        """Return the agent's actions [B, A] in states [B, D]."""
        return self.agent.act(self.frame(self.model.observe(states))[None])[0]

    def explore(self, states: Array) -> Array:
        """Return the actions [B, A] that the agent itself would try in states [B, D]."""
        return self.agent.explore(self.frame(self.model.observe(states))[None])[0]

    def test(self, index: int) -> float:
        """Return the share of beta episodes from the ball of milestone `index` that reach the goal."""
        starts = self.milestones.starts(np.full(self.settings.beta, index), self.rng, self.counter)
        return self._run(self.act, starts, self.settings.test_epsilon).success_rate

    def session(self, index: int) -> float:
        """Train on beta episodes from the ball of milestone `index`; return the share that reached the goal.

        Source: [Matheron2020] Alg. 8. Differs: updates follow each group of `episodes_together` episodes, and a
        share `rehearsal` of the episodes starts from random milestones between `index` and the goal.
        """
        indices = np.full(self.settings.beta, index)
        rehearsed = self.rng.random(len(indices)) < self.settings.rehearsal
        indices[rehearsed] = self.rng.integers(index, self.goal_index, rehearsed.sum())
        return self.session_from(indices)

    def session_from(self, indices: IndexArray) -> float:
        """Train on one episode from the ball of each milestone in `indices`; return the share that arrived."""
        reached = 0.0
        for first in range(0, len(indices), self.settings.episodes_together):
            group = indices[first:first + self.settings.episodes_together]
            starts = self.milestones.starts(group, self.rng, self.counter)
            episodes = self._run(self.explore, starts, self.settings.epsilon)
            self._remember(episodes)
            self._train(episodes.transitions)
            reached += episodes.reached.sum()
        return float(reached / len(indices))

    def skill(self, start_index: int, policy: SkillPolicy) -> Skill:
        """Return `policy` as a skill that starts around `start_index` and leads to the present goal."""
        return Skill(policy, self.milestones.ball(start_index), self.goal)

    def activation(self, start_index: int, policy: SkillPolicy) -> ActivationSet:
        """Return where `policy` may start: the ball of `start_index`, or what is learnt by trying it around there.

        Nothing is learnt for the first skill of a chain, which is never switched to.
        """
        ball = self.milestones.ball(start_index)
        if self.settings.activation == "ball" or start_index == 0:
            return ball
        around = self.rng.choice(self.milestones.near(start_index), SAMPLES)
        starts = self.milestones.starts(around, self.rng, self.counter)
        episodes = self._run(lambda states: policy.act(self.model.observe(states)), starts, self.settings.test_epsilon)
        return learn_set(self.model.observe(starts), episodes.reached, ball.center, ball.radius,
                         int(self.rng.integers(2**31)))

    def policy(self) -> SkillPolicy:
        """Return a snapshot of the agent's policy in the present frame."""
        return SkillPolicy(self.agent.policy(0), self.frame)

    def state(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return everything needed to go on bit for bit, as plain values and arrays."""
        plain = {"goal_index": self.goal_index, "rng": self.rng.bit_generator.state,
                 "transitions": self.counter.count, "updates_due": self.updates_due,
                 "updates_before": self.updates_before, "agent_seed": self.agent_seed}
        return plain, self.agent.state_dict()

    def restore(self, plain: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `state` returned."""
        self.aim(plain["goal_index"])
        self.rng.bit_generator.state = plain["rng"]
        self.counter.count = plain["transitions"]
        self.updates_due = plain["updates_due"]
        self.updates_before = plain["updates_before"]
        self.agent_seed = plain["agent_seed"]
        self.agent = self.make_agent(self.agent_seed)
        self.agent.load_state_dict(arrays)

    def _run(self, act: Act, starts: Array, epsilon: float) -> Episodes:
        episodes = run_episodes(self.model, act, self.goal, starts, epsilon=epsilon,
                                max_steps=self.settings.max_steps, rng=self.rng, shaped=self.settings.shaped)
        self.counter.count += episodes.transitions
        return episodes

    def _remember(self, episodes: Episodes) -> None:
        before, after = (self.frame(self.model.observe(states))
                         for states in (episodes.states, episodes.next_states))
        self.agent.add_transitions(before[None], episodes.controls[None], episodes.rewards[None], after[None],
                            episodes.terminals[None])

    def _train(self, transitions: int) -> None:
        self.updates_due += transitions * self.settings.updates_per_transition
        whole = int(self.updates_due)
        self.updates_due -= whole
        if whole:
            self.agent.train(whole)
