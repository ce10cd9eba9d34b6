"""An exported network gives what torch gives, for any number of pictures and grasps."""

import json
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch

from vision_s2r.errors import UserError
from vision_s2r.export import ExportConfig, export_policy, export_translator
from vision_s2r.export import onnx as exporting
from vision_s2r.grasp import GraspPolicy
from vision_s2r.translate import Translator


@pytest.mark.slow
def test_a_translator_without_torch(tmp_path: Path) -> None:
    path = export_translator(ExportConfig("bin-64", str(tmp_path)))
    images = torch.rand(3, 3, 64, 64, generator=torch.Generator().manual_seed(0))
    found = onnxruntime.InferenceSession(path).run(["canonical", "depth"], {"images": images.numpy()})
    expected = Translator.load("bin-64").predict(images)
    for name, values in zip(("canonical", "depth"), found, strict=True):
        np.testing.assert_allclose(values, expected[name].numpy(), atol=1e-4)
    described = json.loads(path.with_suffix(".json").read_text())
    assert [port["name"] for port in described["outputs"]] == ["canonical", "segmentation", "depth"]
    assert described["largest_difference_from_torch"] < 1e-4
    card = path.with_suffix(".md").read_text()
    assert "| in | `images` | batch, 3, 64, 64 |" in card and "Known to fail" in card


@pytest.mark.slow
def test_a_policy_without_torch(tmp_path: Path) -> None:
    path = export_policy(ExportConfig("bin-64-student", str(tmp_path)))
    generator = torch.Generator().manual_seed(0)
    images, grasps = torch.rand(2, 3, 64, 64, generator=generator), 0.1 * torch.rand(2, 7, 3, generator=generator)
    intrinsics = torch.tensor([[100.0, 100.0, 32.0, 32.0]]).repeat(2, 1)
    extrinsics = torch.diag(torch.tensor([1.0, -1.0, -1.0, 1.0])).repeat(2, 1, 1)
    extrinsics[:, 2, 3] = 0.8
    given = {"images": images, "intrinsics": intrinsics, "extrinsics": extrinsics, "grasps": grasps}
    (chances,) = onnxruntime.InferenceSession(path).run(None, {name: x.numpy() for name, x in given.items()})
    expected = GraspPolicy.load("bin-64-student").score(images, intrinsics, extrinsics, grasps)
    np.testing.assert_allclose(chances, expected.numpy(), atol=1e-4)


@pytest.mark.slow
def test_a_file_that_differs_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exporting, "PARITY", 1e-12)
    with pytest.raises(UserError, match="differs from torch by"):
        export_policy(ExportConfig("bin-64-student", str(tmp_path)))
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_checkpoint_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no released translator 'bin-46', did you mean 'bin-64'"):
        export_translator(ExportConfig("bin-46", str(tmp_path)))
