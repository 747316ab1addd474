"""How do I train skills with an agent of another library? Here with TD3 of stable-baselines3.

    python examples/stable_baselines_agent.py
    pbcs train --env pbcs/Maze-v0 --env-kwargs '{"size": 2}' --agent examples.stable_baselines_agent:StableTD3

A registered name comes from your package's pyproject.toml, [project.entry-points."pbcs_ompl.agents"].
"""

import gymnasium
import numpy as np
import torch
from stable_baselines3 import TD3
from stable_baselines3.common.logger import configure

import pbcs_ompl
from pbcs_ompl.agents import Policy, TD3Settings


class Spaces(gymnasium.Env):
    """What stable-baselines3 needs of an environment that it never steps."""

    def __init__(self, observation_size, low, high):
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (observation_size,), np.float32)
        self.action_space = gymnasium.spaces.Box(np.float32(low), np.float32(high))


class StableTD3:
    """Arrays are [S, B, ...] for a stack of S agents; this one is always a stack of one."""

    settings_type = TD3Settings  # any class with from_preset(name, **changes), to_dict and from_dict
    BUFFER = ("observations", "next_observations", "actions", "rewards", "dones")

    def __init__(self, observation_size, action_low, action_high, *, settings, seeds, device="cpu"):
        (seed,) = seeds
        self.low, self.high, self.num_updates, self.batch_size = action_low, action_high, 0, settings.batch_size
        self.model = TD3("MlpPolicy", Spaces(observation_size, action_low, action_high), seed=seed, device=device,
                         learning_rate=settings.actor_learning_rate, buffer_size=min(settings.replay_capacity, 100_000),
                         tau=1 - settings.polyak, gamma=settings.discount,
                         policy_kwargs={"net_arch": list(settings.hidden)})
        self.model.set_logger(configure(format_strings=[]))
        self.optimizers = {"actor": self.model.actor.optimizer, "critic": self.model.critic.optimizer}

    def act(self, observations):
        actions, _ = self.model.predict(observations[0].astype(np.float32), deterministic=True)
        return np.clip(actions.astype(np.float64), self.low, self.high)[None]

    explore = act  # the noise is added by the training

    def value(self, observations, actions):
        pair = (torch.as_tensor(field, dtype=torch.float32, device=self.model.device)
                for field in (observations[0], self.model.policy.scale_action(actions[0])))
        with torch.no_grad():
            return self.model.critic.q1_forward(*pair).cpu().numpy().T.astype(np.float64)

    def add_transitions(self, observations, actions, rewards, next_observations, terminals):
        scaled = self.model.policy.scale_action(actions[0])
        for row in zip(observations[0], next_observations[0], scaled, rewards[0], terminals[0], strict=True):
            self.model.replay_buffer.add(*row, [{}])

    def clear_replay(self):
        self.model.replay_buffer.reset()

    def train(self, num_updates):
        self.model.train(num_updates, self.batch_size)
        self.num_updates += num_updates

    def policy(self, seed_index=0):
        linear = [layer for layer in self.model.actor.mu if isinstance(layer, torch.nn.Linear)]
        layers = ((layer.weight.T, layer.bias) for layer in linear)
        arrays = tuple(tuple(part.detach().cpu().numpy().copy() for part in layer) for layer in layers)
        return Policy(arrays, self.low.copy(), self.high.copy())

    def state_dict(self):
        """All but the state of the random numbers: a resumed training continues, but not bit for bit."""
        state = {f"policy/{name}": tensor.cpu().numpy() for name, tensor in self.model.policy.state_dict().items()}
        for which, optimizer in self.optimizers.items():
            state |= {f"{which}/{index}/{name}": tensor.cpu().numpy() for index, moments in
                      optimizer.state_dict()["state"].items() for name, tensor in moments.items()}
        buffer = self.model.replay_buffer
        state |= {name: getattr(buffer, name)[:buffer.size()] for name in self.BUFFER}
        return state | {"counts": np.array([self.num_updates, buffer.pos, buffer.full])}

    def load_state_dict(self, state):
        tensors = {name: torch.from_numpy(np.array(array)) for name, array in state.items()}
        self.model.policy.load_state_dict({name[7:]: tensors[name] for name in tensors if name.startswith("policy/")})
        for which, optimizer in self.optimizers.items():
            moments: dict = {}
            for name in (name for name in tensors if name.startswith(which + "/")):
                moments.setdefault(int(name.split("/")[1]), {})[name.split("/")[2]] = tensors[name]
            optimizer.load_state_dict({"state": moments, "param_groups": optimizer.state_dict()["param_groups"]})
        buffer = self.model.replay_buffer
        self.num_updates, buffer.pos, buffer.full = (int(count) for count in state["counts"])
        for name in self.BUFFER:
            getattr(buffer, name)[:buffer.size()] = state[name]


if __name__ == "__main__":
    result = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs={"size": 2}, agent="stable_baselines_agent:StableTD3")
    print(f"solved: {result.solved}, {result.updates:,} updates")
