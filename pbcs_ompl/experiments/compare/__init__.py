"""Planners compared: the same environments, many seeds, every run recorded."""

from pbcs_ompl.experiments.compare.comparison import Comparison, read_comparison
from pbcs_ompl.experiments.compare.runner import compare

__all__ = ["Comparison", "compare", "read_comparison"]
