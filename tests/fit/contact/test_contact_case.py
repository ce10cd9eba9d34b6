"""Tosses as a case: what is estimated from poses, what a window is worth, and a diagnosis from folder to patch."""

import dataclasses
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.recordings import a_contact
from vision_s2r.contact import CONTACT_EFFECTS, NominalContact, box, pack, simulate, sphere
from vision_s2r.contact.benchmark import toss
from vision_s2r.diagnose.config import DiagnoseConfig, SearchConfig
from vision_s2r.diagnose.diagnose import diagnose, diagnose_all
from vision_s2r.diagnose.replay import ReplayConfig, replay_all
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.contact.case import ContactCase
from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactScales
from vision_s2r.fit.contact.predictor import plain
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.contact.states import states_of
from vision_s2r.fit.contact.stretches import stretches_of
from vision_s2r.fit.contact.windows import make_track, windows_of
from vision_s2r.gapbench.generate.body import COARSE, TossedBody, move
from vision_s2r.recording import ContactRecording, write
from vision_s2r.recording.contact import COLUMNS

NOMINAL = NominalContact(0.37, 0.5, 0.2)
CUBE = box((0.05, 0.05, 0.05))
DT = 1 / 148


def tossed(effects, tosses=10, samples=90, noise=(3e-4, 2e-3), seed=3, first=None):
    """Tosses and pushes of a cube with these effects, their poses measured with noise; and the true states."""
    if first is None:
        first = toss(tosses, seed)
        pushed = tosses // 3
        first[:pushed, 2], first[:pushed, 3:7] = 0.05, (0, 0, 0, 1)
        first[:pushed, 9:12] = 0
    truth = simulate(pack(NOMINAL, effects)[None], CUBE, first, samples, DT, substeps=20)[0]
    return measured(truth, noise, seed), truth


def opened(recording):
    return ContactCase(recording, {effect.name: effect for effect in CONTACT_EFFECTS})


def measured(truth, noise, seed):
    """A recording of the poses of true states [E, T, 13], with noise (m, rad)."""
    rng = np.random.default_rng(seed)
    tosses, samples = truth.shape[:2]
    turn = Rotation.from_rotvec(rng.normal(0, noise[1], (tosses * samples, 3)))
    return ContactRecording(
        nominal=dataclasses.asdict(NOMINAL),
        shape=CUBE,
        sample_time=DT,
        position=truth[..., :3] + rng.normal(0, noise[0], (tosses, samples, 3)),
        attitude=(turn * Rotation.from_quat(truth[..., 3:7].reshape(-1, 4))).as_quat().reshape(tosses, samples, 4),
        velocity=None,
        lengths=np.full(tosses, samples),
        episodes=tuple(range(tosses)),
    )


def test_every_contact_effect_says_what_fitting_needs():
    assert {effect.name for effect in CONTACT_EFFECTS} == set(CONTACT_FITS)
    scales = ContactScales(NOMINAL, CUBE, DT)
    for effect in CONTACT_EFFECTS:
        fit = CONTACT_FITS[effect.name]
        names = [parameter.name for parameter in effect.parameters]
        assert [each.parameter for each in fit.ranges(scales)] == names
        for setting in (*fit.starts(scales), fit.plausible(scales)):
            assert list(effect.check(setting)) == names
        assert fit.not_excited and fit.excited_by and fit.confusable <= set(CONTACT_FITS)


def test_what_would_show_an_effect_is_never_the_nominal_value():
    for value in (0.0, 0.025, 0.1, 0.2, 0.5, 0.95):  # an effect of no size is "not excited", whatever the recording
        scales = ContactScales(NominalContact(0.37, value, value), CUBE, DT)
        for name in ("lateral_friction", "restitution"):
            assert abs(CONTACT_FITS[name].plausible(scales)["value"] - value) > 0.015


def thrown(body):
    """Twelve tosses of a cube, as the benchmark moves it."""
    truth = np.stack([move(body, CUBE.points, 0.0, CUBE.inertia, row, 90, DT, COARSE) for row in toss(12, 3)])
    return measured(truth, (3e-4, 2e-3), 3)


