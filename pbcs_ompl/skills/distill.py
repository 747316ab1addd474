"""One network that does what a chain does: imitation on the states that both of them visit."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from pbcs_ompl.agents.networks import MLP, TrainedNetwork, Weights, adam_rates
from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.agents.stacked_agent import policy_of
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray, ProgressCallback
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.task import Task
from pbcs_ompl.results.files import CHAIN
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.skills.activation_sets import Ball, EnvironmentGoal
from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.episodes import with_random_actions
from pbcs_ompl.skills.evaluation import Evaluation, evaluate_chain
from pbcs_ompl.skills.observed_sets import Entry
from pbcs_ompl.skills.policy import ObservationTransform, SkillPolicy
from pbcs_ompl.skills.settings import CriterionSettings, Settings, StartSettings
from pbcs_ompl.skills.trained_controller import TrainedController

JUDGED = 2**20
"""Added to the seed for the judge's executions: no student is chosen by them."""


@dataclass(frozen=True)
class DistillSettings(Settings):
    """Settings of a distillation (ours, but for the method).

    Attributes:
        width, depth: Units of each hidden layer, and how many there are.
        rounds: The most rounds.
        episodes: Episodes of a round, and of the student's test after it.
        epsilon: Fraction of random actions in them.
        turn: How many steps the chain and the student drive in turns, on average.
        updates: Gradient steps of a round.
        batch_size: States in a mini-batch.
        learning_rate: Of Adam; it falls to a tenth in each round.
        flawless_rounds: Tests in a row in which all of the student's episodes succeed, after which it is done.
    """

    width: int = 128
    depth: int = 2
    rounds: int = 15
    episodes: int = 300
    epsilon: float = 0.1
    turn: int = 10
    updates: int = 2000
    batch_size: int = 256
    learning_rate: float = 1e-3
    flawless_rounds: int = 3

    def _check_ranges(self) -> None:
        self._check_counts("width", "depth", "rounds", "episodes", "turn", "updates", "batch_size", "flawless_rounds")
        self._check_fractions("epsilon")
        self._check_positive("learning_rate")


@dataclass(frozen=True, eq=False)
class DistillResult:
    """A student beside its teacher; both are measured by the judge with seeds of their own.

    Attributes:
        chain: The student, a chain of one skill.
        student, teacher: Executions with random actions, 100 each.
        student_nominal, teacher_nominal: One execution each without.
        rounds: How many were made.
        transitions: Environment steps of the rounds.
        updates: Gradient steps.
        seconds: Wall time of the rounds.
        seed: Root of all random streams.
        out: The folder; None when none was asked for.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0)
        >>> distilled = pbcs_ompl.distill(result.chain, settings={"rounds": 1, "updates": 100})
        >>> distilled.chain.num_policies
        1
    """

    chain: SkillChain
    student: Evaluation
    teacher: Evaluation
    student_nominal: Evaluation
    teacher_nominal: Evaluation
    rounds: int
    transitions: int
    updates: int
    seconds: float
    seed: int
    out: str | None

    @property
    def solved(self) -> bool:
        """Whether the student reaches the goal without noise, and in 95 of 100 executions with it."""
        return self.student_nominal.success_rate == 1 and self.student.success_rate >= CriterionSettings().robust_rate

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers; `success_rate` and `wilson` are the student's with random actions."""
        return {"solved": self.solved, "success_rate": self.student.success_rate, "wilson": list(self.student.wilson),
                "teacher_success_rate": self.teacher.success_rate, "teacher_wilson": list(self.teacher.wilson),
                "nominal_success_rate": self.student_nominal.success_rate,
                "teacher_nominal_success_rate": self.teacher_nominal.success_rate,
                "steps_median": self.student_nominal.steps_median,
                "teacher_steps_median": self.teacher_nominal.steps_median,
                "episodes": self.student.episodes, "epsilon": self.student.epsilon, "rounds": self.rounds,
                "transitions": self.transitions, "updates": self.updates, "seconds": self.seconds, "seed": self.seed,
                "out": self.out}


