"""Plan with OMPL in any environment that can be reset, then turn the plan into a robust closed-loop policy.

For example::

    import pbcs_ompl

    plan = pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs={"size": 5, "maze_seed": 1}, seed=0)
    print(plan.summary())

The verbs take an environment as an id, a Gymnasium environment, an `EnvSpec` or a resettable model, and return a
result. Names are imported when they are first used, so that `import pbcs_ompl` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbcs_ompl.bridge.plan import PlanResult, plan
    from pbcs_ompl.bridge.trajectory import Trajectory
    from pbcs_ompl.core.env_spec import EnvSpec
    from pbcs_ompl.experiments.compare import Comparison, compare
    from pbcs_ompl.experiments.run_study import StudyResult, run_study
    from pbcs_ompl.resettable import ResetReport, check_resettable, make
    from pbcs_ompl.results.export import Export, export
    from pbcs_ompl.results.report import Report, write_report
    from pbcs_ompl.skills import (
        DistillResult,
        Evaluation,
        SkillChain,
        TrainResult,
        distill,
        evaluate,
        load_chain,
        resume,
        train,
    )

__all__ = [
    "Comparison",
    "DistillResult",
    "EnvSpec",
    "Evaluation",
    "Export",
    "PlanResult",
    "Report",
    "ResetReport",
    "SkillChain",
    "StudyResult",
    "TrainResult",
    "Trajectory",
    "check_resettable",
    "compare",
    "distill",
    "evaluate",
    "export",
    "load_chain",
    "make",
    "plan",
    "resume",
    "run_study",
    "train",
    "write_report",
]

_MODULES = {
    "bridge.plan": ("PlanResult", "plan"),
    "bridge.trajectory": ("Trajectory",),
    "core.env_spec": ("EnvSpec",),
    "experiments.compare": ("Comparison", "compare"),
    "experiments.run_study": ("StudyResult", "run_study"),
    "resettable": ("ResetReport", "check_resettable", "make"),
    "results.export": ("Export", "export"),
    "results.report": ("Report", "write_report"),
    "skills": ("DistillResult", "Evaluation", "SkillChain", "TrainResult", "distill", "evaluate", "load_chain",
               "resume", "train"),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("pbcs-ompl")
    if name not in _HOMES:
        raise AttributeError(f"module 'pbcs_ompl' has no attribute {name!r}")
    return getattr(import_module(f"pbcs_ompl.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
