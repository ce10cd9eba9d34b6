"""Imports that wait until they are needed: torch alone takes longer to import than most joints to diagnose."""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any


def load(place: str) -> Any:
    """What is at MODULE:NAME, imported now."""
    module, name = place.split(":")
    return getattr(import_module(module), name)


def callable_package(package: str, place: str) -> None:
    """Let a package be called, which calls what is at MODULE:NAME.

    So `vision_s2r.diagnose(recording)` diagnoses, and `vision_s2r.diagnose.config` is a module all the same.
    """

    class Callable(ModuleType):
        def __call__(self, *arguments: Any, **options: Any) -> Any:
            return load(place)(*arguments, **options)

    sys.modules[package].__class__ = Callable


def import_torchvision() -> ModuleType:
    """Torchvision, also where its compiled operators do not load: it asks for their schemas nevertheless."""
    try:
        return import_module("torchvision")
    except RuntimeError:
        import torch

        for name in ("nms", "qnms"):
            torch.library.define(f"torchvision::{name}", "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
        return import_module("torchvision")
