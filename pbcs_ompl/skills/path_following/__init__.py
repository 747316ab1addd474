"""Following a plan: a line in feature space, the policy that moves along it, and its training."""
