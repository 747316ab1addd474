"""The training of one policy that follows any line with a robot, by PPO on random lines."""

import json
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.agents.ppo import PPO, PPOSettings
from pbcs_ompl.agents.rollout import Rollout
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.skills.episodes import with_random_actions
from pbcs_ompl.skills.path_following.follower import Progress
from pbcs_ompl.skills.policy import ObservationTransform
from pbcs_ompl.skills.robots.settings import RobotSettings
from pbcs_ompl.skills.robots.starts import StartDrawer, Starts
from pbcs_ompl.skills.robots.view import RobotView
from pbcs_ompl.skills.robots.worlds import Worlds, bodies

TEST_PATIENCE = 4
"""Multiples of the patience after which an execution of a test has failed (ours)."""
MARKED = 0.1
"""Fraction of the steps with progress at which an episode marks its state as a possible start (ours)."""
LAST_EPISODES = 500
"""How many the rates in progress reports are of."""


@dataclass(eq=False)
class Walks:
    """Executions in progress, as arrays of one length.

    Attributes:
        rows: The line of each [B].
        states, observations: [B, D], [B, O].
        progress: On the line.
        sides: Those that lead [B].
        steps: Since the start [B].
        marks, marked_at: A state that may become a start [B, D], and its pointer; -1 where there is none [B].
    """

    rows: IndexArray
    states: Array
    observations: Array
    progress: Progress
    sides: IndexArray
    steps: IndexArray
    marks: Array
    marked_at: IndexArray


