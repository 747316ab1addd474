"""The runs of a command as a Makefile and as a Slurm job array: each run, or a few of them, is a shard."""

import shlex
from collections.abc import Sequence
from pathlib import Path

LARGEST_ARRAY = 1000
"""Slurm refuses larger ones unless its MaxArraySize was raised; then a task makes several runs."""


def makefile(command: Sequence[str], records: Sequence[str]) -> str:
    """Return a Makefile with a target for each run, and the whole command as its first.

    Args:
        command: Makes all runs that are missing, then analyses them; with --shard i/n one of n parts of them.
        records: The file that each run leaves, relative to the folder of the Makefile. Those that exist are not made.
    """
    runs = [f"run-{number}" for number in range(1, len(records) + 1)]
    lines = [f"# {len(records)} runs and their analysis; in this folder: make --jobs 4 --keep-going", "",
             f"PBCS = {_words(command)}", "",
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
    """
    tasks = min(runs, LARGEST_ARRAY)
    whole = shlex.join(command)
    return f"""#!/bin/bash
# {runs} runs. Afterwards, for the analysis:
#   {whole}
#SBATCH --job-name="{name}"
#SBATCH --array=1-{tasks}
#SBATCH --cpus-per-task=1
#SBATCH --output="{out}/slurm-%A_%a.log"
set -eu
exec {whole} --shard "$SLURM_ARRAY_TASK_ID/{tasks}"
"""


def _words(command: Sequence[str]) -> str:
    return shlex.join(command).replace("$", "$$")