@checked
def distill(teacher: TrainedController, *, settings: dict[str, Any] | None = None, seed: int = 0,
            out: str | Path | None = None, source: str = "", on_progress: ProgressCallback | None = None,
            ) -> DistillResult:
    """Train one network to do what a chain of skills, or of policies along a line, does.

    Source: DAgger (Ross, Gordon and Bagnell, AISTATS 2011). In the first round the teacher drives; in all others it and
    the student take turns. Every state is labelled with what the teacher does there, and the student is fitted to all
    states so far. Differs: turns last some steps, and a fraction `epsilon` of actions is random. A chain keeps in mind
    how far it has come, and a student that passes by an activation set leads it astray; so the teacher ends each
    episode, and those that fail are left out. Of all students, the one that succeeds most often alone is kept.

    Args:
        teacher: A chain, or a follower of one line.
        settings: Settings that differ from those of `DistillSettings`, by name.
        seed: Root of all random streams.
        out: A new folder for config.toml, result.json and chain/, which `pbcs eval` and `pbcs export` take.
        source: Where the teacher comes from, for config.toml.
        on_progress: Called after every round with plain numbers.

    Raises:
        InvalidOption: no such setting, or a value out of its range.
        NotVerified: no fresh environment can be made, or no reset leads to the teacher's start.
        RunFolderError: the folder exists, or cannot be written.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0)
        >>> short = {"width": 64, "episodes": 100, "updates": 500}
        >>> pbcs_ompl.distill(result.chain, settings=short).student_nominal.success_rate
        1.0
    """
    chosen = DistillSettings().updated(settings or {})
    model = make(teacher.environment)
    if out is None:
        return Distillation(teacher, model, chosen, seed, on_progress).run(None)
    with RunFolder(out) as folder:
        folder.write_config({"kind": "distill", "chain": source, "settings": chosen.to_dict(), "seed": seed,
                             "environment": model.spec.to_dict()})
        result = Distillation(teacher, model, chosen, seed, on_progress).run(str(folder.path))
        result.chain.save(folder.path / CHAIN)
        folder.write_result(result.summary())
        return result


