"""How fast a picture becomes a grasp: torch beside onnxruntime, by turns in one process on the same threads."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from vision_s2r.export import graphs
from vision_s2r.export.config import ExportConfig
from vision_s2r.export.onnx import export_policy, export_translator, session
from vision_s2r.grasp import GraspPolicy, cem
from vision_s2r.results import publish
from vision_s2r.translate import Translator
from vision_s2r.translate.ceiling import per_second

ROUNDS, SECONDS = 7, 0.5  # of each way
TRANSLATOR, POLICY = "bin-64", "bin-64-student"
STAGES = ("translate", "grasp", "translate and grasp")


def run(seed: int, out: Path) -> Path:
    """Milliseconds a picture of the released networks, medians; printed, and written to export.json, its path."""
    with tempfile.TemporaryDirectory() as folder:
        translator = session(export_translator(ExportConfig(TRANSLATOR, folder)))
        policy = session(export_policy(ExportConfig(POLICY, folder)))
        ways = _torch(seed) | _onnx(translator, policy, seed)
        for way in ways.values():
            way()
        rounds = [{key: 1e3 / per_second(way, SECONDS) for key, way in ways.items()} for _ in range(ROUNDS)]
    found = {
        stage: {runtime: float(np.median([each[stage, runtime] for each in rounds])) for runtime in ("torch", "onnx")}
        for stage in STAGES
    }
    threads = f"{torch.get_num_threads()} threads, {os.cpu_count()} cores, one picture at a time"
    columns = [f"ms a picture, {threads}", "torch", "onnxruntime", "torch / onnxruntime", "pictures/s, the faster"]
    rows = [
        [stage, ms["torch"], ms["onnx"], ms["torch"] / ms["onnx"], 1e3 / min(ms.values())]
        for stage, ms in found.items()
    ]
    return publish(out / "export.json", "vision-s2r benchmark export", columns, rows)


Ways = dict[tuple[str, str], Callable[[], object]]


def _torch(seed: int) -> Ways:
    translator, policy = Translator.load(TRANSLATOR), GraspPolicy.load(POLICY)
    (image,), (_, intrinsics, extrinsics, _) = _inputs(seed)

    def grasp(picture: Tensor) -> object:
        return policy.act(picture, intrinsics, extrinsics, torch.tensor([seed]))

    return {
        ("translate", "torch"): lambda: translator(image),
        ("grasp", "torch"): lambda: grasp(image),
        ("translate and grasp", "torch"): lambda: grasp(translator(image)),
    }


def _onnx(translator: object, policy: object, seed: int) -> Ways:
    """The same search, its grasps scored by the exported Q."""
    cfg = GraspPolicy.load(POLICY).cfg
    (image,), (_, intrinsics, extrinsics, _) = _inputs(seed)
    known = {"intrinsics": intrinsics.numpy(), "extrinsics": extrinsics.numpy()}

    def translate() -> np.ndarray:
        return translator.run(["canonical"], {"images": image.numpy()})[0]  # type: ignore[attr-defined]

    def grasp(picture: np.ndarray) -> object:
        def score(grasps: Tensor) -> Tensor:
            given = known | {"images": picture, "grasps": grasps.numpy()}
            return torch.from_numpy(policy.run(None, given)[0])  # type: ignore[attr-defined]

        return cem.maximize(score, [seed], cfg.area, cfg.cem, torch.device("cpu"))

    return {
        ("translate", "onnx"): translate,
        ("grasp", "onnx"): lambda: grasp(image.numpy()),
        ("translate and grasp", "onnx"): lambda: grasp(translate()),
    }


def _inputs(seed: int) -> tuple[tuple[Tensor, ...], tuple[Tensor, ...]]:
    one = {"batch": 1, "grasps": 1}
    return graphs.translator(TRANSLATOR).example(seed, **one), graphs.policy(POLICY).example(seed, **one)
