"""Planners compared: the same environments, many seeds, every run recorded."""

from pbcs_ompl.compare.comparison import Comparison, compare, read_comparison

__all__ = ["Comparison", "compare", "read_comparison"]
