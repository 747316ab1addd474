"""`pbcs distill`: one network that does what a trained chain does."""

from argparse import Namespace
from pathlib import Path

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary
from pbcs_ompl.core.formatting import format_duration, format_number, format_rate
from pbcs_ompl.results.command_line import command, eval_words
from pbcs_ompl.results.files import CHAIN
from pbcs_ompl.skills.distill import DistillResult, distill
from pbcs_ompl.skills.load_chain import load_chain


def run(arguments: Namespace) -> int:
    """Distill and report. Returns 1 when the student does not reach the goal."""
    folder = Path(arguments.dir)
    teacher = load_chain(folder / CHAIN if (folder / CHAIN).is_dir() else folder, trust=arguments.trust)
    out = Path(arguments.out or fresh_folder("distill", folder.name))
    with ProgressDisplay("distill") as display:
        result = distill(teacher, settings=arguments.settings, seed=arguments.seed, out=out, source=str(folder),
                         on_progress=display)
    print_summary(result.summary(), _closing_lines(arguments, result, out), as_json=arguments.json)
    return 0 if result.solved else 1


def _closing_lines(arguments: Namespace, result: DistillResult, out: Path) -> list[tuple[str, str]]:
    noise = f"with {result.student.epsilon:.0%} random actions, in fresh environments"
    return [("solved" if result.solved else "not solved",
             f"{result.rounds} rounds, {format_number(result.transitions)} transitions, "
             f"{format_number(result.updates)} updates, {format_duration(result.seconds)}"),
            ("student", f"{format_rate(result.student.success_rate, result.student.wilson)} {noise}"),
            ("teacher", format_rate(result.teacher.success_rate, result.teacher.wilson)), ("files", list_files(out)),
            ("next", command(eval_words(out, epsilon=0.2, trust=arguments.trust)))]
