"""Shells complete verbs, options, and the names that are registered here."""

import shutil
import subprocess

import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.cli.arguments import SHELLS, build_parser
from pbcs_ompl.cli.completion import completion

pytest.importorskip("shtab")
COMPLETE = """
source "$1"; shift
function=$(complete -p pbcs | sed 's/.*-F \\([^ ]*\\).*/\\1/')
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_LINE="$*"; COMP_POINT=${#COMP_LINE}
$function pbcs "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
echo "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes(tmp_path):
    script = tmp_path / "pbcs.bash"
    script.write_text(completion(build_parser(), "bash"))
    (tmp_path / "runs").mkdir()

    def completed(line):
        run = subprocess.run(["bash", "-c", COMPLETE, "bash", script, *line.split()], cwd=tmp_path,
                             capture_output=True, text=True, check=True)
        return run.stdout.split()

    assert completed("pbcs tr") == ["train"]
    assert completed("pbcs plan --planner-") == ["--planner-kwargs"]
    assert completed("pbcs plan --planner Rand") == ["RandomWalk"]
    assert completed("pbcs train --agent td") == ["td3"]
    assert completed("pbcs plan --env MountainCarC") == ["MountainCarContinuous-v0"]
    assert completed("pbcs export runs --to on") == ["onnx"]
    assert completed("pbcs eval ru") == ["runs"]


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_gets_every_verb(shell, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--print-completion", shell])
    assert stop.value.code == 0
    script = capsys.readouterr().out
    assert all(verb in script for verb in build_parser().verbs)


def test_another_shell_is_refused(capsys):
    assert main(["--print-completion", "ksh"]) == 2
    assert "did you mean 'zsh'?" in capsys.readouterr().err
