"""Path following: one policy along the whole plan, and more only where one does not succeed."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import exp
from typing import NamedTuple

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.skills.method import Snapshot
from pbcs_ompl.skills.path_following.chain import FollowChain
from pbcs_ompl.skills.path_following.follower import Progress, Relay
from pbcs_ompl.skills.path_following.settings import FollowSettings
from pbcs_ompl.skills.path_following.task import FollowTask, Position
from pbcs_ompl.skills.path_following.verdict import Trouble, Verdict, judged
from pbcs_ompl.skills.trainer import SkillTrainer

SHORTEST_SESSION = 250
"""Transitions of a session along a short line."""


class Member(NamedTuple):
    """A policy, and the pointer from which it acts."""

    first: int
    policy: Policy


@dataclass
class FollowState:
    """The variables of the loop.

    Attributes:
        end: The pointer at which the present policy ends; beyond the line, it ends at the environment's goal.
        phase: What comes next: "train", "test" or "split".
        tests: Tests that the present policy has failed.
        tested: Transitions of the last of them.
        best_rate, best_blocked: Those of its best test so far.
        candidate: The pointer from which the best policy is tried next, in a split.
        passed: Whether the policies lead from the start to the goal.
        rounds: How often training has begun again.
        refusals: How often the judge has refused the policies.
    """

    end: int
    phase: str = "train"
    tests: int = 0
    tested: int = 0
    best_rate: float = -1.0
    best_blocked: int = 0
    candidate: int = 0
    passed: bool = False
    rounds: int = 0
    refusals: int = 0


class Follow:
    """Trains one policy to move along the plan, from states all along it, until it passes a sequential test.

    A test executes the policy from the start once without noise and, if that succeeds, with random actions until the
    sequential test has an answer: under stress until training has begun again or the judge has refused a policy that
    passed (one that stalls is helped by random actions), later without. Where the last test without stress found
    failures, executions begin shortly before them and end shortly after them first: a policy that still fails there is
    refused for a fraction of the steps.

    After `attempts` failed tests the best policy is tested without stress. Where it fails, training begins again with
    new networks, longer sessions and a longer horizon. From then on the line is split first: the best policy is tried
    from where its failures ended. From the first place where it passes it is kept to the end, and a new policy is
    trained up to there.

    Source: ours. Starts all along a demonstration are those of DeepMimic (Peng et al. 2018, "reference state
    initialization"); the split is the idea of [Matheron2020] chapter 7.
    """

    def __init__(self, trainer: SkillTrainer, settings: FollowSettings):
        self.trainer, self.settings = trainer, settings
        self.task = FollowTask.of(trainer.model, trainer.waypoints.states, settings.line)
        low, high = trainer.model.action_low, trainer.model.action_high
        self._middle, self._half = (high + low) / 2.0, (high - low) / 2.0
        self.members: list[Member] = []
        """Finished policies, in the order of execution."""
        self.best: Policy | None = None
        self._train_to(FollowState(self.task.line.last + 1))

    def _train_to(self, state: FollowState) -> None:
        """Train a policy from the start to the pointer `state.end` from now on."""
        self.state = state
        self.best = None
        self._retries: Position | None = None
        self._trouble: Trouble | None = None
        self._average = self._present()
        self._position = self._fresh(self.trainer.settings.episodes_per_batch)
        self._steps = np.zeros(len(self._position.states), dtype=np.int64)

    @property
    def done(self) -> bool:
        """Whether the policies lead from the start to the goal."""
        return self.state.passed

    @property
    def skills(self) -> Sequence[Member]:
        """The policies that have passed a test, in the order of execution."""
        return self.members

    @property
    def covered(self) -> float:
        """Fraction of the line that the best policy so far has come along, with those after it."""
        finished = self.task.line.last + 1 - self.state.end
        return 1.0 if self.done else (finished + min(self.state.best_blocked, self.state.end)) / (
            self.task.line.last + 1)

    @property
    def standing(self) -> str:
        """How far training has come, in words."""
        rate, last = max(0.0, self.state.best_rate), max(1, self.task.line.last)
        return (f"{rate:.0%} of the noisy executions of the best policy successful, its failures at "
                f"{self.state.best_blocked / last:.0%} of the line")

    @property
    def longest_step(self) -> int:
        """The most transitions that a step may take."""
        return max(self._session_transitions, (self.settings.gate.most_trials + 1) * self._max_steps)

    @property
    def _session_transitions(self) -> int:
        return max(max(SHORTEST_SESSION, self.settings.session_lengths * self.task.hops) << self.state.rounds,
                   round(self.settings.test_share * self.state.tested))

    @property
    def _max_steps(self) -> int:
        """Time limit of an execution along the whole line, in steps; the environment ends it at its own."""
        longest = self.settings.criterion.time_limit_factor * max(self.task.hops, self.settings.episodes.max_steps)
        return min(longest, self.trainer.model.max_episode_steps)

    def chain(self, steps_per_skill: int) -> FollowChain:
        """Return the finished policies as a controller; before they lead from the start, with the best of the present.

        Args:
            steps_per_skill: Shortest time limit of an execution.
        """
        first = [] if self.done else [Member(0, self.best or self._average)]
        return FollowChain.of([*first, *self.members], self.task, self.trainer.waypoints,
                              max(steps_per_skill, self._max_steps))

    def step(self) -> None:
        """Train for a session, test the policy, or try the best one from another place."""
        if self.state.phase == "train":
            for _ in range(-(-self._session_transitions // len(self._steps))):
                self._train_step()
            self.state.phase = "test"
        elif self.state.phase == "test":
            self._test()
        else:
            self._split()

    def _train_step(self) -> None:
        """Make one step of all episodes, and the updates that are due."""
        trainer, task, position = self.trainer, self.task, self._position
        inputs = task.inputs(position)
        actions = self._explore(inputs)
        trainer.counter.spend(len(actions))
        after = task.step(position, self._middle + self._half * actions)
        progress = after.position.progress
        reached = after.success | (progress.pointers >= self.state.end)
        terminals = reached | after.terminated | (progress.stalled >= self.settings.line.patience)
        gains = after.gains - self.settings.stray_cost * after.strayed
        rewards = (self.settings.progress_reward * gains - self.settings.effort_cost * (actions ** 2).mean(axis=1)
                   + trainer.settings.success_reward * (reached * 1.0 - (after.terminated & ~reached)))
        trainer.agent.add_transitions(inputs[None], actions[None], rewards[None], task.inputs(after.position)[None],
                                      terminals[None])
        self._steps += 1
        over = np.flatnonzero(terminals | after.ended | (self._steps >= trainer.settings.max_steps))
        self._position = after.position
        if len(over):
            self._position.put(over, self._fresh(len(over)))
            self._steps[over] = 0
        before = trainer.updates
        trainer.train(len(actions))
        self._average = self._average.blended(self._present(), self._renewed(trainer.updates - before))

    def _renewed(self, updates: int) -> float:
        """Return the part of the averaged policy that some updates replace by the present one."""
        memory = self.settings.averaging * self._session_transitions * self.trainer.settings.updates_per_transition
        return 1.0 - exp(-updates / memory) if memory > 0.0 else 1.0

    def _explore(self, inputs: Array) -> Array:
        """Return actions [B, A] in [-1, 1]: the agent's with noise, a few of them random."""
        trainer = self.trainer
        actions: Array = trainer.agent.explore(inputs[None])[0]
        actions = np.clip(actions + self.settings.action_noise * trainer.rng.standard_normal(actions.shape), -1.0, 1.0)
        chosen = trainer.rng.random(len(actions)) < trainer.settings.epsilon
        actions[chosen] = trainer.rng.uniform(-1.0, 1.0, (int(chosen.sum()), actions.shape[1]))
        return actions

    def _fresh(self, count: int) -> Position:
        """Return `count` executions that begin all along the plan up to the end, where others failed, or at its start.
        """
        rng, settings = self.trainer.rng, self.settings
        places = rng.integers(0, max(1, self.task.place(self.state.end)), count)
        places[rng.random(count) < settings.start_fraction] = 0
        position = self.task.at(places)
        if self._retries is not None:
            chosen = np.flatnonzero(rng.random(count) < settings.retry_fraction)
            position.put(chosen, self._retries[rng.integers(0, len(self._retries.states), len(chosen))])
        return position

    def _present(self) -> Policy:
        """Return the agent's policy, acting on the environment's controls."""
        model = self.trainer.model
        return replace(self.trainer.agent.policy(0), action_low=model.action_low.copy(),
                       action_high=model.action_high.copy())

    def _test(self) -> None:
        """Test the policy from the start; keep it if it passes, or if it is the best so far."""
        state, policy, before = self.state, self._average, self.trainer.counter.count
        stress = 1.0 if state.rounds or state.refusals else self.settings.stress
        found = self._try(policy, 0, stress)
        if found.passed:
            self.members.insert(0, Member(0, policy))
            state.passed = True
            return
        state.tests += 1
        state.tested = self.trainer.counter.count - before
        if (found.rate, found.blocked) > (state.best_rate, state.best_blocked):
            self.best, state.best_rate, state.best_blocked = policy, found.rate, found.blocked
        state.phase = "train"
        if state.tests >= self.settings.attempts:
            state.phase, state.candidate = "split", 0 if stress > 1.0 else self._beyond(state.best_blocked)

    def _split(self) -> None:
        """Try the best policy from the candidate on; keep it from there, or move on to beyond its failures.

        Before training has begun again it is tried from the start only: sessions may just have been too short.
        """
        state = self.state
        far = 0 if not state.rounds else min(state.end, int(self.task.pointers[-1])) - 1
        if self.best is None or state.candidate > far:
            self.members = []
            self._begin_again(self.task.line.last + 1)
            return
        found = self._try(self.best, state.candidate)
        if found.passed:
            self.members.insert(0, Member(state.candidate, self.best))
            state.passed = state.candidate == 0
            if not state.passed:
                self._begin_again(state.candidate)
        else:
            state.candidate = max(self._beyond(found.blocked), state.candidate + 1)

    def _begin_again(self, end: int) -> None:
        rounds = self.state.rounds + 1
        self.trainer.restart(min(2.0 ** rounds, self.settings.longest_horizon))
        self._train_to(FollowState(end, rounds=rounds, refusals=self.state.refusals))

    @property
    def refusals(self) -> int:
        """How often the judge has refused the policies."""
        return self.state.refusals

    def refused(self) -> bool:
        """Train the first policy on, and test it without stress from now on."""
        self.members.pop(0)
        self.state = replace(self.state, passed=False, phase="train", refusals=self.state.refusals + 1)
        return True

    @property
    def _window(self) -> int:
        """The window, in points of the line."""
        return max(1, round(self.settings.line.window / self.task.line.spacing))

    def _beyond(self, pointer: int) -> int:
        """Return the pointer one window after another."""
        return pointer + self._window

    def _try(self, policy: Policy, first: int, stress: float = 1.0) -> Verdict:
        """Test a policy, and the finished ones after it, from a pointer on."""
        found = self._verdict(policy, first, stress)
        self.trainer.latest |= {"start": self.task.place(first), "success_rate": max(0.0, found.rate)}
        return found

    def _verdict(self, policy: Policy, first: int, stress: float) -> Verdict:
        """Execute it once without noise, then from where the last one failed, then from the pointer on with noise.

        Under stress the first failures come so soon that those of the last policy are not tried before.
        """
        relay = Relay([policy, *(member.policy for member in self.members)],
                      [0, *(member.first for member in self.members)])
        start, goal = self.task.at(np.array([self.task.place(first)])), np.array([self.task.line.last + 1])
        ends = self._failures(relay, start, goal, 0.0).ends
        if len(ends):
            return Verdict(False, 0.0, int(ends[0]))
        if first == 0 and self._trouble is not None and stress == 1.0:
            past, _ = self._executed(relay, self._trouble.before, self._trouble.ends + 2 * self._window, stress)
            if not past.passed:
                return past._replace(rate=-1.0)
        verdict, trouble = self._executed(relay, start, goal, stress)
        if first == 0 and not verdict.passed:
            self._trouble = trouble
        return verdict

    def _executed(self, relay: Relay, starts: Position, until: IndexArray, stress: float) -> tuple[Verdict, Trouble]:
        """Return the verdict on noisy executions from starts [N] to pointers [N], in turn, and where they failed."""
        epsilon = min(1.0, stress * self.trainer.settings.test_epsilon)

        def failures(chosen: IndexArray) -> Trouble:
            return self._failures(relay, starts[chosen], until[chosen], epsilon)

        return judged(self.settings.gate.with_failures(stress), len(until), failures)

    def _failures(self, relay: Relay, starts: Position, until: IndexArray, epsilon: float) -> Trouble:
        """Return where executions from some starts [N] fail; training begins there from now on."""
        tries = self.task.execute(relay, starts, until=until, epsilon=epsilon, max_steps=self._max_steps,
                                  rng=self.trainer.rng, counter=self.trainer.counter)
        mine = np.flatnonzero(tries.retries.progress.pointers < self.state.end)
        if len(mine):
            self._retries = tries.retries[mine]
        return Trouble(tries.before, tries.pointers[~tries.success])

    def snapshot(self) -> Snapshot:
        """Return everything needed to resume bit for bit."""
        plain, arrays = self.trainer.state()
        policies = [self._average, *(member.policy for member in self.members), *([self.best] if self.best else [])]
        for index, policy in enumerate(policies):
            arrays |= {f"policy{index}.{name}": array for name, array in policy.to_arrays().items()}
        progress = self._position.progress
        arrays |= {"episode.states": self._position.states, "episode.pointers": progress.pointers,
                   "episode.stalled": progress.stalled, "episode.steps": self._steps}
        if self._retries is not None:
            arrays |= {"retry.states": self._retries.states, "retry.pointers": self._retries.progress.pointers}
        if self._trouble is not None:
            before = self._trouble.before
            arrays |= {"trouble.states": before.states, "trouble.pointers": before.progress.pointers,
                       "trouble.ends": self._trouble.ends}
        return Snapshot({"trainer": plain, "state": asdict(self.state), "policies": len(policies),
                         "firsts": [member.first for member in self.members]}, arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from what `snapshot` returned."""
        plain, arrays = snapshot.plain, snapshot.arrays
        self._average, *policies = [Policy.from_arrays({name.partition(".")[2]: array for name, array in arrays.items()
                                        if name.startswith(f"policy{index}.")}) for index in range(plain["policies"])]
        self.members = [Member(*pair) for pair in zip(plain["firsts"], policies, strict=False)]
        self.best = policies[-1] if len(policies) > len(self.members) else None
        self.trainer.restore(plain["trainer"], {name: array for name, array in arrays.items()
                                                if not name.startswith(("policy", "episode.", "retry.", "trouble."))})
        self.state = FollowState(**plain["state"])
        self._position = self._at(arrays["episode.states"], arrays["episode.pointers"], arrays["episode.stalled"])
        self._retries = self._begun("retry", arrays) if "retry.states" in arrays else None
        self._trouble = (Trouble(self._begun("trouble", arrays), arrays["trouble.ends"].copy())
                         if "trouble.states" in arrays else None)
        self._steps = arrays["episode.steps"].copy()

    def _begun(self, name: str, arrays: Mapping[str, np.ndarray]) -> Position:
        """Return starts of executions from a snapshot."""
        pointers = arrays[f"{name}.pointers"]
        return self._at(arrays[f"{name}.states"], pointers, np.zeros_like(pointers))

    def _at(self, states: Array, pointers: IndexArray, stalled: IndexArray) -> Position:
        """Return executions in some states [B, D]."""
        return Position(states.copy(), self.trainer.model.observe(states), Progress(pointers.copy(), stalled.copy()))
