"""One adapter for each family of environments: how its states are saved and restored."""
