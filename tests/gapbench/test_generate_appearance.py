"""Generated scenes: what is written is what was drawn, by both renderers."""

import numpy as np
import pytest

from vision_s2r.gapbench.generate import appearance
from vision_s2r.recording import CameraRecording, read


@pytest.mark.parametrize("index", [0, len(appearance.EFFECTS)], ids=["rays", "PyBullet"])
def test_a_label_of_another_colour_has_the_gains_of_its_answer(index, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(appearance, "FRAMES", 4)
    machine = appearance.machine("single", index, "tuning", np.random.default_rng(index))
    machine.write(tmp_path)
    recording = read(tmp_path)
    assert isinstance(recording, CameraRecording) and recording.labels is not None and recording.depth is not None
    ((name, gains),) = machine.answer.effects.items()
    label, _, effect = name.partition(".")
    assert effect == "albedo" and 0.1 < recording.depth[recording.depth > 0].min() < 1.5
    own = recording.labels == int(label)
    light = [appearance.to_linear(each.astype(np.float64)) for each in (recording.real, recording.sim)]
    ratio = light[0][own].mean(0) / light[1][own].mean(0)
    assert ratio == pytest.approx(list(gains.values()), rel=0.08)
    elsewhere = ~own & (recording.labels > 0)
    assert np.abs(recording.real - recording.sim)[elsewhere].mean() < 1.5 / 255


def test_what_was_not_rendered_is_inside_its_rectangle(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(appearance, "FRAMES", 4)
    index = appearance.EFFECTS.index("missing_object")
    machine = appearance.machine("single", index, "tuning", np.random.default_rng(index))
    machine.write(tmp_path)
    recording = read(tmp_path)
    assert isinstance(recording, CameraRecording)
    x, y, width, height = (int(each) for each in machine.answer.effects["missing_object"].values())
    off = np.abs(recording.real - recording.sim).max(-1) > 5 / 255
    assert off[:, y : y + height, x : x + width].mean() > 0.4
    off[:, y - 1 : y + height + 1, x - 1 : x + width + 1] = False
    assert off.mean() < 0.001
