"""What a report says of a policy that has curves of sensitivity."""

import json

import pytest

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.camera.strength import at
from vision_s2r.diagnose.worth import worth
from vision_s2r.errors import UserError
from vision_s2r.report.words import worth as said


def curves(path):
    def point(row, effect, strength, value):
        return {"row": row, "effect": effect, "strength": strength, "value": value} | {
            "low": value - 0.04,
            "high": value + 0.04,
        }

    points = [point("rcan", effect, 0.0, 0.92) for effect in ("defocus_blur", "gamma")]
    points += [point("rcan", "defocus_blur", strength, 0.92 - 0.2 * strength) for strength in (0.5, 1.0, 2.0)]
    points += [point("rcan", "gamma", strength, 0.91) for strength in (0.5, 1.0, 2.0)]
    points += [point("other", "gamma", strength, 0.5) for strength in (0.0, 2.0)]
    path.write_text(json.dumps(points))
    return str(path)


def found(name, strength):
    values = at(CAMERA_EFFECTS[name], strength)
    return {"name": name, "parameters": {key: {"value": value} for key, value in values.items()}}


def test_the_report_says_what_is_worth_mending_for_a_policy(tmp_path):
    path = curves(tmp_path / "sensitivity.json")
    policy = worth([found("gamma", 1.0), found("defocus_blur", 1.5), found("vignetting", 1.0)], path)
    dear, cheap = policy["effects"]  # vignetting has no curve
    assert (dear["name"], dear["sure"], dear["beyond"]) == ("defocus_blur", True, False)
    assert dear["success"] == pytest.approx(0.62) and dear["lost"] == pytest.approx(0.3)
    assert (cheap["name"], cheap["sure"]) == ("gamma", False)
    first = "mend this first: defocus blur (62 %, 58 % to 66 %)."
    assert said(policy) == f"For the policy rcan, which holds 92 % of grasps without any, {first}"
    assert "None of these effects" in said(worth([found("gamma", 1.0)], path))
    assert worth([found("defocus_blur", 3.0)], path)["effects"][0]["beyond"]
    assert worth([found("vignetting", 1.0)], path) is None
    with pytest.raises(UserError, match="no row 'othr', did you mean 'other'"):
        worth([found("gamma", 1.0)], path, "othr")
    (tmp_path / "none.json").write_text("[{}]")
    with pytest.raises(UserError, match="vision-s2r sensitivity"):
        worth([found("gamma", 1.0)], str(tmp_path / "none.json"))