def test_velocities_are_read_off_poses_as_surely_as_they_say():
    recording, truth = tossed({})
    states = states_of(recording)
    assert states.noise == pytest.approx((3e-4, 2e-3), rel=0.25)
    error = (states.state[..., 7:] - truth[..., 7:]).reshape(*truth.shape[:2], 2, 3)
    scaled = error / states.sigma[..., 2:, None]
    assert np.median(np.abs(scaled)) == pytest.approx(0.6745, rel=0.25)
    given = dataclasses.replace(recording, velocity=truth[..., 7:])
    assert states_of(given).measured
    late = dataclasses.replace(recording, velocity=np.roll(truth[..., 7:], 1, axis=1))
    assert not states_of(late).measured


def test_noise_of_the_attitude_does_not_lower_the_support():
    recording, _ = tossed({}, tosses=6, samples=150, noise=(1e-4, 5e-3))
    assert abs(make_track(recording).support) < 5e-5  # the lowest corner is 0.4 mm below, on average


def test_whitened_residuals_of_a_right_machine_are_of_unit_size():
    recording, _ = tossed({})
    track = make_track(recording)
    predictor = plain(track, windows_of(track))
    space = ContactSpace(frozenset(), ContactScales(track.nominal, track.shape, track.sample_time), {})
    index = range(len(predictor.windows.first))
    point = np.empty((1, 0))
    bare = predictor.residuals(space, point, index)
    white = predictor.whitened(space, point[0]).residuals(space, point, index)
    inside = predictor.inside
    assert np.sqrt(np.mean(bare[0, ..., 0][inside] ** 2)) > 2
    assert np.sqrt(np.mean(np.minimum(white[0, ..., 0][inside] ** 2, 16))) == pytest.approx(1, abs=0.1)


def test_a_machine_is_run_once(monkeypatch):
    recording, _ = tossed({}, tosses=4, samples=40)
    track = make_track(recording)
    predictor = plain(track, windows_of(track))
    space = ContactSpace(frozenset({"lateral_friction"}), ContactScales(track.nominal, track.shape, DT), {})
    first = predictor.residuals(space, np.array([[0.3], [0.4]]), [0, 1])
    ran = []
    run = type(predictor).run
    monkeypatch.setattr(type(predictor), "run", lambda self, *given: ran.append(list(given[2])) or run(self, *given))
    again = predictor.residuals(space, np.array([[0.4], [0.3]]), [2, 1, 0])
    assert ran == [[2]] and np.array_equal(again[:, [2, 1]], first[::-1])


def test_where_friction_acts_is_where_the_body_slides():
    first = toss(12, 3)
    first[:, 2], first[:, 3:7], first[:, 9:] = 0.05, (0, 0, 0, 1), 0
    first[6:, 2], first[6:, 9] = 1.0, 2.0  # thrown up, beside those that are pushed
    recording, _ = tossed({"lateral_friction": {"value": 0.25}}, 12, 60, first=first)
    case = opened(recording)
    found = case.fit(frozenset({"lateral_friction"}), range(12), None)
    moved = case.moved(found, "lateral_friction")
    (phase,) = moved.axes
    by_phase = dict(zip(phase.labels, np.bincount(phase.bins, moved.error, len(phase.labels)), strict=True))
    assert by_phase["sliding"] > 0.9 * moved.error.sum() and by_phase["in free flight"] == 0
    assert case.moved(found, "support_tilt") is None


def test_which_corner_of_a_face_hits_first_is_not_known_and_counts_as_that():
    first = np.zeros((16, 13))
    first[:, 2] = 0.1
    first[:, 3:7] = Rotation.from_rotvec(np.random.default_rng(4).normal(0, 0.01, (16, 3))).as_quat()
    recording, _ = tossed({}, tosses=16, samples=36, noise=(1e-4, 5e-3), first=first)
    track = make_track(recording)
    predictor = plain(track, windows_of(track))
    space = ContactSpace(frozenset(), ContactScales(track.nominal, track.shape, track.sample_time), {})
    white = predictor.whitened(space, np.empty(0)).residuals(
        space, np.empty((1, 0)), range(len(predictor.windows.first))
    )
    inside = predictor.inside
    assert np.mean(np.minimum(white[0, ..., 0][inside] ** 2, 16)) < 1.5  # 1.9 where axes are moved one at a time