class Distillation:
    """The states seen so far, and the network that is fitted to them; see `distill`."""

    def __init__(self, teacher: TrainedController, model: ResettableModel, settings: DistillSettings, seed: int,
                 on_progress: ProgressCallback | None):
        self.teacher, self.model, self.settings, self.seed, self.on_progress = (
            teacher, model, settings, seed, on_progress)
        self.rng = SeedTree(seed).child("distill").generator()
        self.counter, self.updates, self.longest = Counter(), 0, 0
        self.low, self.high = teacher.actions.low, teacher.actions.high
        sizes = (model.observation_size, *[settings.width] * settings.depth, len(self.low))
        self.network = TrainedNetwork(MLP(sizes), [self.rng], torch.device("cpu"))
        self.observations: list[Array] = []
        self.labels: list[Array] = []
        self.transform = ObservationTransform.identity(model.observation_size)

    def run(self, out: str | None) -> DistillResult:
        """Make the rounds, choose a student, let the judge execute it and its teacher."""
        began = time.perf_counter()
        with one_thread():
            student, rounds = self.rounds()
        seconds = time.perf_counter() - began
        task, criterion = Task(self.model.spec, self.model.make_env), CriterionSettings()
        judged = [evaluate_chain(chain, task, episodes=episodes, epsilon=epsilon, seed=self.seed + JUDGED)
                  for episodes, epsilon in ((criterion.robust_episodes, criterion.robust_epsilon), (1, 0.0))
                  for chain in (student, self.teacher)]
        return DistillResult(student, judged[0], judged[1], judged[2], judged[3], rounds, self.counter.count,
                             self.updates, seconds, self.seed, out)

    def rounds(self) -> tuple[SkillChain, int]:
        """Return the best student, and how many rounds were made."""
        settings = self.settings
        self._collect(None)
        self._normalise()
        best, best_rate, flawless, made = self._student(), -1.0, 0, 0
        while made < settings.rounds and flawless < settings.flawless_rounds:
            made += 1
            self._fit()
            student = self._student()
            starts = np.repeat(self.teacher.start[None], settings.episodes, axis=0)
            rate = float(student.rollouts(self.model, starts, epsilon=settings.epsilon, rng=self.rng,
                                          counter=self.counter).success.mean())
            flawless = flawless + 1 if rate == 1.0 else 0
            if rate >= best_rate:
                best, best_rate = student, rate
            if self.on_progress is not None:
                self.on_progress({"rounds": made, "transitions": self.counter.count, "updates": self.updates,
                                  "success_rate": rate})
            self._collect(student)
        return best, made

    def _collect(self, student: SkillChain | None) -> None:
        """Add the states of episodes that the teacher drives, in turns with a student, and what the teacher does there.

        In half of the episodes they take short turns; in the others the student begins, for as long as it may need
        to get lost, and the teacher finishes. Episodes that fail are left out: the teacher has lost its way in them, so
        its actions are no advice.
        """
        model, actions, count = self.model, self.teacher.actions, self.settings.episodes
        teacher, other = self.teacher.controller(), None if student is None else student.controller()
        for controller in (teacher, other):
            if controller is not None:
                controller.reset(count)
        states, alive = np.repeat(self.teacher.start[None], count, axis=0), np.arange(count)
        success, in_turn = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        handed_over = np.where(np.arange(count) % 2, self.rng.integers(0, 2 * self.longest + 1, count), 0)
        kept: list[tuple[IndexArray, Array, Array]] = []
        step = 0
        for step in range(self.teacher.time_limit):
            seen = model.observe(states[alive])
            controls = actions.to_controls(teacher.act(seen, alive))
            kept.append((alive, seen, controls.copy()))
            if other is not None:
                in_turn ^= (self.rng.random(count) < 1.0 / self.settings.turn) & (handed_over == 0)
                driven = (in_turn | (step < handed_over))[alive, None]
                controls = np.where(driven, actions.to_controls(other.act(seen, alive)), controls)
            controls = with_random_actions(model, controls, self.settings.epsilon, self.rng)
            self.counter.spend(len(alive))
            outcome = model.transition(states[alive], controls)
            states[alive] = outcome.states
            success[alive] = outcome.success
            alive = alive[~(outcome.success | outcome.ended)]
            if not len(alive):
                break
        if student is None:
            self.longest = step + 1
        trusted = self.trusted(success)
        for members, seen, controls in kept:
            self.observations.append(seen[trusted[members]])
            self.labels.append(controls[trusted[members]])

    def trusted(self, success: BoolArray) -> BoolArray:
        """Return in which episodes [B] the teacher's actions are advice, of which ones succeeded [B]."""
        return success

    def _normalise(self) -> None:
        """Let the network see observations with mean 0 and deviation 1 over the states of the first round."""
        seen = np.concatenate(self.observations)
        deviation = seen.std(axis=0)
        self.transform = ObservationTransform(seen.mean(axis=0), np.where(deviation > 1e-9, deviation, 1.0))

    def _fit(self) -> None:
        """Fit the network to all states so far: the mean squared error of actions in [-1, 1]."""
        seen = self.transform(np.concatenate(self.observations)).astype(np.float32)
        middle, half = (self.high + self.low) / 2, (self.high - self.low) / 2
        wanted = ((np.concatenate(self.labels) - middle) / half).astype(np.float32)
        inputs, targets = torch.from_numpy(seen), torch.from_numpy(wanted)
        for rate in self._rates():
            rows = torch.from_numpy(self.rng.integers(0, len(seen), self.settings.batch_size))
            self.network.autograd(_squared_error, inputs[rows][None], targets[rows][None])
            self.network.step(rate)
            self.updates += 1

    def _rates(self) -> Iterator[torch.Tensor]:
        """Yield the rates of Adam's steps of a round: the learning rate falls to a tenth."""
        for step in range(self.settings.updates):
            learning_rate = self.settings.learning_rate * 10.0 ** (-step / self.settings.updates)
            yield adam_rates(learning_rate, [self.updates + 1], torch.device("cpu"))[0]

    def _student(self) -> SkillChain:
        """Return the network as a chain of one skill."""
        policy: Policy = policy_of(self.network, 0, self.low, self.high)
        teacher = self.teacher
        skill = Skill(SkillPolicy(policy, self.transform), Ball(teacher.start, StartSettings().radius),
                      EnvironmentGoal(self.model.goal_threshold), Entry())
        return SkillChain((skill,), teacher.start, teacher.environment, teacher.time_limit, teacher.actions,
                          teacher.reset_seed)


def _squared_error(weights: Weights, inputs: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
    """Return the mean squared errors [S] of actions for inputs [S, B, I] and targets [S, B, A]."""
    return (weights(inputs).tanh() - targets).square().mean(dim=(1, 2))
