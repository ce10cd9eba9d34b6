"""A stream of pictures goes in, and comes out beside what the translator makes of it."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from vision_s2r.errors import UserError
from vision_s2r.translate import Translator
from vision_s2r.translate.video import VideoConfig, translate_video


def pictures(count: int) -> np.ndarray:
    """Smooth colours that move, uint8 [count, 96, 128, 3]."""
    rows, columns = np.mgrid[:96, :128]
    return np.stack([np.stack([rows + 9 * k, columns + 5 * k, rows + columns], -1) for k in range(count)]).astype(
        np.uint8
    )


def frames(path: Path) -> np.ndarray:
    video, found = cv2.VideoCapture(str(path)), []
    while True:
        more, frame = video.read()
        if not more:
            return np.stack(found)
        found.append(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB))


def test_a_folder_and_the_video_of_it(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for index, picture in enumerate(pictures(40)):
        cv2.imwrite(str(tmp_path / "in" / f"{index:03}.png"), picture[..., ::-1])
    made = translate_video(VideoConfig(str(tmp_path / "in"), out=str(tmp_path / "out.mp4"), rate=5.0))
    found = frames(made)
    assert found.shape == (40, 256, 512, 3)
    seen = np.stack([cv2.resize(p[:, 16:112], (64, 64), interpolation=cv2.INTER_AREA) for p in pictures(40)])
    canonical = Translator.load("bin-64")(torch.from_numpy(seen)).numpy()
    for k in (0, 39):  # what a codec loses is little
        assert np.abs(found[k, ::4, :256:4].astype(int) - seen[k]).mean() < 8
        assert np.abs(found[k, ::4, 256::4].astype(int) - canonical[k]).mean() < 8
    again = translate_video(VideoConfig(str(made), out=str(tmp_path / "again.mp4"), scale=1))
    assert frames(again).shape == (40, 64, 128, 3)
    assert cv2.VideoCapture(str(again)).get(cv2.CAP_PROP_FPS) == pytest.approx(5.0)
    assert {path.name for path in tmp_path.iterdir()} == {"in", "out.mp4", "again.mp4"}


@pytest.mark.parametrize(
    ("source", "out", "message"),
    [
        ("", "a.mp4", "source is missing"),
        ("nowhere.mp4", "a.mp4", "no such file or folder"),
        (".", "a.mp4", "no pictures, expected some of"),
        ("text.mp4", "a.mp4", "reads no video"),
        ("text.mp4", "a.gif", r"ends in \.mp4"),
    ],
)
def test_what_is_no_stream_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, out: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("text.mp4").write_text("no video")
    with pytest.raises(UserError, match=message):
        translate_video(VideoConfig(source, out=out))
    assert [path.name for path in tmp_path.iterdir()] == ["text.mp4"]
