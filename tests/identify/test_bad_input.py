"""A mistake is one clear line with exit code 2."""

import json
import subprocess
import sys

import pytest
from machines import a_log
from recordings import a_camera

from vision_s2r.cli import compose
from vision_s2r.errors import UserError
from vision_s2r.identify import IdentifyConfig, identify_all
from vision_s2r.recording import write


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["effects=[baclash]"], "did you mean 'backlash'"),
        (["method=invers"], "did you mean 'inverse'"),
        (["example=two_points"], "did you mean 'two_point'"),
        (["hold.inertai=1"], r"did you mean 'hold\.inertia'"),
        (["hold.inertia=-1"], r"hold\.inertia: value is -1, expected"),
        (["hold.inertia=0.02", "effects=[inertia]"], "among the effects that are to be identified"),
        (["inverse.bandwidth=0"], r"inverse\.bandwidth = 0\.0: expected above 0"),
        (["recording=null"], "expected recording=DIR"),
        (["recording=nowhere"], "nowhere: no such folder"),
        (["validate=nowhere"], "nowhere: no such folder"),
        (["report=nowhere.json"], "nowhere.json: cannot be read"),
    ],
)
def test_configuration(overrides, message, tmp_path):
    given = [f"recording={write(a_log({}), tmp_path / 'log')}", f"out={tmp_path / 'out'}", *overrides]
    with pytest.raises(UserError, match=message):
        identify_all(compose(IdentifyConfig, "identify", given))
    assert not (tmp_path / "out").exists()


def test_a_camera_is_no_joint(tmp_path):
    folder = write(a_camera(), tmp_path / "camera")
    with pytest.raises(UserError, match="a recording of a camera, expected one of a joint"):
        identify_all(IdentifyConfig(recording=str(folder)))


def test_a_report_must_be_of_a_joint(tmp_path):
    path, log = tmp_path / "report.json", write(a_log({}), tmp_path / "log")
    path.write_text(json.dumps({"format": "vision-s2r/report/1", "kind": "camera", "effects": []}))
    with pytest.raises(UserError, match="is of a camera, expected the report of a joint"):
        identify_all(IdentifyConfig(recording=str(log), report=str(path)))


def test_the_script_says_it_in_one_line():
    command = [sys.executable, "scripts/identify.py", "recording=nowhere"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1] == "error: nowhere: no such folder, expected a recording"
