"""Where the agents of a study learn can be chosen; nothing else of the study changes with it."""

import pytest
import torch

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.study import find_study
from pbcs_ompl.results.files import read_toml

DEVICES = [pytest.param("cpu"), pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(),
                                                                              reason="no CUDA device"))]


@pytest.mark.parametrize("name", ["deadlock", "offline-vs-bootstrapped"])
@pytest.mark.parametrize("device", DEVICES)
def test_every_training_gets_the_device(name, device):
    study = find_study(name)
    moved = study.on_device(device)
    assert moved.sweep == study.sweep | {"device": device}
    trainings = [one for one in moved.runs(moved.sweep, 3) if one["variant"] != "mini-batch"]
    assert trainings
    assert all(one["device"] == device for one in trainings)


def test_a_gpu_takes_ten_thousand_seeds_as_one_stack():
    study = find_study("deadlock")
    runs = study.runs(study.sweep | {"device": "cuda:0"}, 10_000)
    assert [len(one["seeds"]) for one in runs if one["variant"] == "ddpg-epsilon-greedy"] == [10_000]


@pytest.mark.parametrize(("name", "device", "words"), [
    ("toy-analysis", "cpu", "no agents whose device"), ("deadlock", "abacus", "choose 'cpu' or 'cuda'")])
def test_devices_that_cannot_be_are_refused(name, device, words):
    with pytest.raises(InvalidOption, match=words):
        find_study(name).on_device(device)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a CUDA device")
def test_cuda_without_a_gpu_is_one_line_and_leaves_no_folder(tmp_path, capsys):
    assert main(["study", "deadlock", "--device", "cuda", "--out", str(tmp_path / "out")]) == 2
    message = "device is 'cuda', but torch sees no CUDA device; use 'cpu'"
    assert capsys.readouterr().err == f"pbcs: error: {message}\n"
    assert not (tmp_path / "out").exists()


def test_a_scheduler_gets_the_device_too(tmp_path):
    assert main(["study", "deadlock", "--device", "cpu", "--emit", "make", "--out", str(tmp_path / "out")]) == 0
    assert "--device cpu" in (tmp_path / "out" / "Makefile").read_text()
    assert read_toml(tmp_path / "out" / "config.toml")["device"] == "cpu"