def test_windows_begin_where_no_impact_hides_the_velocity():
    recording, truth = tossed({}, seed=5)
    windows = windows_of(make_track(recording))
    error = windows.first[:, 7:] - truth[windows.episode, windows.sample, 7:]
    scaled = error / np.repeat(windows.sigma[:, 2:], 3, axis=1)
    assert np.sqrt(np.mean(scaled**2)) < 1.6


def test_poses_that_are_off_at_rest_are_no_noise_and_still_show_friction_and_restitution():
    effects = {"lateral_friction": {"value": 0.2}, "restitution": {"value": 0.1}}
    recording, _ = tossed(effects, tosses=8, samples=130, noise=(2e-5, 2e-4))
    off = Rotation.from_rotvec(np.random.default_rng(0).normal(0, 0.01, (8, 3)))
    turned = [(a * Rotation.from_quat(q)).as_quat() for a, q in zip(off, recording.attitude, strict=True)]
    recording = dataclasses.replace(
        recording,
        attitude=np.stack(turned),
        nominal=recording.nominal | {"lateral_friction": 0.5, "restitution": 0.5},
    )
    assert make_track(recording).bias[1] == pytest.approx(0.01, rel=0.5)
    cfg = DiagnoseConfig(contact=SearchConfig(beam=1, breadth=3, contenders=2, most=2))
    found = {effect.name: effect.parameters["value"].value for effect in diagnose(recording, cfg).effects}
    assert found.keys() == effects.keys()
    assert found["lateral_friction"] == pytest.approx(0.2, rel=0.1)
    assert found["restitution"] == pytest.approx(0.1, abs=0.03)


@pytest.mark.slow
def test_air_drag_that_few_poses_show_is_neither_no_gap_nor_rolling_friction():
    """In the mean nothing is left over the noise; in flight something is, which no effect explains."""
    recording = thrown(TossedBody(mass=0.37, friction=0.5, restitution=0.2, drag=0.16))
    assert opened(recording).excess(Hypothesis(), range(12)).mean() < 1.05
    report = diagnose(recording, DiagnoseConfig())
    assert report.verdict == "unexplained" and not report.effects


@pytest.mark.slow
def test_a_stand_in_asks_for_another_value_in_one_half_of_the_windows():
    """A floor that is slick on one side is no friction of all of it, though that explains what little is left."""
    first = toss(12, 3)
    first[:, 2], first[:, 3:7], first[:, 9:12] = 0.05, (0, 0, 0, 1), 0
    first[:, 0], first[:, 7:9] = np.linspace(-0.9, 0.7, 12), 1.0
    body = TossedBody(mass=0.37, friction=0.5, restitution=0.2, patch=-0.2)
    truth = np.stack([move(body, CUBE.points, 0.0, CUBE.inertia, row, 60, DT, COARSE) for row in first])
    uneven = opened(measured(truth, (3e-4, 2e-3), 3))
    even = opened(tossed({"lateral_friction": {"value": 0.43}}, 12, 60, first=first)[0])
    contradicted = []
    for case in (uneven, even):
        found = case.fit(frozenset({"lateral_friction"}), range(12), None)
        contradicted.append(case.contradicted(found, "lateral_friction"))
    assert contradicted == [True, False]


def slid(body, noise=(3e-4, 2e-3)):
    """Twelve cubes that are pushed along their support in all directions, as the benchmark moves them."""
    first = np.zeros((12, 13))
    way = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    first[:, 2], first[:, 6] = 0.05, 1
    first[:, 7], first[:, 8] = 1.2 * np.cos(way), 1.2 * np.sin(way)
    first[::2, :2] = -0.4 * first[::2, 7:9]
    truth = np.stack([move(body, CUBE.points, 0.0, CUBE.inertia, row, 90, DT, COARSE) for row in first])
    return measured(truth, noise, 3)


