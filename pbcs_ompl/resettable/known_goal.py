"""Whether there is a goal to be found, in an environment that was not made for planning."""

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv

NAME_IT = "name it: --goal in the command line, goal=... in Python, as in 'qpos[0]>=5' or 'terminated>0'"


def check_goal(model: ResettableModel) -> None:
    """Refuse an environment that says of no state whether it is a success.

    What reports no success, but rewards steps that end nothing, as CartPole and Ant do, rewards the step in which it
    falls as well: that its episode has ended with a positive reward says nothing.

    Raises:
        InvalidOption: the environment is such a one, and no goal was given.
    """
    if isinstance(model.env, RestorableEnv) and model.env.goal_is_unknown:
        raise InvalidOption(f"{model.spec.id} reports no success, and it rewards steps that end nothing, so the reward "
                            f"of the last step does not say where the goal is; {NAME_IT}")
