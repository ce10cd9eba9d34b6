"""What a robot costs its task: who is blamed, what is believed of it, and what a controller makes of a belief."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from vision_s2r.camera import CameraConfig
from vision_s2r.cli import compose
from vision_s2r.close_gap import training, withheld
from vision_s2r.close_gap.beliefs import blind, diagnosed, posterior
from vision_s2r.close_gap.config import CloseGapConfig, CloseGapStudyConfig
from vision_s2r.close_gap.summary import Closed, recovered, said, summary
from vision_s2r.joint import pack, simulate
from vision_s2r.recording import read, write
from vision_s2r.render import RenderConfig, Views, render
from vision_s2r.report.robot import html
from vision_s2r.scene import SceneConfig
from vision_s2r.scene.drives import NOMINAL, Drives, Tuning
from vision_s2r.scene.machine import Machine
from vision_s2r.training import Inputs

WAITING, GOAL = np.array([-1.4, 2.0, 0.07, 0.2]), np.array([-1.0, 1.5, 0.1, 0.3])
STEP = SceneConfig().physics.time_step
REPORT = {
    "kind": "robot",
    "effects": [
        {
            "part": "camera",
            "name": "exposure",
            "parameters": {"stops": {"value": -1.5, "unit": "EV", "ci": [-1.6, -1.4]}},
        },
        {
            "part": "joints/lift",
            "name": "latency",
            "parameters": {"delay": {"value": 0.1, "unit": "s", "ci": [0.09, 0.11]}},
        },
        {
            "part": "contact",
            "name": "corner_radius",
            "parameters": {"value": {"value": 0.003, "unit": "m", "ci": [0.002, 0.004]}},
        },
    ],
}


def test_a_report_becomes_the_robot_that_the_scene_can_simulate():
    expected = {"camera": {"exposure": {"stops": -1.5}}, "lift": {"latency": {"delay": 0.1}}}
    assert diagnosed(REPORT).to_dict() == expected
    drawn = posterior(REPORT, 5, 0)
    assert drawn.camera.effects == {"exposure": {"stops": [-1.6, -1.4]}}
    delays = [robot.parts["lift"]["latency"]["delay"] for robot in drawn.robots]
    assert len(set(delays)) == 5 and 0.09 <= min(delays) <= max(delays) <= 0.11
    assert len(blind(CameraConfig(), 3, 0).tuning.believed) == 3


def test_a_controller_that_knows_its_drives_puts_the_tool_where_it_is_wanted():
    effects = {"shoulder": {"coulomb_friction": {"value": 12.0}}, "lift": {"latency": {"delay": 0.15}}}
    assert abs(Drives(effects, STEP, WAITING).approach(GOAL)[0]) > 0.03
    correction, over, after = Tuning((effects,)).correction(WAITING, GOAL, STEP)
    displaced = Drives(effects, STEP, WAITING).approach(GOAL + correction, over)
    assert displaced + correction == pytest.approx(np.zeros(4), abs=0.003)
    assert after * STEP > 0.15 and max(over, after) * STEP < 0.5
    assert not Tuning() and Tuning().correction(WAITING, GOAL, STEP)[1:] == (0, 0)


def test_a_slow_turn_is_waited_for_over_the_grasp_and_not_after_each_stroke():
    slow = {"shoulder": {"viscous_damping": {"value": 120.0}}}
    _, over, after = Tuning((slow,)).correction(WAITING, GOAL, STEP)
    assert over * STEP > 0.5 and after * STEP < 0.05


def _miss(name, log, values):
    """Of the free run of a drive with these effects, in units of the log's noise."""
    first = np.stack([log.position[:, 0], np.zeros(len(log))], axis=1)
    run = simulate(pack(NOMINAL[name], values)[None], log.command, first, log.sample_time)[0, ..., 0]
    return float(np.sqrt(np.mean((run - log.position) ** 2))) / withheld.NOISE


@pytest.mark.slow
def test_a_withheld_drive_s_log_is_that_of_its_effects(tmp_path):
    effects = {"latency": {"delay": 0.13}, "coulomb_friction": {"value": 8.0}}
    log = read(write(withheld.log_of("lift", effects, np.random.default_rng(0)), tmp_path / "lift"))
    assert log.servo and log.units == "linear"
    assert _miss("lift", log, effects) < 3 < 0.03 * _miss("lift", log, {})


