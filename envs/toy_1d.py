"""1D-Toy, the smallest environment in which DDPG can get stuck: `pbcs/Toy1D-v0`."""

from pbcs_ompl.envs.line_env import MAX_STEP, LineEnv


class Toy1DEnv(LineEnv):
    """S = [0, 1], A = [-0.1, 0.1], start 0; reward 1 and the end of the episode when s + a < 0.

    Source: [Matheron2020] 6.2.1, Fig. 6.1. Differs: there a rewarded step leads to the state 0, the start; here it
    leads to s + a, so that success is a function of the state. No agent learns from what follows a terminal
    transition.
    """

    def __init__(self) -> None:
        super().__init__(low=-MAX_STEP)
