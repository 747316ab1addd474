"""The runs of a command as a Makefile and as a Slurm job array: each run, or a few of them, is a shard."""

import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import is_printable

LARGEST_ARRAY = 1000
"""Slurm refuses larger ones unless its MaxArraySize was raised; then a task makes several runs."""


def _check_words(words: Sequence[str]) -> None:
    for word in words:
        if not is_printable(word):
            raise InvalidOption(f"{word!r} has a line break or another control character, which a Makefile or a job "
                                "script cannot hold; choose another name")


def makefile(command: Sequence[str], records: Sequence[str]) -> str:
    """Return a Makefile with a target for each run, and the whole command as its first.

    Args:
        command: Makes all runs that are missing, then analyses them; with --shard i/n one of n parts of them.
        records: The file that each run leaves, relative to the folder of the Makefile. Those that exist are not made.

    Raises:
        InvalidOption: a word has a line break, or another character that a Makefile cannot hold.
    """
    _check_words([*command, *records])
    runs = [f"run-{number}" for number in range(1, len(records) + 1)]
    lines = [f"# {len(records)} runs and their analysis; in this folder: make --jobs 4 --keep-going", "",
             f"PBCS = {_in_variable(command)}", "",
             f".PHONY: analysis {' '.join(runs)}", f"analysis: {' '.join(runs)}", "\t$(PBCS)"]
    for number, (run, record) in enumerate(zip(runs, records, strict=True), start=1):
        lines += [f"{run}:", f"\t@test -f {_words([record])} || $(PBCS) --shard {number}/{len(records)}"]
    return "\n".join(lines) + "\n"


def slurm_script(command: Sequence[str], runs: int, name: str, out: Path) -> str:
    """Return a script for sbatch: an array of as many tasks as there are runs, at most `LARGEST_ARRAY`.

    Args:
        command: As for `makefile`.
        runs: How many runs there are.
        name: What the job is called.
        out: The folder for what the tasks print.

    Raises:
        InvalidOption: a word has a line break, or `out` what the directives of Slurm cannot hold.
    """
    _check_words([*command, str(out)])
    if set(str(out)) & set('"\\'):
        raise InvalidOption(f"--out is {str(out)!r}; Slurm takes no double quotes and backslashes in its name")
    tasks = min(runs, LARGEST_ARRAY)
    whole = shlex.join(command)
    return f"""#!/bin/bash
# {runs} runs. Afterwards, for the analysis:
#   {whole}
#SBATCH --job-name="{re.sub(r'[^A-Za-z0-9._-]', '_', name)}"
#SBATCH --array=1-{tasks}
#SBATCH --cpus-per-task=1
#SBATCH --output="{str(out).replace('%', '%%')}/slurm-%A_%a.log"
set -eu
exec {whole} --shard "$SLURM_ARRAY_TASK_ID/{tasks}"
"""


def _words(command: Sequence[str]) -> str:
    """Return words quoted for the shell of a recipe, and for make, which reads `$` and `#` first."""
    return shlex.join(command).replace("$", "$$")


def _in_variable(command: Sequence[str]) -> str:
    """Return words for the value of a variable of make, where # begins a comment unless a backslash is before it."""
    return re.sub(r"(\\*)#", r"\1\1\\#", _words(command))
