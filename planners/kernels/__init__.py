"""Compiled data structures of the planners: arrays in, arrays out."""
