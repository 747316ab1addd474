"""Studies: experiments as data, a run, and an analysis that says which claims hold."""

from pbcs_ompl.studies.claims import Claim, rate
from pbcs_ompl.studies.execute import StudyResult, run_shard, run_study
from pbcs_ompl.studies.study import Study, find_study, study_ids

__all__ = ["Claim", "Study", "StudyResult", "find_study", "rate", "run_shard", "run_study", "study_ids"]
