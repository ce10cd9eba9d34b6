"""What a user of the package has: names that cost nothing until they are used."""

import subprocess
import sys

import pytest
from recordings import a_joint

import vision_s2r
from vision_s2r.recording import write

HEAVY = {"torch", "lightning_fabric", "numba", "scipy", "numpy", "hydra", "matplotlib", "pybullet", "cv2"}


def imported_by(code: str) -> set[str]:
    """Which heavy packages a fresh process holds after running the code."""
    code += f"\nimport sys; print(*({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_importing_the_package_imports_nothing_heavy():
    assert not imported_by("import vision_s2r; dir(vision_s2r)")


def test_a_joint_is_read_and_diagnosed_without_torch(tmp_path):
    write(a_joint(noise=1e-3), tmp_path / "log")
    code = f"""
import vision_s2r
from vision_s2r.diagnose.config import SearchConfig
cfg = vision_s2r.DiagnoseConfig(joint=SearchConfig(folds=2, beam=1, breadth=1, contenders=1, most=1))
report = vision_s2r.diagnose(vision_s2r.read({str(tmp_path / "log")!r}), cfg)
assert callable(vision_s2r.identify) and report.save({str(tmp_path / "report")!r}).exists()
"""
    assert not imported_by(code) & {"torch", "pybullet"}


def test_networks_are_used_without_what_trains_them():
    code = "import vision_s2r; vision_s2r.Translator, vision_s2r.GraspPolicy"
    assert "lightning_fabric" not in imported_by(code)


@pytest.mark.parametrize("name", sorted(vision_s2r.__all__))
def test_every_name_is_there(name):
    assert callable(getattr(vision_s2r, name)) and name in dir(vision_s2r)
    with pytest.raises(AttributeError, match="has no attribute 'diagnosis'"):
        vision_s2r.__getattr__("diagnosis")
