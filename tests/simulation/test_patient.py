"""The patient and both arms: the neutral posture, the mirror, the exoskeleton's URDF files."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import exp_so3, rot_y
from ghest_rt.simulation.anatomy import MIRROR, Anatomy, anatomy
from ghest_rt.simulation.fitting import fit_station
from ghest_rt.simulation.posture import Posture
from ghest_rt.simulation.scene import Scene, build_scene, exoskeleton_spec

STATIONS = sorted(path.name for path in shipped_config_dir().glob("*.toml"))


def posture(rng: np.random.Generator | None = None) -> Posture:
    def rotation() -> np.ndarray:
        return np.eye(3) if rng is None else exp_so3(rng.uniform(-0.8, 0.8, 3))

    def numbers(n: int) -> np.ndarray:
        return np.zeros(n) if rng is None else rng.uniform(-0.4, 0.4, n)

    a, b, c, d, e, f = numbers(6)
    return Posture(rotation(), 0.1 * numbers(3), (a, b), rotation(), rotation(), (math.pi / 2 + c, d), (e, f))


def station(name: str) -> LoadedStation:
    return load_station(shipped_config_dir() / name)


def scene(name: str, body: Anatomy) -> Scene:
    loaded = fit_station(station(name), body)
    return build_scene(loaded.config, loaded.urdf_text, loaded.source, body)


def poses(model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, np.ndarray]:
    mujoco.mj_kinematics(model, data)
    return {model.body(k).name: np.column_stack((data.xmat[k].reshape(3, 3), data.xpos[k])) for k in range(1, model.nbody)}


@pytest.mark.parametrize("name", ["station-sim.toml", "station-sim-left.toml"])
@pytest.mark.parametrize("height_m", [1.5, 1.75, 2.0])
def test_at_zero_the_arm_is_stretched_forward_and_the_bent_forearm_points_inwards(name: str, height_m: float) -> None:
    body = anatomy(height_m)
    place = scene(name, body)
    data = mujoco.MjData(place.model)
    place.pose_patient(data, posture())
    where = poses(place.model, data)
    inwards = 1.0 if place.side == "right" else -1.0
    gh = where["humerus"][:, 3]
    np.testing.assert_allclose(gh, body.gh_in_e_m * (1.0, inwards, 1.0), atol=1e-12)
    np.testing.assert_allclose(where["forearm"][:, 3] - gh, (0, 0, -0.186 * height_m), atol=1e-12)
    np.testing.assert_allclose(where["hand"][:, 3] - where["forearm"][:, 3], (0, inwards * 0.146 * height_m, 0), atol=1e-12)
    for link in ("scapula", "humerus"):
        np.testing.assert_allclose(where[link][:, :3], np.eye(3), atol=1e-12)


def test_a_left_patient_is_a_right_one_in_the_mirror() -> None:
    rng = np.random.default_rng(5)
    body = anatomy(1.7)
    right, left = scene("station-sim.toml", body), scene("station-sim-left.toml", body)
    data_r, data_l = mujoco.MjData(right.model), mujoco.MjData(left.model)
    for _ in range(20):
        same = posture(rng)
        right.pose_patient(data_r, same)
        left.pose_patient(data_l, same)
        data_l.qpos[: len(left.joint_address)] = data_r.qpos[: len(right.joint_address)] = rng.uniform(
            -0.5, 0.5, len(right.joint_address)
        )
        where_r, where_l = poses(right.model, data_r), poses(left.model, data_l)
        assert where_r.keys() == where_l.keys()
        for link, pose in where_r.items():
            np.testing.assert_allclose(where_l[link][:, :3], MIRROR @ pose[:, :3] @ MIRROR, atol=1e-9, err_msg=link)
            np.testing.assert_allclose(where_l[link][:, 3], MIRROR @ pose[:, 3], atol=1e-9, err_msg=link)


def test_coupler_stays_level_and_reaches_80_mm_up_at_the_end_of_225_mm_and_the_extension() -> None:
    loaded = station("station-sim.toml")
    model = exoskeleton_spec(loaded.urdf_text, loaded.source).compile()
    data = mujoco.MjData(model)
    for angle in (-0.9, 0.0, 0.7):
        for joint, value in {"j2": angle, "j3": -angle, "j3_length": 0.1}.items():
            data.qpos[model.joint(joint).qposadr[0]] = value
        where = poses(model, data)
        np.testing.assert_allclose(where["l4"][:, :3], np.eye(3), atol=1e-12)
        np.testing.assert_allclose(where["l4"][:, 3] - where["l3"][:, 3], rot_y(angle) @ (0, 0, -0.325), atol=1e-12)
        np.testing.assert_allclose(where["l5"][:, 3] - where["l4"][:, 3], (0.08, 0, 0), atol=1e-12)
    assert model.neq == 1  # the mimic of j3


@pytest.mark.parametrize("name", STATIONS)
def test_every_shipped_station_file_loads_and_has_the_settings_of_a_patient_of_1_75_m(name: str) -> None:
    loaded = station(name)
    assert loaded.config.exoskeleton.settings_m == anatomy(1.75).exoskeleton_settings_m()
    assert fit_station(loaded, anatomy(1.75)).config == loaded.config
    taller = fit_station(loaded, anatomy(1.9)).config.exoskeleton.settings_m
    assert taller["j3_length"] == pytest.approx(0.175)  # 28 mm of upper arm more, to the nearest mark
    assert taller["j7"] == pytest.approx(0.01)


@pytest.mark.parametrize("height_m", [1.39, 2.11, math.nan])
def test_a_patient_who_does_not_fit_is_refused(height_m: float) -> None:
    with pytest.raises(BadInputError, match=r"give a height from 1.4 to 2.1 m"):
        anatomy(height_m)


def test_a_station_file_without_settings_is_refused_with_the_remedy(tmp_path: Path) -> None:
    loaded = station("station-sim.toml")
    (tmp_path / "armeo_spring.urdf").write_text(loaded.urdf_text)
    (tmp_path / "mine.toml").write_text("\n".join(line for line in loaded.toml_text.splitlines() if "settings_m =" not in line))
    with pytest.raises(BadInputError, match=r"mine.toml: exoskeleton.settings_m must be set once, on one line"):
        fit_station(load_station(tmp_path / "mine.toml"), anatomy(1.75))


def test_a_urdf_that_cannot_be_simulated_is_named() -> None:
    with pytest.raises(BadInputError, match=r"broken.urdf: the exoskeleton's URDF cannot be simulated"):
        exoskeleton_spec('<robot name="x"><link name="a"/><joint name="j" type="fixed"/></robot>', "broken.urdf")
