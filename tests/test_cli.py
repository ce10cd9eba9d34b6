"""A mistake on the command line is one clear line with the nearest valid name, and exit code 2."""

import subprocess
import sys
from pathlib import Path

import pytest

from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.paths import CONFIGS

SCRIPTS = sorted((Path(__file__).parents[1] / "scripts").glob("*.py"))


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("render.sise=32", r"'render\.sise'.*did you mean 'render\.size'"),
        ("render.size=big", r"render\.size"),
        ("camera=webcm", "did you mean 'webcam'"),
        ("experiment=dmo", "did you mean 'demo'"),
        ("scene.physics.squeeze_force=hard", "squeeze_force"),
        ("translate.loss.adversarail=0", r"did you mean 'translate\.loss\.adversarial'"),
        ("+render.sise=32", r"'render\.sise': did you mean 'size'"),
        ("+evaluate.rows.mine.polcy=[x]", r"'evaluate\.rows\.mine\.polcy': did you mean 'policy'"),
        ("+evaluate.rows.mine.mirrored=perhaps", r"'evaluate\.rows\.mine\.mirrored'.*bool"),
        ("+evaluate.rows.mine=3", r"'evaluate\.rows\.mine' is 3: expected options"),
        ("+adapt.front.width=8", r"adapt\.front\.width=8: what this key is in is null"),
    ],
)
def test_a_mistake_names_the_nearest_valid_one(override, message):
    with pytest.raises(UserError, match=message):
        compose(Config, overrides=[override])


def test_a_row_of_ones_own_can_be_added_to_a_table():
    cfg = compose(Config, overrides=["+evaluate.rows.mine.policy=[x]", "+evaluate.rows.mine={translator: [bin-64]}"])
    mine = cfg.evaluate.rows["mine"]
    assert mine.policy == ["x"] and mine.translator == ["bin-64"] and mine.trained_on == "canonical"
    assert "rcan" in cfg.evaluate.rows


def test_methods_are_compared_on_the_renders_of_the_table():
    cfg = compose(Config, overrides=["experiment=methods"])
    assert cfg.data.test.out == "renders/cpu/test" and cfg.seeds == 3 and "graspgan_policy" in cfg.evaluate.rows


@pytest.mark.parametrize("name", ["demo", "full", "debug", "cpu"])
def test_experiments_compose_and_are_typed(name):
    cfg = compose(Config, overrides=[f"experiment={name}", "translate.loss.adversarial=0", "camera=none"])
    assert cfg.name == name and cfg.translate.loss.adversarial == 0 and not cfg.camera.effects
    assert cfg.data.test.out == f"renders/{name}/test"


def test_every_file_of_a_configuration_says_what_it_is():
    assert not [path.name for path in CONFIGS.rglob("*.yaml") if not path.read_text().startswith("#")]


def test_scripts_are_thin_and_fail_in_one_line():
    assert all(len(path.read_text().splitlines()) <= 12 for path in SCRIPTS)
    script = Path("scripts/render.py")
    done = subprocess.run([sys.executable, script, "render.scenes=0"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == "error: render.scenes = 0: expected at least 1"
    assert "Traceback" not in done.stderr
