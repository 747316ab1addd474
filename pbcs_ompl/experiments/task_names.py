"""What the tasks and variants of sweeps are called on figures and in claims."""

import re


def in_words(name: str) -> str:
    """Return "7x7 maze" for "maze-7", "mountain car" for "mountain-car"."""
    maze = re.fullmatch(r"maze-(\d+)", name)
    return f"{maze[1]}x{maze[1]} maze" if maze else name.replace("-", " ")
