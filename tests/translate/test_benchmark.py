"""The translator against the U-Net of the literature, on the rectangles of test_rcan."""

import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from test_rcan import CAMERA, Rectangles
from torch.nn.functional import l1_loss

from vision_s2r.camera import CameraConfig
from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.training import Inputs
from vision_s2r.translate import benchmark
from vision_s2r.translate.pix2pix_unet import Pix2PixUNet, levels


def run(out: Path, minutes: float = 0.02) -> dict[str, Any]:
    cfg = compose(Config, overrides=["experiment=debug", "translate.validate_on=randomized"])
    timed = replace(cfg.benchmark, minutes=minutes)
    return benchmark.run(
        cfg.translate, timed, Inputs(Rectangles(16, 0), Rectangles(8, 1), CAMERA, CameraConfig()), out, seed=0
    )


@pytest.mark.slow
def test_the_whole_benchmark_says_what_it_measured(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    run(tmp_path)
    found = json.loads((tmp_path / "translate.json").read_text())
    ours, reference = (found["networks"][name] for name in (benchmark.OURS, benchmark.REFERENCE))
    for network in found["networks"].values():
        assert [row["minutes"] for row in network["curve"]] == [0.01, 0.02]
        assert 0 < network["curve"][0]["pictures"] < network["curve"][1]["pictures"]
        assert network["loop_pictures_per_second"] == pytest.approx(network["curve"][1]["pictures"] / 1.2)
        assert network["inference_milliseconds"] == pytest.approx(1000 / network["inference_pictures_per_second"])
    ratios = found["ratios"][benchmark.OURS]
    for name in ("inference", "step", "loop"):
        key = f"{name}_pictures_per_second"
        assert ratios[name] == pytest.approx(ours[key] / reference[key])
    assert ratios["error"] == pytest.approx(ours["curve"][-1]["l1"] / reference["curve"][-1]["l1"])
    assert (tmp_path / "translate.png").exists()

    with caplog.at_level(logging.INFO):
        again = run(tmp_path)  # what is trained stays trained
    assert "of 0.02 min" not in caplog.text
    assert [n["curve"] for n in again["networks"].values()] == [n["curve"] for n in found["networks"].values()]
    with pytest.raises(UserError, match=r"other settings \(benchmark\)"):
        run(tmp_path, minutes=0.03)


def test_equal_error_is_that_of_the_references_best_validation() -> None:
    speeds = {f"{name}_pictures_per_second": 2.0 for name in ("inference", "step", "loop")}

    def network(*errors: float, pace: int = 1) -> dict[str, Any]:
        rows = enumerate(errors, 1)
        return speeds | {"curve": [{"minutes": k / 2, "pictures": 100 * pace * k, "l1": error} for k, error in rows]}

    reference = network(0.3, 0.2, 0.1, 0.12)
    found = benchmark.ratios(network(0.09, 0.08, 0.07, 0.06, pace=2), reference)
    assert found["time"] == 3 and found["pictures"] == 1.5 and found["error"] == pytest.approx(0.5)
    assert benchmark.ratios(network(0.3, 0.2, 0.2, 0.11), reference)["time"] is None


def test_the_reference_is_the_published_network() -> None:
    with torch.device("meta"):
        published = Pix2PixUNet(levels(256))
    assert (
        sum(p.numel() for p in published.parameters()) == 54_413_955
    )  # 54.414 M, as the authors' code for PyTorch says
    assert [layer[1].out_channels for layer in published.down] == [64, 128, 256, 512, 512, 512, 512, 512]
    assert [levels(size) for size in (64, 96, 512)] == [6, 5, 8]


def test_the_reference_learns_and_its_pictures_do_not_depend_on_each_other() -> None:
    torch.manual_seed(0)
    views, indices = Rectangles(8, 0), torch.arange(8)
    source = views.pictures().movedim(-1, 1) / 255
    target = views.batch("canonical", indices).movedim(-1, 1) / 255
    network = Pix2PixUNet(levels(32), width=8)
    optimizer = torch.optim.Adam(network.parameters(), 2e-3)
    errors = []
    for _ in range(150):
        loss = l1_loss(network(source)["canonical"], target)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        errors.append(float(loss.detach()))
    assert errors[-1] < 0.2 * errors[0]
    network.eval()
    with torch.no_grad():
        together, alone = network(source)["canonical"], network(source[:1])["canonical"]
    torch.testing.assert_close(together[:1], alone)
    assert together.min() >= 0 and together.max() <= 1
