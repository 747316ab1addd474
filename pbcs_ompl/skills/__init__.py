"""Skills: policies trained backwards along a plan, and the chain that executes them."""

from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.config import TrainConfig, method_settings
from pbcs_ompl.skills.distill import DistillResult, distill
from pbcs_ompl.skills.evaluation import Evaluation, evaluate
from pbcs_ompl.skills.load_chain import load_chain
from pbcs_ompl.skills.robots.evaluation import evaluate_follower
from pbcs_ompl.skills.robots.follower import RobotFollower
from pbcs_ompl.skills.robots.train import FollowerResult, resume_follower, train_follower
from pbcs_ompl.skills.settings import MethodSettings, preset_names
from pbcs_ompl.skills.train import resume, train
from pbcs_ompl.skills.train_result import TrainResult

__all__ = ["DistillResult", "Evaluation", "FollowerResult", "MethodSettings", "RobotFollower", "Skill", "SkillChain",
           "TrainConfig", "TrainResult", "distill", "evaluate", "evaluate_follower", "load_chain", "method_settings",
           "preset_names", "resume", "resume_follower", "train", "train_follower"]
