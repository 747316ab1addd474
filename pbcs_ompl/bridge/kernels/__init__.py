"""Compiled functions of the bridge."""
