"""What does DDPG learn from the transitions of an exploration tree alone? Look at its critic and its policy.

    python examples/look_at_a_critic.py
"""

import sys
from pathlib import Path

import numpy as np

import pbcs_ompl
from pbcs_ompl.agents.ddpg import DDPG, DDPGSettings
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.critic import critic_figure


def main(updates: str = "5000", folder: str = "runs/example-critic") -> None:
    model = pbcs_ompl.make("pbcs/Maze-v0", {"size": 2, "wall_penalty": -1})
    tree = pbcs_ompl.plan(model, planner="Ex", seed=0).tree
    children = np.flatnonzero(tree.parents >= 0)
    states, controls = tree.states[tree.parents[children]], tree.controls[children]
    outcome = model.transition(states, controls)
    print(f"{len(children):,} transitions, {int(outcome.success.sum())} of them into the goal")

    agent = DDPG(model.observation_size, model.action_low, model.action_high, seeds=(0,),
                 settings=DDPGSettings.from_preset("fast"))  # a stack of one agent, axis S first
    agent.add_transitions(model.observe(states)[None], controls[None], outcome.rewards[None],
                          model.observe(outcome.states)[None], outcome.terminated[None])
    agent.train(int(updates))

    def policy(observations):
        return agent.act(observations[None])[0]

    def critic(observations, actions):
        return agent.value(observations[None], actions[None])[0]

    rollout = [model.initial_state()[None]]
    for _ in range(100):
        rollout.append(model.transition(rollout[-1], policy(model.observe(rollout[-1]))).states)
    figure = critic_figure(model, policy, critic, rollout=np.concatenate(rollout),
                           title=f"offline DDPG: {len(children):,} transitions, {int(updates):,} updates")
    print(f"picture in {save(figure, Path(folder) / 'critic.png')}")


if __name__ == "__main__":
    main(*sys.argv[1:])
