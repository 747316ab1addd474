"""Planners compared: the same environment, many seeds, every run recorded."""
