"""Optimised forms of what the modules above say plainly: each is held equal to its reference by a test.

* `gradients`: derivatives of the losses of `losses.py`, written by hand in torch.
* `ddpg`, `network`, `matrix`: DDPG's whole update for a CPU, in numba.
* `counter_rng`: random numbers as a function of a key and a position.
"""
