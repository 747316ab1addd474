"""The vocabulary of the toolkit: contracts, errors, registry, seeds, result folders."""
