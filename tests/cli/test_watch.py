"""A training leaves a table of its progress, which another process shows and trackers get."""

import csv
import json
from pathlib import Path

import pytest

import pbcs_ompl
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import DamagedFile, MissingDependency
from pbcs_ompl.results.progress import COLUMNS, ProgressLog, read_progress
from pbcs_ompl.results.trackers import tracker

MAZE = '{"size": 2}'


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("watched") / "run"
    pbcs_ompl.train("pbcs/Maze-v0", env_kwargs={"size": 2}, max_transitions=20_000, out=folder)
    return folder


def test_the_table_ends_with_the_numbers_of_the_result(run: Path) -> None:
    rows, result = read_progress(run / "progress.csv"), json.loads((run / "result.json").read_text())
    assert tuple(rows[0]) == COLUMNS
    assert (rows[-1]["phase"], rows[-1]["updates"]) == ("train", result["updates"])
    assert rows[-1]["skills"] == result["skills"]
    assert 0 <= rows[-1]["success_rate"] <= 1
    assert rows[-1]["critic_loss"] > 0
    counts = [row["transitions"] for row in rows if row["phase"] == "train"]
    assert counts == sorted(counts)


def test_watch_shows_how_it_stands(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["watch", str(run), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["ended"]
    assert shown["transitions"] > 0
    assert main(["watch", str(run)]) == 0
    assert "of the plan covered" in capsys.readouterr().out
    assert main(["watch", str(run.parent)]) == 2
    assert "pbcs train writes it" in capsys.readouterr().err


def test_a_resumed_table_continues_and_a_damaged_one_is_named(tmp_path: Path) -> None:
    for count in (1, 2):
        ProgressLog(tmp_path / "progress.csv")({"phase": "train", "transitions": count})
    assert [row["transitions"] for row in read_progress(tmp_path / "progress.csv")] == [1, 2]
    (tmp_path / "progress.csv").write_text(",".join(COLUMNS) + "\ntrain" + ",x" * 9 + "\n")
    with pytest.raises(DamagedFile, match="damaged"):
        read_progress(tmp_path / "progress.csv")


def test_tensorboard_gets_the_usual_tags(tmp_path: Path) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    out = tmp_path / "run"
    main(["train", "--env", "pbcs/Maze-v0", "--env-kwargs", MAZE, "--max-transitions", "20000", "--track",
          "tensorboard", "--out", str(out)])
    events = EventAccumulator(str(out / "tensorboard"))
    events.Reload()
    assert {"rollout/success_rate", "train/critic_loss", "time/total_timesteps"} <= set(events.Tags()["scalars"])
    rows = list(csv.DictReader((out / "progress.csv").open()))
    assert events.Scalars("time/total_timesteps")[-1].step <= float(rows[-1]["transitions"])


def test_a_tracker_that_is_missing_is_named_before_anything_runs(tmp_path: Path,
                                                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pbcs_ompl.results.trackers.find_spec", lambda name: None)
    with pytest.raises(MissingDependency, match=r'pip install "pbcs-ompl\[wandb\]"'), tracker("wandb", tmp_path):
        pass
