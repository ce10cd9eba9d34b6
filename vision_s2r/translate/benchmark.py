"""The translator against the U-Net of the literature: speed, and the error that each reaches in the same time.

All networks are trained by the same loop on the same data through the same camera, with the same batch, precision and
losses of the picture, each at its own learning rate; one more of ours has all the losses and heads that the translator
is released with. They take turns in short slices, so that they share the machine's moods. Validations cost no time.
"""

import json
import logging
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from lightning_fabric import Fabric

from vision_s2r import files
from vision_s2r.errors import UserError
from vision_s2r.options import validate
from vision_s2r.results import publish
from vision_s2r.training import Inputs, ViewSource, checkpoint, precision, train
from vision_s2r.training.data import VALIDATION, generator
from vision_s2r.training.loop import LAST
from vision_s2r.translate import benchmark_report, speed
from vision_s2r.translate.config import BenchmarkConfig, CameraAdrConfig, TranslateConfig, check
from vision_s2r.translate.pix2pix_unet import Pix2PixUNetTraining
from vision_s2r.translate.rcan import Rcan, check_views

log = logging.getLogger(__name__)

OURS, PICTURE, REFERENCE = "ours", "ours, losses of the picture alone", "pix2pix U-Net"
FOLDERS = {OURS: "ours", PICTURE: "picture", REFERENCE: "pix2pix"}
ERROR = "l1"
SHARE = 0.05  # of the minutes of a training, which measuring the speed of its network takes

Build = Callable[[], Rcan]
Curve = list[dict[str, float]]  # a row a validation: minutes, pictures seen, metrics


def run(cfg: TranslateConfig, benchmark: BenchmarkConfig, inputs: Inputs, out: Path, seed: int) -> dict[str, Any]:
    """Measures, or goes on with what the folder `out` holds; prints a table, writes it, translate.json and .png there.

    Returns what the JSON holds: facts of the run, for each network its speeds and its curve, and for each of ours the
    `ratios` to the reference. Raises UserError where the configuration or the views do not fit, or `out` holds a
    benchmark with other settings.
    """
    check(cfg)
    validate(benchmark, "benchmark")
    views, validation = inputs.views, inputs.validation
    check_views(cfg, views, validation)
    settings = {
        "seed": seed,
        "size": views.size,
        "scenes": [len(views), len(validation)],
        "benchmark": asdict(benchmark),
        "translate": asdict(cfg),
        "cameras": [asdict(camera) for camera in inputs.cameras],
    }
    if key := files.differing(out / "settings.json", settings):
        raise UserError(f"{out}: holds a benchmark with other settings ({key}): expected another out=")
    ways = _ways(cfg, benchmark, inputs)
    speeds = speed.measure(ways, validation, 60 * SHARE * benchmark.minutes)
    curves = _curves(ways, benchmark, inputs, out, seed)
    networks = {name: speeds[name] | _loop_speed(curves[name]) | {"curve": curves[name]} for name in ways}
    found = {
        "reference": REFERENCE,
        "error": ERROR,
        "size": views.size,
        "batch_size": cfg.training.batch_size,
        "precision": precision.resolved(cfg.training),
        "threads": torch.get_num_threads(),
        "minutes": benchmark.minutes,
        "networks": networks,
        "ratios": {name: ratios(networks[name], networks[REFERENCE]) for name in (OURS, PICTURE)},
    }
    table = publish(out / "translate_table.json", **benchmark_report.as_table(found))
    files.write(out / "translate.json", json.dumps(found, indent=1))
    benchmark_report.draw(found, out / "translate.png")
    log.info("%s/translate.json, translate.png, %s", out, table.name)
    return found


