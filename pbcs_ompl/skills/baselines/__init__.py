"""What else could follow a plan: baselines as controllers, judged as chains are.

Open loop and the linear-quadratic regulator see observations only. Model-predictive control reads the simulator's
state, and is marked "privileged" wherever its rate is printed.
"""

from pbcs_ompl.skills.baselines.lqr import LQRController, LQRSettings
from pbcs_ompl.skills.baselines.mppi import MPPIController, MPPISettings
from pbcs_ompl.skills.baselines.open_loop import OpenLoop
from pbcs_ompl.skills.baselines.privileged import evaluate_privileged
from pbcs_ompl.skills.baselines.reverse_curriculum import (
    ReverseCurriculum,
    ReverseCurriculumSettings,
    train_reverse_curriculum,
)

__all__ = ["LQRController", "LQRSettings", "MPPIController", "MPPISettings", "OpenLoop", "ReverseCurriculum",
           "ReverseCurriculumSettings", "evaluate_privileged", "train_reverse_curriculum"]
