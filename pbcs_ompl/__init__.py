"""Plan with OMPL in any environment that can be reset, then turn the plan into a robust closed-loop policy.

    import pbcs_ompl

    plan = pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs={"size": 5, "maze_seed": 1}, seed=0)
    print(plan.summary())

Names are imported when they are first used, so that `import pbcs_ompl` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbcs_ompl.bridge.plan import PlanResult, plan
    from pbcs_ompl.bridge.trajectory import Trajectory
    from pbcs_ompl.resettable import adapt, check_resettable, make
    from pbcs_ompl.skills import train
    from pbcs_ompl.skills.chain import SkillChain
    from pbcs_ompl.skills.evaluation import evaluate

__all__ = ["PlanResult", "SkillChain", "Trajectory", "adapt", "check_resettable", "evaluate", "make", "plan",
           "train"]

_HOMES = {
    "plan": "pbcs_ompl.bridge.plan", "PlanResult": "pbcs_ompl.bridge.plan",
    "Trajectory": "pbcs_ompl.bridge.trajectory",
    "make": "pbcs_ompl.resettable", "adapt": "pbcs_ompl.resettable",
    "check_resettable": "pbcs_ompl.resettable",
    "train": "pbcs_ompl.skills", "SkillChain": "pbcs_ompl.skills.chain",
    "evaluate": "pbcs_ompl.skills.evaluation",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("pbcs-ompl")
    if name not in _HOMES:
        raise AttributeError(f"module 'pbcs_ompl' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