@pytest.mark.slow
def test_a_slight_tilt_beside_a_wrong_friction_shows_in_whole_slides():
    tilt = {"roll": 0.003, "pitch": -0.003}
    report = diagnose(slid(TossedBody(mass=0.37, friction=0.3, restitution=0.2, **tilt)), DiagnoseConfig())
    assert report.verdict == "explained" and {each.name for each in report.effects} == {
        "lateral_friction",
        "support_tilt",
    }
    (found,) = (each.parameters for each in report.effects if each.name == "support_tilt")
    for name, angle in tilt.items():
        assert found[name].value == pytest.approx(angle, abs=6e-4)  # 2e-3 in windows of a tenth of a second
        assert found[name].ci[0] < angle < found[name].ci[1]


@pytest.mark.slow
def test_a_friction_that_grows_with_time_is_no_larger_friction():
    report = diagnose(thrown(TossedBody(mass=0.37, friction=0.5, restitution=0.2, fade=0.8)), DiagnoseConfig())
    assert report.verdict == "unexplained" and not report.effects
    assert "a friction that depends on the time since the start of an episode" in report.unexplained.resembles


def test_an_unknown_alone_does_what_its_mean_would_have_a_name_for():
    """Nothing is left for a tilt beside a wind, whose mean it would be; where a tilt is named, that mean is its own."""
    wind = {"wind": 0.3, "wind_angle": 0.0, "wind_place": 0.3, "wind_width": 0.3}
    case = opened(slid(TossedBody(mass=0.37, friction=0.5, restitution=0.2, **wind)))
    alone, both = (
        case.fit(frozenset(n), range(12), None) for n in (["force_of_place"], ["force_of_place", "support_tilt"])
    )
    left, least = (case.excess(each, range(12)).mean() for each in (alone, both))
    assert left < 1.1 and left < least + 0.02
    means = [np.abs(each.extra["force_of_place"][[4, 10]]).max() for each in (alone, both)]
    assert means[0] > 0.03 and means[1] < 0.004


@pytest.mark.slow
def test_a_wind_that_blows_over_a_part_of_the_support_is_no_tilt():
    wind = {"wind": 0.3, "wind_angle": 0.0, "wind_place": 0.3, "wind_width": 0.3}
    case = opened(slid(TossedBody(mass=0.37, friction=0.5, restitution=0.2, **wind)))
    assert case.contradicted(case.fit(frozenset({"support_tilt"}), range(12), None), "support_tilt")
    tilted, _ = tossed({"support_tilt": {"roll": 0.003, "pitch": 0.005}})
    case = opened(tilted)
    assert not case.contradicted(case.fit(frozenset({"support_tilt"}), range(10), None), "support_tilt")


def test_whole_flights_and_slides_of_a_right_machine_leave_noise():
    recording, _ = tossed({}, tosses=24)
    track = make_track(recording)
    stretches = stretches_of(track)
    assert len(stretches.first) > 20 and stretches.count.max() > 0.3 / DT
    predictor = plain(track, windows_of(track), stretches)
    space = ContactSpace(frozenset(), ContactScales(track.nominal, track.shape, track.sample_time), {})
    white = predictor.whitened(space, np.empty(0))
    rows = range(len(predictor.windows.first), len(predictor.episode))
    residuals = white.residuals(space, np.empty((1, 0)), rows)[0, ..., 0][white.inside[rows]]
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(1, abs=0.1)


def test_a_contact_so_soft_that_the_body_sinks_in_is_found():
    spring = {"stiffness": 600.0, "damping": 2.0}
    recording, _ = tossed({"contact_compliance": spring}, 12, 60, noise=(1e-4, 1e-3))
    case = opened(recording)
    found = case.fit(frozenset({"contact_compliance"}), range(12), None)
    assert found.values["contact_compliance"] == pytest.approx(spring, rel=0.05)


