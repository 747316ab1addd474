"""Trains one agent for one skill after another along the waypoints of a plan."""

from math import ceil
from typing import Any

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray
from pbcs_ompl.skills.activation_sets import ActivationSet, ClassifierSet, ClassifierSettings, Target, learn_set
from pbcs_ompl.skills.agent_interface import AgentFactory
from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.episodes import Act, Episodes, run_episodes
from pbcs_ompl.skills.observed_sets import Entry, ObservedClassifier, observed_ball, observed_metric
from pbcs_ompl.skills.policy import ObservationTransform, SkillPolicy
from pbcs_ompl.skills.settings import EpisodeSettings
from pbcs_ompl.skills.waypoints import Waypoints

METRIC_SAMPLES = 100
"""Waypoints, and states near them, at which distances are compared with observations."""


class SkillTrainer:
    """Collects episodes, trains the agent on them, and tests it; counts every transition.

    Args:
        make_agent: Builds an agent.
        waypoints: Where episodes start and skills end.
        settings: How episodes are run and learnt from.
        counter: Counts transitions.
        rng: Source of start states and exploration noise.
    """

    def __init__(self, make_agent: AgentFactory, waypoints: Waypoints, settings: EpisodeSettings,
                 counter: Counter, rng: np.random.Generator):
        self.make_agent = make_agent
        self.waypoints = waypoints
        self.settings = settings
        self.model: ResettableModel = waypoints.model
        self.counter = counter
        self.rng = rng
        self.updates_due = 0.0
        self.updates_before = 0
        self.agent_seed = int(rng.integers(2**31))
        self.horizon = 1.0
        self.agent = make_agent(self.agent_seed)
        self.latest: dict[str, float] = {}
        """Where the last session or test started, its success rate, the losses of updates: for those who look on."""
        self.set_target(waypoints.last)

    def set_target(self, end_index: int, target: Target | None = None) -> None:
        """Train towards the waypoint `end_index`: to its ball or the environment's goal, or to `target` around it."""
        self.end_index = end_index
        self.target: Target = self.waypoints.target(end_index) if target is None else target
        self.transform: ObservationTransform = self.waypoints.transform(end_index)

    def start_skill(self, end_index: int, target: Target, *, warm_start: bool) -> None:
        """Begin a new skill that ends at `end_index`: without replay and, without `warm_start`, with new networks."""
        self.set_target(end_index, target)
        self.agent.clear_replay()
        if not warm_start and self.agent.num_updates:
            self.restart()

    def restart(self, horizon: float = 1.0) -> None:
        """Continue with new networks and an empty replay buffer.

        Args:
            horizon: How many times as far-sighted as its settings say the agent is from now on.
        """
        self.updates_before += self.agent.num_updates
        self.agent_seed, self.horizon = int(self.rng.integers(2**31)), horizon
        self.agent = self.make_agent(self.agent_seed, horizon)

    @property
    def updates(self) -> int:
        """Gradient steps so far."""
        return self.updates_before + self.agent.num_updates

    def act(self, states: Array) -> Array:
        """Return the agent's actions [B, A] in states [B, D]."""
        actions: Array = self.agent.act(self._observe(states)[None])[0]
        return actions

    def explore(self, states: Array) -> Array:
        """Return the actions [B, A] that the agent itself would try in states [B, D]."""
        actions: Array = self.agent.explore(self._observe(states)[None])[0]
        return actions

    def limit(self, index: int) -> int:
        """Return the longest episode from waypoint `index` to the target, in steps."""
        longest, settings = self.model.max_episode_steps, self.settings
        along = ceil(settings.steps_per_waypoint * (self.end_index - index))
        return max(settings.max_steps or longest, min(along, longest))

    def test(self, index: int) -> float:
        """Return the success rate of beta episodes from waypoint `index`; of one, where all would be the same.

        It is that of the first `first_trials` of them where that is neither 0 nor 1: the others would not change this.
        """
        settings = self.settings
        count = 1 if self.waypoints.starts.exact and settings.test_epsilon == 0.0 else settings.beta
        first = min(settings.first_trials or count, count)
        reached = self._tried(index, first)
        if first < count and len(np.unique(reached)) == 1:
            reached = np.concatenate([reached, self._tried(index, count - first)])
        return float(reached.mean())

    def _tried(self, index: int, count: int) -> BoolArray:
        """Return which of `count` episodes from waypoint `index` succeed, without training."""
        starts = self.waypoints.draw_starts(np.full(count, index), self.rng, self.counter)
        return self._run(self.act, starts, self.settings.test_epsilon, self.limit(index)).reached

    def session(self, index: int, rehearsal_fraction: float = 0.0) -> float:
        """Train on beta episodes from waypoint `index`; return their success rate.

        Args:
            index: Where episodes start.
            rehearsal_fraction: Fraction of them that start from random waypoints between `index` and the target.

        Source: [Matheron2020] Alg. 8. Differs: `rehearsal_fraction`, and see `session_from`.
        """
        indices = np.full(self.settings.beta, index)
        rehearsed = self.rng.random(len(indices)) < rehearsal_fraction
        indices[rehearsed] = self.rng.integers(index, self.end_index, rehearsed.sum())
        return self.session_from(indices)

    def session_from(self, indices: IndexArray) -> float:
        """Train on one episode from each waypoint in `indices`; return their success rate.

        Updates follow each batch of `episodes_per_batch` episodes.
        """
        successes = 0.0
        for first in range(0, len(indices), self.settings.episodes_per_batch):
            batch = indices[first:first + self.settings.episodes_per_batch]
            starts = self.waypoints.draw_starts(batch, self.rng, self.counter)
            episodes = self._run(self.explore, starts, self.settings.epsilon, self.limit(int(batch.min())))
            self.add_transitions(episodes.states, episodes.controls, episodes.rewards, episodes.next_states,
                                 episodes.terminals)
            self.train(episodes.transitions)
            successes += episodes.reached.sum()
        self.latest |= {"start": int(indices.min()), "success_rate": float(successes / len(indices))}
        return float(successes / len(indices))

    def add_transitions(self, states: Array, controls: Array, rewards: Array, next_states: Array,
                        terminals: BoolArray) -> None:
        """Add transitions to the replay buffer as the present policy observes them; [N, ...] each."""
        before, after = self._observe(states), self._observe(next_states)
        self.agent.add_transitions(before[None], controls[None], rewards[None], after[None], terminals[None])

    def learn_activation(self, start_index: int, policy: SkillPolicy, settings: ClassifierSettings) -> ClassifierSet:
        """Return where `policy` may start around the waypoint `start_index`, learnt by trying it there.

        Args:
            start_index: The middle of the set.
            policy: The policy of a finished skill that leads to the present target.
            settings: Number of samples, size and training of the classifier.
        """
        ball = self.waypoints.ball(start_index)
        around = self.rng.choice(self.waypoints.near(start_index), settings.samples)
        starts = self.waypoints.draw_near(around, self.rng, self.counter)
        episodes = self._run(lambda states: policy.act(self.model.observe(states)), starts, self.settings.test_epsilon,
                             self.limit(start_index))
        return learn_set(self.model.observe(starts), episodes.reached, ball, settings, int(self.rng.integers(2**31)))

    def skill(self, start_index: int, policy: SkillPolicy) -> Skill:
        """Return `policy` as a skill that starts in the ball of `start_index` and leads to the present target."""
        return Skill(policy, self.waypoints.ball(start_index), self.target, Entry())

    def observed_metric(self) -> Array | None:
        """Return the distance of states as weights of observations, if observations show it (`observed_metric`)."""
        waypoints, rng = self.waypoints, np.random.default_rng(0)
        some = np.linspace(0, waypoints.last, METRIC_SAMPLES).astype(np.int64)
        states = np.concatenate([waypoints.states[np.unique(some)], waypoints.draw_near(some, rng, self.counter)])
        return observed_metric(self.model, states, waypoints.starts.radius)

    def entry(self, start_index: int, activation: ActivationSet, metric: Array | None,
              settings: ClassifierSettings) -> Entry:
        """Return an activation set as a set of observations.

        Where the observation shows what the distance is made of, that is a ball, with the network of a learnt set. Else
        a network learns to separate the states of the set from others along the plan.

        Args:
            start_index: The waypoint in its middle.
            activation: The set of states.
            metric: See `observed_metric`.
            settings: Number of samples, size and training of the network.
        """
        if metric is None:
            return Entry((self._learn_membership(start_index, activation, settings),))
        if isinstance(activation, ClassifierSet):
            reach = activation.reach * activation.radius
            around = observed_ball(self.model, activation.center, reach, metric)
            return Entry((around, ObservedClassifier.of(activation)))
        return Entry((observed_ball(self.model, activation.center, activation.radius, metric),))

    def _learn_membership(self, start_index: int, activation: ActivationSet,
                          settings: ClassifierSettings) -> ObservedClassifier:
        waypoints, rng = self.waypoints, self.rng
        around = np.concatenate([np.full(settings.samples, start_index),
                                 rng.integers(0, waypoints.last + 1, settings.samples)])
        states = np.concatenate([waypoints.states, waypoints.draw_near(around, rng, self.counter)])
        learnt = learn_set(self.model.observe(states), activation.contains(self.model, states),
                           waypoints.ball(start_index), settings, int(rng.integers(2**31)))
        return ObservedClassifier.of(learnt)

    def policy(self) -> SkillPolicy:
        """Return a snapshot of the agent's policy."""
        return SkillPolicy(self.agent.policy(0), self.transform)

    def state(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return everything needed to resume bit for bit, as plain values and arrays."""
        plain = {"end_index": self.end_index, "rng": self.rng.bit_generator.state,
                 "transitions": self.counter.count, "updates_due": self.updates_due,
                 "updates_before": self.updates_before, "agent_seed": self.agent_seed, "horizon": self.horizon}
        return plain, self.agent.state_dict()

    def restore(self, plain: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        """Resume from what `state` returned."""
        self.set_target(plain["end_index"])
        self.rng.bit_generator.state = plain["rng"]
        self.counter.count = plain["transitions"]
        self.updates_due = plain["updates_due"]
        self.updates_before = plain["updates_before"]
        self.agent_seed = plain["agent_seed"]
        self.horizon = plain["horizon"]
        self.agent = self.make_agent(self.agent_seed, self.horizon)
        self.agent.load_state_dict(arrays)

    def _observe(self, states: Array) -> Array:
        return self.transform(self.model.observe(states))

    def _run(self, act: Act, starts: Array, epsilon: float, max_steps: int) -> Episodes:
        settings = self.settings
        return run_episodes(self.model, act, self.target, starts, epsilon=epsilon, max_steps=max_steps, rng=self.rng,
                            success_reward=settings.success_reward if settings.shaped else None,
                            counter=self.counter)

    def train(self, transitions: int) -> None:
        self.updates_due += transitions * self.settings.updates_per_transition
        whole = int(self.updates_due)
        self.updates_due -= whole
        losses = self.agent.train(whole) if whole else None
        if isinstance(losses, dict):  # agents of others need not return any
            self.latest |= {name: float(values[0]) for name, values in losses.items() if name.endswith("_loss")}
