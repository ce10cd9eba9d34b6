"""A scene state is data, and everything drawn from it is a pure function of it."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from vision_s2r.errors import UserError
from vision_s2r.scene import (
    CLASSES,
    Renderer,
    SceneConfig,
    SceneState,
    arm,
    attempt,
    canonical,
    objects,
    proposals,
    propose,
    randomized,
    real,
    sample_state,
    textures,
)
from vision_s2r.scene.appearance import CANONICAL_LIGHT, Light
from vision_s2r.scene.config import AppearanceConfig, check

CFG = SceneConfig()


@pytest.fixture(scope="module")
def states():
    return [sample_state(CFG, 3, index) for index in range(6)]


@pytest.fixture(scope="module")
def renderer():
    with Renderer(CFG) as opened:
        yield opened


def test_a_state_depends_on_seed_and_index_alone(states):
    assert sample_state(CFG, 3, 4) == states[4]
    assert len({state.object_ids for state in states}) == len(states)
    assert all(3 <= len(state.object_ids) <= 6 for state in states)


def test_a_state_survives_the_disk_bit_for_bit(states, tmp_path):
    states[0].save(tmp_path / "state.json")
    assert SceneState.load(tmp_path / "state.json") == states[0]


def test_a_foreign_state_is_one_clear_line(tmp_path):
    path = tmp_path / "state.json"
    path.write_text('{"format": "other"}')
    with pytest.raises(UserError, match="scene-state"):
        SceneState.load(path)
    with pytest.raises(UserError, match=r"missing\.json"):
        SceneState.load(tmp_path / "missing.json")


def test_training_never_sees_a_test_object():
    train, test = set(objects.object_ids("train")), set(objects.object_ids("test"))
    assert train and test and not train & test
    assert max(train) < 900 <= min(test)
    with pytest.raises(UserError, match="did you mean 'train'"):
        objects.object_ids("trian")


def test_no_objects_installed_is_one_clear_line(monkeypatch, tmp_path):
    monkeypatch.setattr(objects, "folder", lambda: tmp_path)
    objects.object_ids.cache_clear()
    try:
        with pytest.raises(UserError, match="empty"):
            objects.object_ids("test")
    finally:
        objects.object_ids.cache_clear()


def test_pictures_do_not_depend_on_what_was_rendered_before(states, renderer):
    looks = [randomized(CFG, states[0]), real(CFG, states[1]), canonical(states[2])]
    first = [renderer.render(s, k, 32, 4).rgb for s, k in zip(states, looks, strict=False)]
    with Renderer(CFG) as fresh:
        for state, look, picture in reversed(list(zip(states, looks, first, strict=False))):
            assert np.array_equal(fresh.render(state, look, 32, 4).rgb, picture)


def test_the_margin_adds_to_the_same_picture(states, renderer):
    look = randomized(CFG, states[0])
    wide = renderer.render(states[0], look, 64, 8).rgb[8:-8, 8:-8].astype(int)
    assert np.abs(wide - renderer.render(states[0], look, 64).rgb).mean() < 1


def test_labels_agree_with_the_canonical_picture(states, renderer):
    view = renderer.render(states[0], canonical(states[0]), 64, labels=True)
    assert set(np.unique(view.segmentation)) >= {CLASSES.index(c) for c in ("background", "bin", "object")}
    assert ((view.instance > 0) == (view.segmentation == CLASSES.index("object"))).all()
    red, green, blue = view.rgb.astype(float).transpose(2, 0, 1)
    greenish = (green > 1.5 * red) & (green > 1.5 * blue)
    assert np.array_equal(greenish, view.instance > 0)


def test_depth_and_calibration_put_objects_where_they_lie(states, renderer):
    state = states[1]
    view = renderer.render(state, canonical(state), 128, labels=True)
    fx, fy, cx, cy = state.camera.intrinsics(128)
    v, u = np.nonzero(view.instance)
    depth = view.depth[v, u]
    rays = np.stack([(u - cx) / fx * depth, (v - cy) / fy * depth, depth, np.ones_like(depth)])
    world = np.linalg.inv(state.camera.extrinsics()) @ rays
    for k, cloud in enumerate(proposals.surface_points(CFG, state)):
        seen = world[:3, view.instance[v, u] == k + 1].T
        if len(seen):
            distance = np.linalg.norm(seen[:, None] - cloud[None], axis=2).min(axis=1)
            assert np.median(distance) < 0.006


def test_shadows_fall(states, renderer):
    light = Light((0.6, 0.2, 0.8), (1, 1, 1), 0.4, 0.6, 0.0, shadow=False)
    look = canonical(states[0])
    pictures = []
    for shadow in (False, True):
        lit = Light(**{**light.__dict__, "shadow": shadow})
        pictures.append(renderer.render(states[0], type(look)(look.bank, look.parts, look.objects, lit), 64).rgb)
    darker = (pictures[1].astype(int) < pictures[0].astype(int) - 10).any(axis=2).mean()
    assert 0.02 < darker < 0.6
    assert not CANONICAL_LIGHT.shadow


def test_the_real_look_stays_out_of_training(states, renderer):
    assert all(real(CFG, state).light.shadow and real(CFG, state).bank == "real" for state in states)
    assert all(randomized(CFG, state).bank == "randomized" for state in states)
    drawn, tested = ({path.stem.partition("-")[2] for path in renderer.banks[bank]} for bank in ("randomized", "real"))
    assert drawn == set(textures.RANDOMIZED) and tested == set(textures.REAL)
    kinds = [textures.RANDOMIZED, textures.HELD_OUT, textures.REAL]
    assert sum(map(len, kinds)) == len({family for kind in kinds for family in kind.values()})
    for name in textures.REAL:
        with pytest.raises(UserError, match=rf"no family '{name}' for training"):
            check(SceneConfig(appearance=AppearanceConfig(families=["flat", name])))


def test_families_held_out_make_a_look_of_their_own():
    with Renderer(SceneConfig(appearance=AppearanceConfig(families=["bricks", "plaid"], textures=8))) as renderer:
        assert {path.stem.partition("-")[2] for path in renderer.banks["randomized"]} == {"bricks", "plaid"}


def test_some_objects_are_made_of_what_the_floor_is_made_of(states):
    looks = [randomized(CFG, state, view) for state in states for view in range(20)]
    alike = [surface == look.parts["bin_floor"] for look in looks for surface in look.objects]
    assert 0.08 < np.mean(alike) < 0.25
    assert not any(surface == real(CFG, s).parts["bin_floor"] for s in states for surface in real(CFG, s).objects)


def test_the_arm_reaches_where_its_joints_say():
    for x, y, z, yaw in [(0.1, -0.1, 0.05, 0.7), (-0.12, 0.12, 0.1, -1.2)]:
        assert arm.tool(arm.inverse(x, y, z, yaw)) == pytest.approx((x, y, z, yaw))


def test_grasps_are_decided_by_physics(states):
    scripted, random = [], []
    for state in states:
        grasps, origins = propose(CFG, state, 6)
        outcomes = [attempt(CFG, state, grasp) for grasp in grasps]
        assert outcomes[0] == attempt(CFG, state, grasps[0])  # pure
        scripted += [o.success for o, k in zip(outcomes, origins, strict=True) if k == proposals.Origin.SCRIPTED]
        random += [o.success for o, k in zip(outcomes, origins, strict=True) if k == proposals.Origin.RANDOM]
    assert np.mean(scripted) > 0.5 > np.mean(random)
    empty = max(
        ((x, y) for x in (-0.1, 0.1) for y in (-0.1, 0.1)),
        key=lambda c: min(np.hypot(p[0] - c[0], p[1] - c[1]) for p in states[0].object_poses),
    )
    assert not attempt(CFG, states[0], np.array([*empty, 0.0])).success


def test_gymnasium_accepts_the_environment(states):
    env = gymnasium.make("vision_s2r.scene.env:vision_s2r/BinGrasp-v0", size=32)
    check_env(env.unwrapped, skip_render_check=True)
    _, info = env.reset(seed=5)
    assert info["state"] == env.reset(seed=5)[1]["state"]
    state = SceneState.from_dict(info["state"])
    grasps, _ = propose(CFG, state, 6)
    rewards = [env.unwrapped.step(g.astype(np.float32))[1] for g in grasps]
    assert rewards == [float(attempt(CFG, state, g.astype(np.float32).astype(float)).success) for g in grasps]
    env.close()
