"""What to photograph next."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch

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
    if len(rivals) > 1:
        name, difference = _most_telling(study, rivals)
        asked = [name]
        sentences.append(
            f"Photograph {name} (next_recording.png, printed so that it fills the picture) in 16 places: there the "
            f"rivals differ by {difference:.1f} grey levels (root mean square)."
        )
    for reason in sorted(set(not_excited.values())):
        names = ", ".join(name for name, why in not_excited.items() if why == reason)
        sentences.append(f"To see {names}: {_REMEDIES[reason]}, 16 frames.")
    return Experiment(" ".join(sentences), target=_printable(study, asked[0]) if asked else None)


def _printable(study: Study, name: str) -> np.ndarray:
    """A target as dots [H, W] of a print, as large as whole pixels of the recording make it."""
    height, width = (round(size / study.pictures.scale) for size in study.pictures.sim.shape[-2:])
    dots = (targets(1, height, width)[name][0] * 255).round().to(torch.uint8).numpy()
    return np.kron(dots, np.ones((_PRINTED, _PRINTED), np.uint8))


@torch.inference_mode()
def _most_telling(study: Study, rivals: Sequence[Hypothesis]) -> tuple[str, float]:
    """The target on which the predictions of the first rival and of each other differ most, and by how much."""
    found = {}
    for name, picture in targets(*study.pictures.sim.shape[1:]).items():
        pictures = type(study.pictures)(
            picture[None],
            picture[None],
            torch.ones_like(picture[:1])[None],
            study.pictures.intrinsics,
            study.pictures.encoding,
            study.pictures.scale,
        )
        means = [pictures.predict(rival.values, [0]).mean for rival in rivals]
        found[name] = min(float((mean - means[0]).square().mean().sqrt()) * 255 for mean in means[1:])
    best = max(found, key=lambda name: found[name])
    return best, found[best]


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
