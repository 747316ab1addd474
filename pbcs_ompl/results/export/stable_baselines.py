"""A policy and a replay buffer for stable-baselines3: training continues there where it ended here."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.errors import InvalidOption, MissingDependency
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.results.export.episodes import Episode, Recorder
from pbcs_ompl.results.files import write_errors
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.policy import SkillPolicy
from pbcs_ompl.skills.trained_controller import TrainedController

CAPACITY = 1_000_000
"""Transitions of the replay buffer, stable-baselines3's default."""


def write_stable_baselines(recorder: Recorder, episodes: Sequence[Episode], folder: Path,
                           controller: TrainedController | None) -> list[Path]:
    """Write model.zip, a TD3 whose actor is the controller, and replay_buffer.pkl, the transitions of the episodes.

    The critics of the model are new. Without a controller, its actor is new as well.

    Args:
        recorder: Of the task.
        episodes: What the replay buffer holds.
        folder: Where.
        controller: A chain of one skill; None for a plan alone.

    Raises:
        MissingDependency: stable-baselines3 is not installed.
        InvalidOption: the controller has several policies or normalised layers, or actions are no box.
        RunFolderError: a file cannot be written.
    """
    try:
        from stable_baselines3 import TD3
    except ModuleNotFoundError as error:
        raise MissingDependency('stable-baselines3 is missing: pip install "pbcs-ompl[compare]"') from error
    env, skill = recorder.env, None if controller is None else _only_policy(controller)
    if not isinstance(env.action_space, Box):
        raise InvalidOption(f"actions are {env.action_space}; TD3 of stable-baselines3 takes a Box")
    hidden = [64, 64] if skill is None else list(skill.actor.sizes[1:-1])
    model = TD3("MultiInputPolicy" if isinstance(env.observation_space, Dict) else "MlpPolicy", env,
                policy_kwargs={"net_arch": hidden}, buffer_size=CAPACITY, learning_starts=0, device="cpu", seed=0)
    if skill is not None:
        _set_actor(model, skill)
    for episode in episodes:
        _fill(model, episode)
    with write_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        model.save(folder / "model.zip")
        model.save_replay_buffer(folder / "replay_buffer.pkl")
    return [folder / "model.zip", folder / "replay_buffer.pkl"]


def _only_policy(controller: TrainedController) -> SkillPolicy:
    """Return the one policy of a controller.

    Raises:
        InvalidOption: it has several, or what stable-baselines3's networks do not have.
    """
    if not isinstance(controller, SkillChain) or controller.num_policies != 1:
        more = (f"has {controller.num_policies} that take over from each other" if controller.num_policies > 1
                else "also shows its network where it is on its line")
        raise InvalidOption("stable-baselines3 has one network that sees the observation alone, this controller "
                            f"{more}; distill it first: pbcs distill DIR")
    policy = controller.skills[0].policy
    if not policy.actor.is_plain:
        raise InvalidOption("the layers of this policy are normalised, those of stable-baselines3 are not; distill it "
                            "first: pbcs distill DIR")
    return policy


def _set_actor(model: Any, skill: SkillPolicy) -> None:
    """Give a model the actor of a skill: what it sees of observations is part of its first layer."""
    import torch

    layers = folded(skill)
    linear = [module for module in model.actor.mu if isinstance(module, torch.nn.Linear)]
    with torch.no_grad():
        for module, (weight, bias) in zip(linear, layers, strict=True):
            module.weight.copy_(torch.from_numpy(np.ascontiguousarray(weight.T, np.float32)))
            module.bias.copy_(torch.from_numpy(np.ascontiguousarray(bias, np.float32)))
    model.actor_target.load_state_dict(model.actor.state_dict())


def folded(skill: SkillPolicy) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return weights [in, out] and biases [out] of a network of plain observations: W (o - origin) / scale + b."""
    actor: Policy = skill.actor
    (weight, bias, *_), *rest = [tuple(np.asarray(part, np.float64) for part in layer) for layer in actor.layers]
    scaled = weight / skill.transform.scale[:, None]
    return [(scaled, bias - skill.transform.origin @ scaled), *((one[0], one[1]) for one in rest)]


def _fill(model: Any, episode: Episode) -> None:
    """Add the transitions of an episode, as stable-baselines3 would have made them itself."""
    seen = episode.observations
    for step in range(episode.length):
        cut = bool(episode.truncated[step] or (step == episode.length - 1 and not episode.terminated[step]))
        done = bool(episode.terminated[step]) or cut
        scaled = model.policy.scale_action(np.asarray(episode.actions[step], np.float32)[None])
        model.replay_buffer.add(_batched(seen[step]), _batched(seen[step + 1]), scaled,
                                np.array([episode.rewards[step]]), np.array([done]),
                                [{"TimeLimit.truncated": cut and not episode.terminated[step]}])


def _batched(observation: Any) -> Any:
    """Return an observation as a batch of one."""
    if isinstance(observation, dict):
        return {name: np.asarray(part)[None] for name, part in observation.items()}
    return flat(observation)[None] if isinstance(observation, tuple) else np.asarray(observation)[None]
