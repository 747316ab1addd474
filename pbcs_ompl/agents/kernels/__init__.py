"""Optimised forms of what the modules above say plainly: each is held equal to its reference by a test.

* `gradients`: derivatives of the losses of `losses.py`, written by hand in torch.
* `updates`: whole updates for a CPU, in numba: those of `ddpg`, `td3` and `sac`, made of `actor_critic`, `network`,
  `layer_norm` and `matrix`.
* `counter_rng`: random numbers as a function of a key and a position.
"""

FAST = {"contract", "reassoc", "nsz", "arcp"}
"""Sums in any order and fused, but NaN and infinity stay what they are: they must be noticed."""
