"""Experiments: planners compared, studies run, and where the runs are executed."""
