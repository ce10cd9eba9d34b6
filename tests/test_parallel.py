"""Work in pieces is the same wherever it runs, and outlives what it runs on."""

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import hydra
import pytest
from omegaconf import open_dict

from vision_s2r import parallel
from vision_s2r.commands.main import main
from vision_s2r.errors import UserError
from vision_s2r.paths import CONFIGS
from vision_s2r.reliability.tasks import DATA, TASKS, hashes
from vision_s2r.render import RenderConfig, Views, render
from vision_s2r.render.manifest import Manifest
from vision_s2r.scene import SceneConfig

PATH = os.pathsep.join([str(Path(__file__).parent), *sys.path])
RENDER = RenderConfig(scenes=8, size=32, margin=4, views=1, grasps=0, shard_size=2, workers=1)


def test_what_a_store_holds_goes_on_elsewhere(tmp_path):
    first = replace(RENDER, out=str(tmp_path / "here"), store="memory://renders/mine")
    there = replace(first, out=str(tmp_path / "there"))
    render(SceneConfig(), first)
    written = {path.name: path.stat().st_mtime_ns for path in Path(first.out).glob("shard-*")}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vision_s2r.render.shard.render_shard", None)  # nothing is rendered again
        render(SceneConfig(), there)
    assert Manifest.load(Path(there.out)) == Manifest.load(Path(first.out)) and len(written) == 4
    assert len(Views.open(there.out)) == 8
    with pytest.raises(UserError, match=r"render\.store = nowhere://x"):
        render(SceneConfig(), replace(there, store="nowhere://x"))


@pytest.fixture(scope="module")
def cluster():
    """Two nodes of one core each."""
    pytest.importorskip("ray", reason="the extra `ray` is not installed")
    import ray
    from ray.cluster_utils import Cluster

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", PATH)  # its workers know this file's functions
        nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
        second = nodes.add_node(num_cpus=1)
        nodes.wait_for_nodes()
        patch.setenv("RAY_ADDRESS", nodes.address)
        yield nodes, second
        ray.shutdown()
        nodes.shutdown()


def note(number: int, folder: Path) -> int:
    """A second of work, noted when it begins."""
    with (folder / "begun.txt").open("a") as file:
        file.write(f"{number}\n")
    time.sleep(1)
    if number == 5:
        raise UserError("five is right out")
    return number * number


@pytest.mark.slow
def test_a_cluster_renders_the_same_bytes(cluster, tmp_path, capfd):
    one = replace(RENDER, out=str(tmp_path / "one"))
    two = replace(one, out=str(tmp_path / "two"), backend="ray", workers=-1)
    render(SceneConfig(), one)
    render(SceneConfig(), two)
    assert (tmp_path / "one" / "manifest.json").read_bytes() == (tmp_path / "two" / "manifest.json").read_bytes()
    for path in (tmp_path / "one").glob("shard-*"):
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
    assert "4/4" in capfd.readouterr().err  # the bar


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """Runs a small command with more words, in a folder of this name; returns the hashes of its result."""
    data = tmp_path_factory.mktemp("data")

    def run(name, folder, *more):
        task = TASKS[name]
        if task.data and not (data / "policy-0").exists():
            call(DATA.words(data, data))
        call([*task.words(folder, data), *more])
        return hashes(task, folder)

    def call(words):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["vision-s2r", *words])
            main()

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("gapbench", ["backend=ray", "jobs=2"]),
        ("ablate", ["backend=ray", "jobs=2"]),
        ("run", ["backend=ray", "jobs=2", "evaluate.backend=ray", "evaluate.workers=2"]),  # two seeds, and their grasps
    ],
)
def test_a_cluster_comes_to_the_same_files(command, cluster, tmp_path, name, more):
    found = command(name, tmp_path / "out", *more)
    (tmp_path / "out").rename(tmp_path / "ray")  # a student knows its teacher by its path
    assert found == command(name, tmp_path / "out") != {}


@pytest.mark.slow
def test_a_sweep_is_jobs_of_submitit_that_come_to_the_same_files(command, tmp_path):
    pytest.importorskip("submitit", reason="the extra `slurm` is not installed")
    jobs = ["jobs=2", "hydra/launcher=submitit_local", f"hydra.launcher.submitit_folder={tmp_path}/said/%j"]
    assert command("ablate", tmp_path / "jobs", *jobs) == command("ablate", tmp_path / "local") != {}
    seeds = command("translate", tmp_path / "seeds", "--multirun", "seed=0,1", *jobs)
    command("translate", tmp_path / "alone", "seed=1")
    assert seeds == command("translate", tmp_path / "alone", "seed=0") and len(seeds) > 4


def test_jobs_of_slurm_are_as_many_at_a_time_as_asked_for():
    pytest.importorskip("submitit", reason="the extra `slurm` is not installed")
    with hydra.initialize_config_dir(str(CONFIGS), version_base="1.3"):
        cfg = hydra.compose("config", ["hydra/launcher=slurm", "jobs=5"], return_hydra_config=True)
    with open_dict(cfg):
        cfg.hydra.runtime.output_dir = ""
    assert cfg.hydra.launcher._target_.endswith("SlurmLauncher") and cfg.hydra.launcher.array_parallelism == 5


@pytest.mark.slow
def test_mistakes_come_through_as_one_line(cluster, tmp_path):
    with pytest.raises(UserError, match=r"^five is right out$"):
        list(parallel.run(note, [(5, tmp_path)], 1, "ray"))


@pytest.mark.slow
def test_a_node_that_dies_costs_what_it_had_in_flight(cluster, tmp_path):
    nodes, second = cluster
    numbers = [k for k in range(20) if k != 5]
    found = []
    for value in parallel.run(note, ((k, tmp_path) for k in numbers), -1, "ray"):
        found.append(value)
        if len(found) == 4:
            nodes.remove_node(second, allow_graceful=False)
    assert found == [k * k for k in numbers]
    begun = (tmp_path / "begun.txt").read_text().split()
    assert len(begun) - len(numbers) <= parallel.AHEAD  # of the one core that died
    nodes.add_node(num_cpus=1)


@pytest.mark.slow
def test_a_run_that_is_killed_leaves_no_workers(tmp_path):
    pytest.importorskip("ray", reason="the extra `ray` is not installed")
    code = "from pathlib import Path; from vision_s2r import parallel; import test_parallel as here; "
    code += f"list(parallel.run(here.note, ((k, Path({str(tmp_path)!r})) for k in range(100, 200)), 2, 'ray'))"
    environment = {key: value for key, value in os.environ.items() if key != "RAY_ADDRESS"}
    environment |= {"PYTHONPATH": PATH, "MARK_OF_TEST": str(tmp_path)}
    driver = subprocess.Popen([sys.executable, "-c", code], env=environment, stderr=subprocess.DEVNULL)
    while not (tmp_path / "begun.txt").exists():
        assert driver.poll() is None
        time.sleep(0.2)
    driver.kill()
    driver.wait()
    for _ in range(60):
        if not (left := _marked(str(tmp_path))):
            return
        time.sleep(1)
    raise AssertionError(left)


def _marked(mark: str) -> list[str]:
    """The processes that were begun under this mark."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if f"MARK_OF_TEST={mark}".encode() in (process / "environ").read_bytes():
                found.append((process / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue
    return [each for each in found if each]
