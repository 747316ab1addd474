"""What an environment keeps in Python attributes: found, saved and restored, or refused by name."""
