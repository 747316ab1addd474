"""Gymnasium meets OMPL: an environment becomes a control problem, the path that solves it a trajectory."""