@pytest.mark.parametrize(
    "name, value", [("corner_radius", 2e-4), ("spinning_friction", 3e-4), ("rolling_friction", 1e-4)]
)
def test_a_small_effect_is_seen_without_a_whole_fit(name, value):
    recording, _ = tossed({name: {"value": value}}, 12, 60, noise=(5e-5, 5e-4))
    case = opened(recording)
    assert case.screen(Hypothesis({}), [name])[name] > 20


def test_a_fit_that_leaves_much_is_tried_from_farther_away():
    truth = {"corner_radius": {"value": 0.012}, "restitution": {"value": 0.05}}
    recording, _ = tossed(truth, 12, 70)
    case = opened(recording)
    found = case.fit(frozenset(truth), range(12), None).values
    assert found["corner_radius"]["value"] == pytest.approx(0.012, rel=0.02)
    assert found["restitution"]["value"] == pytest.approx(0.05, abs=5e-3)  # 0.041 where a fit ends where it stops


ROUND = {name: {"value": value} for name, value in (("restitution", 0.3), ("lateral_friction", 0.3))}


def of_a_cube_whose_sides_are_off():
    rounded = pack(NOMINAL, ROUND | {"corner_radius": {"value": 0.006}})[None]
    thrown = simulate(rounded, box((0.052, 0.05, 0.048)), toss(12, 5), 90, DT, substeps=20)[0]
    return measured(thrown, (3e-5, 2e-4), 3)


@pytest.mark.parametrize(
    ("names", "recorded", "wider"),
    [
        pytest.param([*ROUND, "corner_radius"], of_a_cube_whose_sides_are_off, True, marks=pytest.mark.slow),
        pytest.param(
            ["lateral_friction"],
            lambda: slid(TossedBody(0.37, 0.3, 0.2, quadratic_drag=0.2)),
            True,
            marks=pytest.mark.slow,
        ),
        ([*ROUND], lambda: tossed(ROUND, 12)[0], False),
    ],
    ids=["sides that are off", "drag", "nothing"],
)
def test_an_interval_beside_something_unknown_holds_what_other_tosses_say(names, recorded, wider):
    """Each fit is sure of its own optimum, which is that of its tosses."""
    case = opened(recorded())
    fit = case.fit(frozenset(names), range(12), None)
    (low, high), (least, most) = (each(fit)[names[0]]["value"] for each in (case.intervals, case.intervals_elsewhere))
    assert least < 0.3 < most
    assert (low < 0.3 < high) != wider
    assert wider or most - least < 1.1 * (high - low)


def test_an_interval_is_open_where_the_motion_bears_any_larger_value():
    """A ball that slides without rolling: any rolling friction over μ·r does the same."""
    ball = sphere(0.05)
    first = np.zeros((12, 13))
    first[:, 2], first[:, 6], first[:, 7] = 0.05, 1, np.linspace(0.5, 1.5, 12)
    truth = simulate(pack(NOMINAL, {"rolling_friction": {"value": 0.04}})[None], ball, first, 60, DT)[0]
    recording = dataclasses.replace(measured(truth, (3e-4, 2e-3), 3), shape=ball)
    case = opened(recording)
    found = case.fit(frozenset({"rolling_friction"}), range(12), None)
    low, high = case.intervals(found)["rolling_friction"]["value"]
    assert 0.02 < low < found.values["rolling_friction"]["value"] < 0.04 < high