@pytest.mark.parametrize("name", ["shoulder", "elbow", "wrist"])  # the lift is too slow to show it
def test_a_withheld_drive_of_nothing_is_the_nominal_one_s(name):
    assert _miss(name, withheld.log_of(name, {}, np.random.default_rng(0)), {}) < 1.25


def test_the_blindly_drawn_cover_what_is_withheld():
    robots = [withheld.drawn(np.random.default_rng([k])) for k in range(20)]
    assert all(robot.parts["camera"] and robot.contact and len(robot.drives) == 2 for robot in robots)
    wide = withheld.everything(200, 0)
    for part, effects in withheld.DRIVES.items():
        for name, (key, ends) in effects.items():
            values = [robot.parts[part][name][key] for robot in wide]
            assert min(values) < ends[0] and max(values) > 0.9 * ends[1]


def test_of_a_robot_that_one_source_leads_the_other_effects_are_small():
    robot = withheld.drawn(np.random.default_rng(3))
    led = withheld.led(robot, "drives", SceneConfig())
    assert led.keys == robot.keys and led.drives == robot.drives
    friction = robot.contact["lateral_friction"]["value"]
    assert led.contact["lateral_friction"]["value"] == pytest.approx(0.7 + 0.1 * (friction - 0.7))
    assert all(led.parts["camera"][name] != values for name, values in robot.parts["camera"].items())
    camera = withheld.led(robot, "camera", SceneConfig())
    assert camera.parts["camera"] == robot.parts["camera"] and camera.drives != robot.drives
    some = [withheld.led(withheld.drawn(np.random.default_rng(k)), "drives", SceneConfig()) for k in range(60)]
    qualities = [each.parts["camera"].get("jpeg_compression", {}).get("quality", 0) for each in some]
    assert max(qualities) == 100  # of the best there is, and no more


@pytest.mark.parametrize(("costs", "chosen", "drawn"), [([0.02, 0.05, 0.2], 2, 3), ([0.01, 0.08, *[0.0] * 10], 1, 12)])
def test_a_robot_is_drawn_until_its_leading_source_costs_what_is_asked(costs, chosen, drawn):
    tried = []

    def cost(robot, source):
        tried.append(robot)
        return costs[len(tried) - 1]

    cfg = CloseGapConfig(leading=0.1)
    robot = withheld.leading("camera", SceneConfig(), cfg, np.random.default_rng(0), cost)
    assert robot == tried[chosen] and len(tried) == drawn


def test_the_simulator_as_it_came_is_trained_at_rates_of_its_own_not_of_fine_tuning(monkeypatch, tmp_path):
    cfg = compose(CloseGapStudyConfig, "close_gap", ["experiment=demo"])
    monkeypatch.setattr(training, "pairs", lambda cfg: Inputs(None, None, None, None))
    monkeypatch.setattr(training, "frozen_q", lambda translate: None)
    monkeypatch.setattr(training, "train_translator", lambda translate, *rest: translate.training)
    came, tuned = training.as_it_came(cfg, tmp_path), training.translator(cfg, CameraConfig(), "bin-64", tmp_path)
    assert (came.learning_rate, came.muon, came.max_steps) == (2e-3, 4e-3, cfg.close_gap.came_steps)
    assert tuned.learning_rate == cfg.close_gap.learning_rate and tuned.muon == cfg.translate.training.muon < 4e-3


def test_a_policy_is_chosen_by_grasps_on_the_robot_that_is_believed_in(monkeypatch, tmp_path):
    """Grasps of the perfect robot chose its first step each time."""
    cfg = compose(CloseGapStudyConfig, "close_gap", ["experiment=debug", "close_gap.grasps=5", "jobs=1"])
    rendered = RenderConfig(out=str(tmp_path), scenes=2, seed=1, views=1, grasps=3, workers=1)
    views = Views.open(render(cfg.scene, rendered))
    slippery = Machine({"contact": {"lateral_friction": {"value": 0.0}}})
    monkeypatch.setattr(training, "labelled", lambda cfg: Inputs(views, views))
    monkeypatch.setattr(training, "train_policy", lambda grasp, inputs, *rest: inputs)
    inputs = training.policy(cfg, [slippery], Tuning(), tmp_path / "out")
    for believed, scenes in ((inputs.views, 2), (inputs.validation, 1)):
        held = believed.batch("success", torch.arange(scenes))
        assert len(believed) == scenes and views.all("success")[:scenes].any() and not held.any()
    fewer = replace(cfg, close_gap=replace(cfg.close_gap, grasps=3))  # whose grasps are not those that are kept
    views_of_fewer = training.policy(fewer, [slippery], Tuning(), tmp_path / "out").views
    assert views_of_fewer.batch("success", torch.arange(len(views_of_fewer))).shape == (1, 3)
    none = replace(cfg, close_gap=replace(cfg.close_gap, grasps=0))
    assert training.policy(none, [slippery], Tuning(), tmp_path / "none") == cfg.close_gap.policy


