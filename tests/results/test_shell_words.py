"""Whatever a name holds: pasted into a shell, or run by make or a job script, it stays that name, and runs nothing."""

import subprocess
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import is_printable, one_line
from pbcs_ompl.experiments.workers.schedulers import makefile, slurm_script
from pbcs_ompl.results.command_line import shell

HOSTILE = st.text(st.sampled_from(list("aZ0#$%'\"\\;&|<>`()*?[]{}!~=:, \t\n\x1b\u202eé-_/.")), min_size=1, max_size=30)
NAMES = HOSTILE | st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), min_size=1)
FEW = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
PRINT = ("printf", "%s\\0")


@FEW
@given(words=st.lists(NAMES, min_size=1, max_size=3))
def test_a_shell_reads_the_words_that_were_quoted(words: list[str]) -> None:
    line = shell(*PRINT, *words)
    assert not any(letter < " " or letter == "\x7f" for letter in line)
    read = subprocess.run(["bash", "-c", line], capture_output=True, check=True).stdout.decode()
    assert read.split("\0")[:-1] == words


@FEW
@given(words=st.lists(NAMES.filter(is_printable), min_size=1, max_size=3))
def test_make_reads_the_words_that_were_quoted(tmp_path: Path, words: list[str]) -> None:
    (tmp_path / "Makefile").write_text(makefile([*PRINT, *words], []), encoding="utf-8")
    read = subprocess.run(["make", "-s", "analysis"], cwd=tmp_path, capture_output=True, check=True).stdout.decode()
    assert read.split("\0")[:-1] == words


@FEW
@given(words=st.lists(NAMES.filter(is_printable), min_size=1, max_size=3), name=NAMES)
def test_a_job_script_runs_the_words_that_were_quoted(tmp_path: Path, words: list[str], name: str) -> None:
    text = slurm_script([*PRINT, *words], 2, name, tmp_path / "50% #1")
    read = subprocess.run(["bash", "-c", text], capture_output=True, check=True,
                          env={"SLURM_ARRAY_TASK_ID": "2"}).stdout.decode()
    assert read.split("\0")[:-1] == [*words, "--shard", "2/2"]
    directives = [line for line in text.splitlines() if line.startswith("#SBATCH")]
    assert len(directives) == 4
    assert '50%% #1/slurm-%A_%a.log"' in directives[-1]


@pytest.mark.parametrize("word", ["a\ntouch X", "a\rb", "\x1b[31m", "a\u2028b"])
def test_what_a_script_cannot_hold_is_refused_by_name(word: str) -> None:
    for write in (lambda: makefile(["pbcs", word], []), lambda: makefile(["pbcs"], [word]),
                  lambda: slurm_script(["pbcs", word], 1, "x", Path("out")),
                  lambda: slurm_script(["pbcs"], 1, "x", Path(word))):
        with pytest.raises(InvalidOption, match="control character"):
            write()


def test_a_terminal_obeys_no_name() -> None:
    assert one_line("run \x1b[31mred\x07\n  \u202eleft\ud800 é  –") == r"run \x1b[31mred\x07 \u202eleft\ud800 é  –"
