"""Planners compared: the same environments, many seeds, every run recorded."""

from pbcs_ompl.compare.comparison import Comparison, read_comparison
from pbcs_ompl.compare.runner import compare

__all__ = ["Comparison", "compare", "read_comparison"]
