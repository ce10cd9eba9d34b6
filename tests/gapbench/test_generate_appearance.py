"""Generated scenes: what is written is what was drawn, by both renderers."""

import numpy as np
import pytest

from vision_s2r.gapbench.generate import appearance
from vision_s2r.recording import CameraRecording, read


@pytest.mark.parametrize("index", [0, 4], ids=["rays", "PyBullet"])
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