class RobotTraining:
    """The training, in iterations of PPO.

    Args:
        worlds: Models and lines; the first model makes the bodies.
        settings: Of the task.
        agent_settings: Of PPO.
        seed: Of everything random.

    Attributes:
        transitions: Environment steps so far, those of tests included.
        best: The policy with the best test, and the fraction of the test lines to whose end it came.
    """

    def __init__(self, worlds: Worlds, settings: RobotSettings, agent_settings: PPOSettings, seed: int):
        self.worlds, self.settings, self.seeds = worlds, settings, SeedTree(seed)
        self.rng = self.seeds.child("walks").generator()
        standing, stumbling, self.transitions = bodies(worlds.models[0], settings.starts, self.seeds)
        self.starts = StartDrawer(worlds, settings.starts, standing, stumbling, settings.lines.clearance)
        self.view = self._view(stumbling)
        model = worlds.models[0]
        self.agent = PPO(self.view.size, model.action_low, model.action_high, settings=agent_settings, seeds=(seed,))
        self.best: Policy = self.agent.policy()
        self.best_rate = -1.0
        self.next_test = settings.test_transitions
        self.walks = self._begin(self.starts.draw(settings.robots, self.rng))
        self.walks.steps = self.rng.integers(0, settings.max_steps, settings.robots)
        self.endings: deque[tuple[bool, bool, bool]] = deque(maxlen=LAST_EPISODES)

    def _view(self, stumbling: Array) -> RobotView:
        """Return what the policy sees, standardised by bodies in all directions."""
        worlds, lines = self.worlds, self.settings.lines
        rng = self.seeds.child("normaliser").generator()
        size = worlds.models[0].observation_size - 2
        view = RobotView(worlds.robot, ObservationTransform.identity(size),
                         np.array([lines.near, lines.middle, lines.far]), lines.window, self.settings.patience)
        angles = rng.uniform(-np.pi, np.pi, len(stumbling))
        turned = worlds.robot.put(stumbling, np.zeros((len(stumbling), 2)), angles)
        sides = rng.integers(0, len(worlds.robot.symmetries), len(stumbling))
        body, _ = view.body(worlds.models[0].observe(turned), sides)
        deviation = body.std(axis=0)
        transform = ObservationTransform(body.mean(axis=0), np.where(deviation > 1e-3, deviation, 1.0))
        return RobotView(view.robot, transform, view.distances, view.window, view.patience)

    def _begin(self, starts: Starts) -> Walks:
        count = len(starts.rows)
        observations = self.worlds.models[0].observe(starts.states)
        progress = Progress.at(starts.pointers)
        sides = self.view.leading(observations, self.worlds.lines[starts.rows], progress,
                                  np.full(count, -1, dtype=np.int64))
        return Walks(starts.rows, starts.states.copy(), observations, progress, sides,
                     np.zeros(count, dtype=np.int64), np.zeros_like(starts.states), np.full(count, -1, dtype=np.int64))

    def _inputs(self, walks: Walks) -> Array:
        return self.view.inputs(walks.observations, self.worlds.lines[walks.rows], walks.progress, walks.sides)

    def iterate(self) -> dict[str, float]:
        """Make one rollout and one iteration of PPO on it; return plain numbers about it."""
        parts: list[tuple[Any, ...]] = []
        inputs = self._inputs(self.walks)
        for _ in range(self.settings.horizon):
            inputs, part = self._step(inputs)
            parts.append(part)
        rollout = Rollout(*(np.stack(part)[None] for part in zip(*parts, strict=True)))
        losses = self.agent.train(rollout)
        rates = np.array(self.endings, dtype=np.float64).reshape(-1, 3)
        means = rates.mean(axis=0) if len(rates) else np.zeros(3)
        return {"transitions": self.transitions, "success": float(means[0]), "terminated": float(means[1]),
                "stalled": float(means[2]), "reward": float(rollout.rewards.mean()), "best": self.best_rate,
                "std": float(self.agent.log_std.values.exp().mean()),
                **{name: float(values[0]) for name, values in losses.items()}}

    def _step(self, inputs: Array) -> tuple[Array, tuple[Any, ...]]:
        """Make one step of all walks; return the next inputs and what the rollout keeps."""
        settings, walks, model = self.settings, self.walks, self.worlds.models[0]
        drawn = self.agent.explore(inputs[None])
        controls = self.view.controls(drawn.actions[0], walks.sides)
        controls = with_random_actions(model, controls, settings.epsilon, self.rng)
        gains, reached, fallen, ended = self._advance(walks, controls)
        stalled = walks.progress.stalled >= settings.patience
        terminal = reached | fallen | stalled
        over = terminal | ended | (walks.steps >= settings.max_steps)
        effort = np.square(np.clip(drawn.inner[0], -1.0, 1.0)).sum(axis=1)
        rewards = (settings.progress_reward * gains + settings.success_reward * reached - settings.effort * effort
                   - settings.stray_cost * self._strayed() - settings.crash_cost * fallen)
        continues = np.where(terminal, 0.0, np.exp(-gains / settings.progress_length))
        following = self._inputs(walks)
        kept = (inputs, drawn.inner[0], drawn.log_densities[0], rewards, drawn.values[0],
                self.agent.value(following[None])[0], continues, over)
        self._mark(gains, reached)
        finished = np.flatnonzero(over)
        if len(finished):
            self.endings += zip(reached[finished], fallen[finished], stalled[finished], strict=True)
            hung = finished[(stalled & ~fallen & ~reached)[finished]]
            self.starts.stalled.add(walks.rows[hung], walks.states[hung], walks.progress.pointers[hung])
            following[finished] = self._restart(finished)
        return following, kept

    def _advance(self, walks: Walks, controls: Array) -> tuple[Array, BoolArray, BoolArray, BoolArray]:
        """Move walks by one step; return lengths of progress, and which reached the end, fell, and were ended [B]."""
        lines = self.worlds.lines[walks.rows]
        after = self.worlds.step(walks.rows, walks.states, controls)
        self.transitions += len(controls)
        places = self.view.places(after.observations)
        progress = walks.progress.advanced(lines, places, self.view.window)  # type: ignore[arg-type]
        gains = (progress.pointers - walks.progress.pointers) * lines.spacing
        reached = self._reached(lines, places, progress.pointers)
        walks.states, walks.observations, walks.progress = after.states, after.observations, progress
        walks.sides = self.view.leading(after.observations, lines, progress, walks.sides)
        walks.steps = walks.steps + 1
        return gains, reached, after.terminated & ~reached, after.ended

    def _reached(self, lines: Any, places: Array, pointers: IndexArray) -> BoolArray:
        radius = self.settings.lines.goal_radius
        near = lines.away(places, lines.last) < radius
        reached: BoolArray = near & ((lines.last - pointers) * lines.spacing <= 2.0 * radius)
        return reached

    def _strayed(self) -> Array:
        """Return the distances [B] of the walks from their pointers, lengths."""
        places, lines = self.view.places(self.walks.observations), self.worlds.lines[self.walks.rows]
        return lines.away(places, self.walks.progress.pointers)

    def _mark(self, gains: Array, reached: BoolArray) -> None:
        """Keep states from which an episode has advanced, and mark new ones."""
        walks, pointers = self.walks, self.walks.progress.pointers
        spacing = self.worlds.lines[walks.rows].spacing
        far = (pointers - walks.marked_at) * spacing >= self.settings.starts.advance
        won = np.flatnonzero((walks.marked_at >= 0) & (far | reached))
        self.starts.advanced.add(walks.rows[won], walks.marks[won], walks.marked_at[won])
        walks.marked_at[won] = -1
        new = (walks.marked_at < 0) & (gains > 0) & (self.rng.random(len(gains)) < MARKED)
        walks.marks[new], walks.marked_at[new] = walks.states[new], pointers[new]

    def _restart(self, members: IndexArray) -> Array:
        """Begin episodes again in the place of some; return their inputs."""
        walks, fresh = self.walks, self._begin(self.starts.draw(len(members), self.rng))
        walks.rows[members], walks.states[members] = fresh.rows, fresh.states
        walks.observations[members], walks.sides[members] = fresh.observations, fresh.sides
        walks.progress.pointers[members], walks.progress.stalled[members] = fresh.progress.pointers, 0
        walks.steps[members], walks.marked_at[members] = 0, -1
        return self._inputs(fresh)

    @property
    def iteration_transitions(self) -> int:
        """Environment steps of an iteration."""
        return self.settings.robots * self.settings.horizon

    @property
    def longest_test(self) -> int:
        """The most environment steps of a test."""
        return (len(self.worlds.world_of) - self.worlds.num_training) * self.settings.test_steps

    def test(self, most_transitions: int) -> float:
        """Return the fraction of the test lines to whose end the policy leads without noise; keep the best policy.

        Args:
            most_transitions: Those of the training beyond which no step is made; walks that are on the way then failed.
        """
        policy = self.agent.policy()
        walks = self._begin(self.starts.tests(self.seeds.child("test").generator()))
        count, reached = len(walks.rows), 0
        for _ in range(self.settings.test_steps):
            if self.transitions + len(walks.rows) > most_transitions:
                break
            actions = policy.act(self._inputs(walks))
            _, success, fallen, ended = self._advance(walks, self.view.controls(actions, walks.sides))
            reached += int(success.sum())
            patience = TEST_PATIENCE * self.settings.patience
            going = np.flatnonzero(~(success | fallen | ended | (walks.progress.stalled >= patience)))
            if not len(going):
                break
            walks = _members(walks, going)
        rate = reached / count
        if rate >= self.best_rate:
            self.best, self.best_rate = policy, rate
        self.next_test = self.transitions + self.settings.test_transitions
        return rate

    def state_dict(self) -> dict[str, np.ndarray]:
        """Return everything that a resumed training needs, as named arrays."""
        walks, plain = self.walks, {
            "transitions": self.transitions, "best_rate": self.best_rate, "next_test": self.next_test,
            "added": [self.starts.advanced.added, self.starts.stalled.added],
            "endings": [[bool(flag) for flag in ending] for ending in self.endings],
            "rng": self.rng.bit_generator.state}
        arrays = {"rows": walks.rows, "states": walks.states, "sides": walks.sides, "steps": walks.steps,
                  "marks": walks.marks, "marked_at": walks.marked_at, "pointers": walks.progress.pointers,
                  "stalled": walks.progress.stalled}
        for name, pool in (("advanced", self.starts.advanced), ("stalls", self.starts.stalled)):
            arrays |= {f"{name}/rows": pool.rows, f"{name}/states": pool.states, f"{name}/pointers": pool.pointers}
        return ({f"walks/{name}": array for name, array in arrays.items()}
                | {f"agent/{name}": array for name, array in self.agent.state_dict().items()}
                | {f"best/{name}": array for name, array in self.best.to_arrays().items()}
                | {"plain": np.array(json.dumps(plain))})

    def load_state_dict(self, state: dict[str, np.ndarray]) -> None:
        """Continue from `state_dict()` of a training with the same arguments."""
        plain, walks = json.loads(str(state["plain"])), self.walks
        self.transitions, self.best_rate, self.next_test = (plain[name] for name in (
            "transitions", "best_rate", "next_test"))
        self.endings = deque(map(tuple, plain["endings"]), maxlen=LAST_EPISODES)
        self.rng.bit_generator.state = plain["rng"]
        parts = {name: {key.partition("/")[2]: value for key, value in state.items() if key.startswith(f"{name}/")}
                 for name in ("walks", "agent", "best")}
        own = parts["walks"]
        walks.rows, walks.states, walks.sides, walks.steps, walks.marks, walks.marked_at = (
            own[name].copy() for name in ("rows", "states", "sides", "steps", "marks", "marked_at"))
        walks.progress = Progress(own["pointers"].copy(), own["stalled"].copy())
        walks.observations = self.worlds.models[0].observe(walks.states)
        pools = {"advanced": self.starts.advanced, "stalls": self.starts.stalled}
        for (name, pool), added in zip(pools.items(), plain["added"], strict=True):
            pool.rows, pool.states, pool.pointers = (own[f"{name}/{part}"].copy() for part in (
                "rows", "states", "pointers"))
            pool.added = added
        self.agent.load_state_dict(parts["agent"])
        self.best = Policy.from_arrays(parts["best"])


def _members(walks: Walks, members: IndexArray) -> Walks:
    """Return some of the walks."""
    return Walks(walks.rows[members], walks.states[members], walks.observations[members], walks.progress[members],
                 walks.sides[members], walks.steps[members], walks.marks[members], walks.marked_at[members])
