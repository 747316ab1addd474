"""`pbcs doctor --all`: each environment in a process of its own, and a page of what was found."""

from pathlib import Path

import pytest

from pbcs_ompl.resettable.survey import Record, nothing, registered, survey
from pbcs_ompl.resettable.survey_one import classify
from pbcs_ompl.resettable.survey_page import survey_page

SIMPLE = {"pbcs/Box-v0": "pbcs_ompl.envs", "Pendulum-v1": "gymnasium", "CarRacing-v3": "gymnasium"}


def test_the_latest_version_of_each_id_is_checked() -> None:
    ids = registered()
    assert "Pendulum-v1" in ids
    assert ids["pbcs/Maze-v0"] == "pbcs_ompl.envs"
    assert {name for name in ids if name.startswith("Hopper-")} == {"Hopper-v5"}
    first = [ids[name] for name in list(ids)[:2]]
    assert len(set(first)) == 2, "packages alternate"


@pytest.mark.parametrize(("env_id", "verdict", "why"), [
    ("pbcs/Box-v0", "exact", ""), ("nowhere_to_be_found:A-v0", "not installed", "nowhere_to_be_found"),
    ("math:A-v0", "failed", "unknown environment"),
])
def test_verdicts(env_id: str, verdict: str, why: str) -> None:
    record = classify(env_id)
    assert record["verdict"] == verdict
    assert why in record["why"]
    assert (record["restore_us"] is not None) == (verdict == "exact")


def test_randomness_of_steps_is_said() -> None:
    record = classify("FrozenLake-v1")
    assert (record["verdict"], record["adapter"]) == ("visited only", "CopiedEnv")
    assert record["why"] == "steps draw random numbers from np_random: a plan holds for one seed"


def test_a_survey_continues_where_it_ended(tmp_path: Path) -> None:
    path = tmp_path / "environments.json"
    seen: list[str] = []

    def note(record: Record, _: int) -> None:
        seen.append(record["id"])

    survey({"pbcs/Box-v0": "pbcs_ompl.envs"}, path, on_record=note)
    records = survey(SIMPLE, path, on_record=note)
    assert seen[0] == "pbcs/Box-v0"
    assert sorted(seen) == sorted(SIMPLE)
    verdicts = {record["id"]: record["verdict"] for record in records}
    assert verdicts["pbcs/Box-v0"] == verdicts["Pendulum-v1"] == "exact"
    assert verdicts["CarRacing-v3"] in ("refused", "not installed")
    assert survey(SIMPLE, path, on_record=note) == records
    assert len(seen) == len(SIMPLE)


def test_what_takes_too_long_is_killed_and_said(tmp_path: Path) -> None:
    record, = survey({"pbcs/Box-v0": "pbcs_ompl.envs"}, tmp_path / "found.json", seconds=0.05)
    assert (record["verdict"], record["why"]) == ("failed", "not done after 0.05 s")


def test_what_takes_too_much_memory_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "hungry.py").write_text("""
import gymnasium, numpy as np

class Hungry(gymnasium.Env):
    def __init__(self):
        self.much = np.zeros(2**30)

gymnasium.register("Hungry-v0", Hungry)
""")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    monkeypatch.setattr("pbcs_ompl.resettable.survey.package_version", lambda module: module)
    record, = survey({"Hungry-v0": "hungry"}, tmp_path / "found.json")
    assert (record["verdict"], record["why"]) == ("failed", "needs more than 6 GiB of memory")


def test_the_page_counts_and_quotes() -> None:
    common = {"package": "toys", "version": "toys 1.0", "seconds": 0.1}
    records: list[Record] = [
        {**common, "id": "A-v0", "verdict": "exact", "why": "", "adapter": "MujocoEnv", "state_size": 12,
         "restore_us": 1234.5},
        {**common, "id": "B-v0", **nothing("refused", "a | b\nc <d>")},
        {**common, "id": "C-v0", **nothing("not installed", "no jax")},
    ]
    page = survey_page(records, "pbcs doctor --all", 60)
    assert "1 exact, 1 refused, 1 not installed." in page
    assert "| `A-v0` | exact | MujocoEnv | 12 | 1,234 µs |  |" in page
    assert "a \\| b c &lt;d>" in page
    assert "C-v0" not in page
