"""Robots of known answer: a camera, two joints and a contact, each a machine of its own kind's generator."""

import itertools
import json
from pathlib import Path

import numpy as np

from vision_s2r.files import write
from vision_s2r.gapbench.generate import camera, contact, joint
from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine

CASES = ("null", "single", "pair", "triple", "unknown", "known_unknown")
PARTS = {"camera": camera, "joints/a": joint, "contact": contact, "joints/b": joint}  # by folder
_PAIRS = tuple(itertools.combinations(PARTS, 2))
_MANY = 10_000  # places in a part's own turn of effects, which robots take at random


def cases_of_parts(case: str, index: int) -> dict[str, str]:
    """The case that each part of a robot is of; parts are taken in turn."""
    folders = tuple(PARTS)
    first, second = folders[index % 4], folders[(index + 1) % 4]
    wrong = {
        "null": {},
        "single": {first: "single"},
        "pair": dict.fromkeys(_PAIRS[index % len(_PAIRS)], "single"),
        "triple": dict.fromkeys(("camera", "contact", f"joints/{'ab'[index % 2]}"), "single"),
        "unknown": {first: "unknown"},
        "known_unknown": {first: "unknown", second: "single"},
    }[case]
    return {folder: wrong.get(folder, "null") for folder in folders}


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """Draw one robot of a case; see `generate.base`."""
    made = {
        folder: PARTS[folder].machine(own, int(rng.integers(_MANY)), split, rng)
        for folder, own in cases_of_parts(case, index).items()
    }
    answers = {folder: part.answer for folder, part in made.items()}
    effects: Effects = {f"{folder}.{name}": of for folder, own in answers.items() for name, of in own.effects.items()}
    unknown = [f"{folder}.{own.unknown}" for folder, own in answers.items() if own.unknown]
    answer = Answer(
        case,
        effects,
        unknown=unknown[0] if unknown else None,
        parts={folder: own.to_dict() for folder, own in answers.items()},
    )

    def save(folder: Path) -> None:
        for name, part in made.items():
            (folder / name).mkdir(parents=True)
            part.write(folder / name)
        joints = [name for name in PARTS if name.startswith("joints/")]
        parts = {"camera": "camera", "joints": joints, "contact": "contact"}
        head = {"format": "vision-s2r/recording/1", "kind": "robot", "parts": parts}
        write(folder / "recording.yaml", json.dumps(head, indent=1) + "\n")  # JSON is YAML

    return GeneratedMachine(answer, save)
