"""What to photograph next."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from vision_s2r.fit.camera import poses as poses_of
from vision_s2r.fit.camera.effect import NEEDS
from vision_s2r.fit.camera.study import Study
from vision_s2r.fit.case import Experiment, Hypothesis

_REMEDIES = {need.lacking: need.remedy for need in NEEDS.values()}
_SHOWS = {"edges": "a chessboard of squares 8 px wide", "contrast": "a grey wedge from black to white"}
_PRINTED = 8  # dots of a print to a pixel of the picture that it fills


def advise(study: Study, rivals: Sequence[Hypothesis], not_excited: Mapping[str, str]) -> Experiment:
    """The pictures that would tell the rivals apart, and show what these could not; empty where none is needed.

    What can be printed comes with it.
    """
    sentences, asked = [], [name for need, name in _SHOWS.items() if NEEDS[need].lacking in not_excited.values()]
    poses = _candidates(study)[: poses_of.POSES]
    if len(rivals) > 1:
        name, poses, difference = _most_telling(study, rivals)
        asked = [name]
        sentences.append(
            f"Photograph {name} (next_recording.png, printed) in the {len(poses)} poses of next_recording.csv: there "
            f"the rivals differ by {difference:.1f} grey levels (root mean square)."
        )
    for reason in sorted(set(not_excited.values())):
        names = ", ".join(name for name, why in not_excited.items() if why == reason)
        sentences.append(f"To see {names}: {_REMEDIES[reason]}, 16 frames.")
    if not asked:
        return Experiment(" ".join(sentences))
    return Experiment(" ".join(sentences), poses_of.table(poses), _printable(study, asked[0]))


def _candidates(study: Study) -> np.ndarray:
    """Poses [N, 6] in which a print may be held; it fills the picture at the first distance."""
    return poses_of.candidates(float(study.pictures.intrinsics[0]) / study.pictures.sim.shape[-1])


def _printable(study: Study, name: str) -> np.ndarray:
    """A target as dots [H, W] of a print, as large as whole pixels of the recording make it."""
    height, width = (round(size / study.pictures.scale) for size in study.pictures.sim.shape[-2:])
    dots = (targets(1, height, width)[name][0] * 255).round().to(torch.uint8).numpy()
    return np.kron(dots, np.ones((_PRINTED, _PRINTED), np.uint8))


@torch.inference_mode()
def _most_telling(study: Study, rivals: Sequence[Hypothesis]) -> tuple[str, np.ndarray, float]:
    """The target, and the POSES [POSES, 6] of it, in which the first rival's predictions are furthest from others'.

    And how far, from the nearest of them (grey levels, root mean square).
    """
    found = {}
    poses, channels = _candidates(study), study.pictures.sim.shape[1]
    about = study.pictures.intrinsics, study.pictures.encoding, study.pictures.scale
    for name, picture in targets(*study.pictures.sim.shape[1:]).items():
        views = torch.from_numpy(
            np.stack([poses_of.seen(picture[0].numpy(), pose, about[0].numpy()) for pose in poses])
        )
        views = views.float()[:, None].expand(-1, channels, -1, -1).contiguous()
        pictures = type(study.pictures)(views, views, torch.ones_like(views[:, :1]), *about)
        means = [pictures.predict(rival.values, range(len(poses))).mean for rival in rivals]
        squares = torch.stack([(mean - means[0]).square().mean((1, 2, 3)) for mean in means[1:]]).amin(0).numpy()
        best = np.sort(np.argsort(-squares, kind="stable")[: poses_of.POSES])
        found[name] = poses[best], float(np.sqrt(squares[best].mean())) * 255
    name = max(found, key=lambda each: found[each][1])
    return name, *found[name]


def targets(channels: int, height: int, width: int) -> dict[str, torch.Tensor]:
    """Pictures [C, H, W] that a person can print, by what to call them."""
    y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    board = ((x // 8 + y // 8) % 2) * 0.8 + 0.1
    lines = ((x // 2) % 2) * 0.8 + 0.1
    wedge = x / (width - 1)
    star = (torch.atan2(y - height / 2, x - width / 2) * 18).sin() * 0.4 + 0.5
    pictures = {
        "a chessboard of squares 8 px wide": board,
        "vertical lines 2 px wide": lines,
        "a grey wedge from black to white": wedge,
        "an evenly lit wall of mid grey": torch.full((height, width), 0.5),
        "a Siemens star of 18 spokes": star,
    }
    return {name: picture.float().expand(channels, height, width) for name, picture in pictures.items()}