def test_a_wrong_friction_is_named_replayed_and_patched(tmp_path):
    recording, _ = tossed({"lateral_friction": {"value": 0.25}})
    folder = str(write(recording, tmp_path / "recording"))
    diagnose_all(DiagnoseConfig(recording=folder, out=str(tmp_path / "report"), jobs=1))
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    assert report["kind"] == "contact" and report["verdict"] == "explained"
    (effect,) = report["effects"]
    value = effect["parameters"]["value"]
    assert effect["name"] == "lateral_friction" and value["value"] == pytest.approx(0.25, rel=0.03)
    assert value["ci"][0] <= 0.25 <= value["ci"][1]
    assert report["gap"]["after"] < 0.5 * report["gap"]["before"]
    assert {place["axis"] for place in report["where"]} <= {"phase", "speed", "part", "spin"}
    patch = tmp_path / "report" / "patch"
    changed = json.loads((patch / "pybullet.json").read_text())["changeDynamics"]
    assert changed == {"lateralFriction": value["value"], "restitution": 0.2}
    assert f'<lateral_friction value="{value["value"]:.9g}"/>' in (patch / "urdf.xml").read_text()
    assert f'friction="{value["value"]:.6g} 0 0"' in (patch / "mujoco.xml").read_text()
    cfg = ReplayConfig(folder, str(tmp_path / "report" / "report.json"), str(tmp_path / "replay"))
    (path,) = replay_all(cfg)
    replayed = json.loads(path.read_text())
    assert replayed["gap"]["after"] < 0.5 * replayed["gap"]["before"]
    header, first = (tmp_path / "replay" / "replay.csv").read_text().splitlines()[:2]
    assert header == (
        "episode,t,window,x_measured,x_before,x_after,y_measured,y_before,y_after,z_measured,z_before,z_after,"
        "angle_before,angle_after"
    )
    row = [float(cell) for cell in first.split(",")]
    assert row[:3] == [0, 0, 0] and row[3] == pytest.approx(row[4], abs=1e-3)


def test_a_short_and_a_ball_s_recording_go_through_a_replay(tmp_path):
    (tmp_path / "report.json").write_text(
        json.dumps({"format": "vision-s2r/report/1", "kind": "contact", "effects": []})
    )
    folder = write(a_contact(samples=13), tmp_path / "short")
    cfg = ReplayConfig(str(folder), str(tmp_path / "report.json"), str(tmp_path / "replay"))
    result = json.loads(replay_all(cfg)[0].read_text())
    assert result["gap"]["before"] == result["gap"]["after"] < 5e-3


def test_the_throws_that_are_asked_for_show_what_was_not_excited():
    known = ("lateral_friction", "restitution", "spinning_friction")
    library = {effect.name: effect for effect in CONTACT_EFFECTS if effect.name in known}
    truth = {"spinning_friction": {"value": 0.006}}
    dropped = np.zeros((6, 13))
    dropped[:, 6], dropped[:, 2] = 1, 0.05 + np.linspace(0.05, 0.2, 6)  # flat, from some height, and never turning
    gentle = ContactCase(tossed(truth, 6, first=dropped)[0], library)
    assert set(gentle.not_excited) == {"spinning_friction"}
    asked = gentle.experiment([Hypothesis()], sorted(gentle.not_excited))
    assert asked.sentence.startswith("Record 4 ") and "would show spinning_friction" in asked.sentence
    first = np.column_stack([asked.commands[name] for name in COLUMNS if name not in ("episode", "t")])
    lowest = CUBE.lowest(first[:, :3], first[:, 3:7])
    assert (lowest >= 0).all() and lowest.max() < 0.25 and np.linalg.norm(first[:, 7:10], axis=1).max() < 3
    told = ContactCase(tossed(truth, len(first), first=first)[0], library)
    assert not told.not_excited
    gains = told.screen(Hypothesis(), sorted(library))
    assert gains["spinning_friction"] > 100 and max(gains, key=lambda name: gains[name]) == "spinning_friction"


def test_a_throw_is_asked_for_where_no_value_is_refitted():
    """Rivals without anything in common have no slopes; a diagnosis without a name ended in an error there."""
    case = opened(a_contact())
    rivals = [Hypothesis(), Hypothesis({"rolling_friction": {"value": 0.01}})]
    asked = case.experiment(rivals, [])
    assert asked.sentence and asked.commands


def test_tosses_that_leave_nothing_open_still_have_others_to_make():
    case = opened(a_contact())
    asked = case.experiment([Hypothesis()], [])
    assert not asked.open and set(COLUMNS) <= asked.commands.keys()