def ratios(ours: dict[str, Any], reference: dict[str, Any]) -> dict[str, float | None]:
    """What ours is worth against the reference, from what `run` measured of both.

    `error`: ours over the reference's, after all the time. `inference`, `step`, `loop`: how many times as many pictures
    a second. `pictures`: how many times fewer ours saw until its error was at most the least that the reference ever
    had. `time`: how many times sooner that was; pictures a second at equal error, where a picture counts for as much as
    the reference learns from one. Both are of the first validation at which it was so, a little late for ours; None
    where it never was.
    """
    best = min(reference["curve"], key=lambda row: row[ERROR])
    reached = next((row for row in ours["curve"] if row[ERROR] <= best[ERROR]), None)
    speeds = ("inference_pictures_per_second", "step_pictures_per_second", "loop_pictures_per_second")
    found: dict[str, float | None] = {"error": ours["curve"][-1][ERROR] / reference["curve"][-1][ERROR]}
    found |= {name.partition("_")[0]: ours[name] / reference[name] for name in speeds}
    for name, key in (("time", "minutes"), ("pictures", "pictures")):
        found[name] = best[key] / reached[key] if reached else None
    return found


def _ways(cfg: TranslateConfig, benchmark: BenchmarkConfig, inputs: Inputs) -> dict[str, tuple[TranslateConfig, Build]]:
    """All that is compared, by name: no GAN, no start from elsewhere, no ranges that widen."""
    never = 10**9  # the benchmark validates by itself
    training = replace(cfg.training, max_steps=0, max_minutes=benchmark.minutes, validate_every=never)
    loss = replace(cfg.loss, adversarial=0.0)
    ours = replace(cfg, training=training, loss=loss, adr=CameraAdrConfig(), start="")
    alone = replace(loss, segmentation=0.0, depth=0.0, rectification=0.0)
    picture = replace(ours, loss=alone, network=replace(cfg.network, composed=False))
    theirs = replace(picture, training=replace(training, learning_rate=benchmark.learning_rate))
    rest = (*inputs.cameras, inputs.views)
    return {
        OURS: (ours, partial(Rcan, ours, *rest)),
        PICTURE: (picture, partial(Rcan, picture, *rest)),
        REFERENCE: (theirs, partial(Pix2PixUNetTraining, benchmark.width, theirs, *rest)),
    }


def _curves(
    ways: dict[str, tuple[TranslateConfig, Build]], benchmark: BenchmarkConfig, inputs: Inputs, out: Path, seed: int
) -> dict[str, Curve]:
    """Trains all in turns; a curve each, of which the folder keeps what is done."""
    paths = {name: out / FOLDERS[name] / "curve.json" for name in ways}
    curves: dict[str, Curve] = {n: json.loads(path.read_text()) if path.exists() else [] for n, path in paths.items()}
    for done in range(benchmark.slices):
        part = (done + 1) / benchmark.slices
        for name, (cfg, build) in ways.items():
            if len(curves[name]) > done:
                continue
            folder = paths[name].parent
            train(build, inputs.views, inputs.validation, cfg.training, folder, seed, part)
            row = {"minutes": part * benchmark.minutes} | _validated(cfg, build(), folder, inputs.validation, seed)
            curves[name].append(row)
            files.write(paths[name], json.dumps(curves[name], indent=1))
            log.info("%s: %.2f of %g min, %s %.4f", name, row["minutes"], benchmark.minutes, ERROR, row[ERROR])
    return curves


@torch.no_grad()
def _validated(cfg: TranslateConfig, method: Rcan, folder: Path, validation: ViewSource, seed: int) -> dict[str, float]:
    """Pictures seen, and the metrics, of the training in `folder` as far as it has come."""
    state, unet = checkpoint.load_state(folder / LAST), method.networks["unet"]
    unet.load_state_dict(state["networks"]["unet"])
    method.device = Fabric(accelerator=cfg.training.accelerator, devices=1).device
    unet.to(method.device).eval()
    metrics = method.validate(validation, generator(VALIDATION, seed))
    return {"pictures": state["step"] * cfg.training.batch_size} | metrics


def _loop_speed(curve: Curve) -> dict[str, float]:
    """Pictures a second in training with all that belongs to it: reading, the camera, the network."""
    return {"loop_pictures_per_second": curve[-1]["pictures"] / 60 / curve[-1]["minutes"]}
