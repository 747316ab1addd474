"""Shorter plans after a search: short cuts, pulls and cuts, by resets and steps alone."""
