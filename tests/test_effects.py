"""The vocabulary that joints, cameras and contacts share."""

import math

import pytest
import torch

from vision_s2r.effects import Effect, Parameter, Registry
from vision_s2r.errors import UserError


class Spring(Effect):
    name = "spring"
    source = "actuator"
    parameters = (
        Parameter("stiffness", "N·m/rad", low=1.0, high=1e4, neutral=math.inf, moderate=50.0, scale="log"),
        Parameter("damping", "N·m·s/rad", low=0.0, high=10.0, neutral=None, moderate=0.1),
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"stifness": 5.0, "damping": 0.0}, "did you mean 'stiffness'"),
        ({"stiffness": 5.0}, "missing damping"),
        ({"stiffness": 0.5, "damping": 0.0}, r"stiffness is 0.5, expected 1 to 10000 N·m/rad \(or inf, neutral\)"),
        ({"stiffness": 5.0, "damping": math.inf}, "damping is inf, expected 0 to 10"),
        ({"stiffness": math.nan, "damping": 0.0}, "expected a number"),
        ({"stiffness": "stiff", "damping": 0.0}, "expected a number"),
    ],
)
def test_values_that_cannot_be_are_named(values: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        Spring().check(values)


def test_values_come_back_in_declared_order() -> None:
    assert list(Spring().check({"damping": 1, "stiffness": math.inf})) == ["stiffness", "damping"]


def test_neutral_is_asked_of_the_parameters_that_switch() -> None:
    spring = Spring()
    assert spring.is_neutral({"stiffness": math.inf, "damping": 3.0})
    batch = {"stiffness": torch.tensor([5.0, math.inf]), "damping": torch.tensor([0.0, 0.0])}
    assert spring.is_neutral(batch).tolist() == [False, True]
    assert not spring.is_neutral(spring.moderate())


def test_registry_offers_the_nearest_name_and_refuses_twins() -> None:
    registry: Registry[Spring] = Registry("joint")
    registry.register(Spring)
    assert "spring" in registry and registry["spring"].source == "actuator" and len(registry) == 1
    with pytest.raises(UserError, match="no joint effect is called 'sprin': did you mean 'spring'"):
        registry["sprin"]
    with pytest.raises(ValueError, match="twice"):
        registry.register(Spring)


def test_a_parameter_must_not_contradict_itself() -> None:
    with pytest.raises(ValueError, match="contradicts"):
        Parameter("size", "m", low=0.0, high=1.0, neutral=0.0, moderate=0.5, scale="log")
