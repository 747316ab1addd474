"""Skills: policies trained backwards along a plan, and the chain that executes them."""

from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.config import TrainConfig
from pbcs_ompl.skills.evaluation import Evaluation, evaluate
from pbcs_ompl.skills.result import TrainResult
from pbcs_ompl.skills.settings import SkillSettings, skill_preset
from pbcs_ompl.skills.train import resume, train

__all__ = ["Evaluation", "Skill", "SkillChain", "SkillSettings", "TrainConfig", "TrainResult", "evaluate", "resume",
           "skill_preset", "train"]