def test_recovered_is_the_share_of_what_the_truth_wins():
    came = np.zeros((2, 50))
    truth, half = came.copy(), came.copy()
    truth[:, :40], half[:, :20] = 1, 1
    found = recovered({"as_it_came": came, "true_effects": truth, "diagnosed": half}, 0)
    assert found["value"] == pytest.approx(0.5) and found["low"] < 0.5 < found["high"]


def test_a_share_of_what_may_be_nothing_is_not_said():
    robot, report = withheld.Withheld("robot", Path("robot"), None), {"verdict": "explained", "effects": []}

    def of(truth, scenes):
        wins = dict.fromkeys(("as_it_came", "everything"), 6) | {"diagnosed": 12, "true_effects": truth}
        outcomes = {row: np.tile(np.arange(20) < count, scenes // 20) for row, count in wins.items()}
        return list(said(summary([Closed(robot, report, None, {"sources": []}, outcomes, {})], 0)))

    few, many = of(7, 20), of(14, 400)
    assert few[0].endswith("20 a row: as it came 30 %, everything 30 %, diagnosed 60 %, true effects 35 %")
    assert "do not say: the true effects win +5 points (+0 to " in few[1]
    assert "recovers 75 % (" in many[1]


def test_a_robot_on_which_nothing_wins_says_nothing_of_what_to_mend_first():
    def robot(said, **gained):
        outcomes = {row: np.ones(2) for row in ("as_it_came", "everything", "diagnosed", "true_effects")}
        sources = [{"source": n, "gained": each, "gained_ci": [each - 0.1, each + 0.1]} for n, each in gained.items()]
        losses = {"sources": sources}
        believed = {"sources": [{"source": name, "gained": float(name == said)} for name in gained]}
        report = {"verdict": "explained", "effects": [], "task": {"losses": believed}}
        return Closed(withheld.Withheld("robot", Path("robot"), None), report, Machine(), losses, outcomes, {})

    tie = robot("camera", camera=0.0, drives=-0.1)
    chance = robot("camera", camera=0.05, drives=-0.1)
    found = summary([tie, chance, robot("drives", camera=0.0, drives=0.3), robot("camera", camera=0.1, drives=0.3)], 0)
    assert found["named_first"]["value"] == 0.5 and found["named_first"]["robots"] == {"drives": 2}
    assert list(said(found))[-1] == "what to mend first is right on 50 % of the robots: drives 1 of 2"
    assert summary([tie], 0)["named_first"] is None


def test_the_page_begins_with_what_to_mend_first():
    def source(name, lost, gained):
        ci = {"lost_ci": [lost - 0.05, lost + 0.05], "gained_ci": [gained - 0.05, gained + 0.05]}
        return {"source": name, "lost": lost, "gained": gained, **ci}

    losses = {
        "scenes": 100,
        "simulated": 0.9,
        "real": 0.4,
        "lost": 0.5,
        "sources": [source("camera", 0.35, 0.3), source("drives", 0.15, 0.1)],
        "effects": [],
    }
    report = {
        "kind": "robot",
        "effects": [],
        "verdict": "explained",
        "stages": [],
        "described": "",
        "task": {"losses": losses},
    }
    page = html(report)
    assert "Mend the camera first: without its effects the robot holds 30 points (25 to 35) more of its grasps" in page
    assert page.index("data:image/png") < page.index("Which part")
    few = [source("camera", 0.01, 0.01)]
    assert "Nothing to mend" in html({**report, "task": {"losses": {**losses, "sources": few}}})
