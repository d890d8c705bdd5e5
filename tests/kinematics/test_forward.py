"""Forward kinematics agrees with a second engine, and equations (6) and (7) put cameras and markers where they are."""

import re
from pathlib import Path

import numpy as np
import pytest

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3, rot_y
from ghest_rt.kinematics.forward import ForwardKinematics
from ghest_rt.kinematics.paper_chain import eq6_e_from_camera, eq7_e_from_marker
from ghest_rt.kinematics.urdf import JointKind, parse_urdf

HERE = Path(__file__).parent
CONFIG = HERE.parents[1] / "config"
POSTURES = 1000


def second_engine(urdf_text: str, postures: list[dict[str, float]], links: list[str]) -> np.ndarray:
    """Return (postures, links, 4, 4) link poses by MuJoCo, given the position of every joint by name."""
    mujoco = pytest.importorskip("mujoco", reason="the second engine needs the extra [sim]")
    compiler = (
        '<mujoco><compiler fusestatic="false" discardvisual="false" boundmass="0.001" boundinertia="1e-6" '
        'balanceinertia="true" angle="radian"/></mujoco>'
    )
    urdf_text = re.sub(r"<visual>.*?</visual>|<collision>.*?</collision>", "", urdf_text, flags=re.DOTALL)
    model = mujoco.MjModel.from_xml_string(re.sub(r"(<robot[^>]*>)", rf"\1{compiler}", urdf_text, count=1))
    data = mujoco.MjData(model)
    poses = np.zeros((len(postures), len(links), 4, 4))
    bodies = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, link) for link in links]
    joints = {
        name: model.jnt_qposadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)]
        for name in (postures[0] if postures else {})
    }
    for k, posture in enumerate(postures):
        for name, position in posture.items():
            data.qpos[joints[name]] = position
        mujoco.mj_kinematics(model, data)
        for n, body in enumerate(bodies):
            poses[k, n] = transform(data.xmat[body].reshape(3, 3), data.xpos[body])
    return poses


def test_nine_joint_chain_agrees_with_mujoco() -> None:
    text = (HERE / "nine_joints.urdf").read_text()
    measured = ["j8", "j0", "slide", "j1", "j4"]
    links = ["plate", "e", "branch", "b"]
    length = 0.137
    fk = ForwardKinematics(
        text, "nine_joints.urdf", base_link="base", links=links, settings_m={"length": length}, measured_joints=measured
    )
    rng = np.random.default_rng(11)
    q = rng.uniform(-2.0, 2.0, size=(POSTURES, 5))
    q[:, 2] = rng.uniform(-0.3, 0.3, size=POSTURES)
    postures = []
    for row in q:
        named = dict(zip(measured, (float(v) for v in row), strict=True))
        named |= {"length": length, "aside": 2 * length + 0.01, "j3": 0.1 - named["j1"]}
        postures.append(named | {"j7": 0.5 * named["j3"]})
    theirs = second_engine(text, postures, links)
    for n, link in enumerate(links):
        ours = np.array([fk.link_pose(link, row) for row in q])
        np.testing.assert_allclose(ours, theirs[:, n], atol=1e-9)
    assert np.ptp(theirs[:, 0, 0, 3]) > 0.3


@pytest.mark.parametrize("name", ["armeo_spring.urdf", "armeo_spring_left.urdf"])
def test_the_shipped_exoskeleton_agrees_with_mujoco(name: str) -> None:
    text = (CONFIG / name).read_text()
    urdf = parse_urdf(text, name)
    measured = [
        j.name for j in urdf.joints.values() if j.kind in (JointKind.REVOLUTE, JointKind.CONTINUOUS) and j.mimic is None
    ]
    rng = np.random.default_rng(12)
    settings = {
        j.name: float(rng.uniform(j.lower, j.upper))
        for j in urdf.joints.values()
        if j.kind is JointKind.PRISMATIC and j.mimic is None
    }
    links = [link for link in urdf.links if link != urdf.root]
    fk = ForwardKinematics(text, name, base_link=urdf.root, links=links, settings_m=settings, measured_joints=measured)
    q = rng.uniform(-1.5, 1.5, size=(POSTURES, len(measured)))
    postures = []
    for row in q:
        named = settings | dict(zip(measured, (float(v) for v in row), strict=True))
        for joint in urdf.joints.values():
            if joint.mimic is not None:
                named[joint.name] = joint.mimic.multiplier * named[joint.mimic.joint] + joint.mimic.offset
        postures.append(named)
    theirs = second_engine(text, postures, links)
    for n, link in enumerate(links):
        ours = np.array([fk.link_pose(link, row) for row in q])
        np.testing.assert_allclose(ours, theirs[:, n], atol=1e-9)


def test_the_base_link_stands_still_and_says_so() -> None:
    text = (HERE / "nine_joints.urdf").read_text()
    fk = ForwardKinematics(
        text, "nine_joints.urdf", base_link="base", links=["base", "a"], settings_m={}, measured_joints=["j0"]
    )
    assert not fk.moves("base")
    assert fk.moves("a")
    np.testing.assert_array_equal(fk.link_pose("base", np.array([0.4])), np.eye(4))


def test_a_returned_pose_may_be_written_to() -> None:
    text = (HERE / "nine_joints.urdf").read_text()
    fk = ForwardKinematics(
        text, "nine_joints.urdf", base_link="base", links=["base", "a"], settings_m={}, measured_joints=["j0"]
    )
    for link in ("base", "a"):
        before = fk.link_pose(link, np.array([0.2]))
        fk.link_pose(link, np.array([0.2]))[:] = 7.0
        np.testing.assert_array_equal(fk.link_pose(link, np.array([0.2])), before)


def test_positions_that_have_been_written_to_are_another_posture() -> None:
    text = (HERE / "nine_joints.urdf").read_text()
    fk = ForwardKinematics(text, "nine_joints.urdf", base_link="base", links=["a"], settings_m={}, measured_joints=["j0"])
    position = np.array([0.2])
    before = fk.link_pose("a", position)
    position[0] = 0.7
    there = fk.link_pose("a", position)
    assert np.abs(there - before).max() > 0.1
    np.testing.assert_array_equal(fk.link_pose("a", np.array([0.7])), there)
    np.testing.assert_array_equal(fk.link_pose("a", np.array([0.2])), before)


def test_limits_are_those_of_the_urdf_in_the_order_measured() -> None:
    text = (HERE / "nine_joints.urdf").read_text()
    fk = ForwardKinematics(text, "nine_joints.urdf", base_link="base", links=["b"], settings_m={}, measured_joints=["j1", "j0"])
    np.testing.assert_array_equal(fk.limits, [[-2.0, 2.0], [-np.inf, np.inf]])


def test_equations_6_and_7_compose_link_camera_and_marker() -> None:
    e_from_l8 = transform(rot_y(0.5), [0.3, 0.2, 0.1])
    l8_from_r1 = transform(exp_so3(np.array([0.1, -0.2, 2.0])), [0.0, 0.1, 0.02])
    r1_from_m1 = transform(exp_so3(np.array([3.0, 0.1, 0.0])), [0.01, -0.02, 0.17])
    point_in_m1 = np.array([0.018, -0.018, 0.0, 1.0])
    e_from_m1 = eq7_e_from_marker(eq6_e_from_camera(e_from_l8, l8_from_r1), r1_from_m1)
    step_by_step = e_from_l8 @ (l8_from_r1 @ (r1_from_m1 @ point_in_m1))
    np.testing.assert_allclose(e_from_m1 @ point_in_m1, step_by_step, atol=1e-15)
