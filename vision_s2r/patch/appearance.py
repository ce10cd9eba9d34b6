"""Surfaces and light of a scene: what to change in a renderer, by label."""

import numpy as np
import torch

from vision_s2r.appearance import is_appearance, label_of
from vision_s2r.appearance.effect import direction
from vision_s2r.camera.colour import to_coded, to_linear
from vision_s2r.effects import summary, unqualified
from vision_s2r.patch.hydra import RANDOMIZED, entry, number
from vision_s2r.recording import CameraRecording
from vision_s2r.report.reading import Diagnosed, library
from vision_s2r.scene.appearance import CANONICAL_COLOURS, CLASSES


def of_scene(named: Diagnosed) -> Diagnosed:
    """What of a diagnosis is of surfaces and light."""
    return {name: given for name, given in named.items() if is_appearance(name)}


def hydra(named: Diagnosed, recording: CameraRecording, randomize: bool) -> str:
    """YAML of the scene: by label the effects of its surface, then those of the light; parameters as in the report.

    `rgba` is the label's mean color in the simulator's pictures with the gains, coded, for renderers that paint one; of
    this project's own renders, whose labels number the classes, `part` is the class and `rgba` its canonical color so
    changed.
    """
    found, effects = of_scene(named), library("camera")
    lines = [f"# Surfaces and light as they were diagnosed{f', {RANDOMIZED}' if randomize else ''}.", ""]
    labels = sorted({label for name in found if (label := label_of(name)) is not None})
    lines += ["# By label of the recording", "labels:" if labels else "labels: {}"]
    for label in labels:
        called = recording.label_names.get(label)
        lines += [f"  {label}:{f'  # {called}' if called else ''}", *_surface(label, found, recording)]
        for name in [name for name in found if label_of(name) == label]:
            lines += [f"    # {summary(effects[name])}", f"    {unqualified(name)}:"]
            for parameter in effects[name].parameters:
                one = found[name][parameter.name]
                lines += entry(parameter.name, one, parameter.unit, randomize, "", "      ")
    light = [name for name in found if label_of(name) is None]
    lines += ["# Of the whole scene", "light:" if light else "light: {}"]
    for name in light:
        lines += [f"  # {summary(effects[name])}", f"  {name}:"]
        for parameter in effects[name].parameters:
            lines += entry(parameter.name, found[name][parameter.name], parameter.unit, randomize, "", "    ")
        if name == "light_direction":
            towards = direction(*(found[name][key].value for key in ("azimuth", "elevation")))
            lines += ["    # Towards the light, in the camera's axes: x right, y down, z forward"]
            lines += [f"    towards: [{', '.join(number(each) for each in towards)}]"]
    return "\n".join(lines) + "\n"


def _surface(label: int, found: Diagnosed, recording: CameraRecording) -> list[str]:
    """The color that the label's surface is to be painted in."""
    gains = found.get(f"{label}.albedo")
    if gains is None or recording.labels is None:
        return []
    factors = np.array([gains[key].value for key in ("red", "green", "blue")])
    seen = recording.sim[recording.labels == label]
    lines = ["    # Mean color of its pixels with the gains, coded: red, green, blue, opacity"]
    lines += [f"    rgba: {_changed(seen.mean(0), factors)}"]
    if label < len(CLASSES):
        color = _changed(np.array(CANONICAL_COLOURS[CLASSES[label]]), factors)
        lines += [f"    # In this project's own renders it is the {CLASSES[label]}, whose canonical color becomes"]
        lines += [f"    canonical: {color}"]
    return lines


def _changed(coded: np.ndarray, gains: np.ndarray) -> str:
    light = to_linear(torch.from_numpy(coded.astype(np.float64))).numpy() * gains
    color = to_coded(torch.from_numpy(light.clip(0, 1))).numpy()
    return f"[{', '.join(number(float(each)) for each in color)}, 1.0]"
