"""Studies: experiments as data, a run, and an analysis that says which claims hold."""

from pbcs_ompl.experiments.study.claims import Claim, rate
from pbcs_ompl.experiments.study.execute import StudyResult, run_shard, run_study
from pbcs_ompl.experiments.study.study import Study, find_study, study_ids

__all__ = ["Claim", "Study", "StudyResult", "find_study", "rate", "run_shard", "run_study", "study_ids"]
