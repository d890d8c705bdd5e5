"""The MuJoCo model of the clinic: exoskeleton (from its URDF), patient, marker plates, room. World frame = E."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

import mujoco
import numpy as np

from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array, quat_wxyz_from_matrix
from ghest_rt.simulation.anatomy import MIRROR, Anatomy
from ghest_rt.simulation.posture import Posture

Side = Literal["right", "left"]

PLATE_GROUPS = {"m0": 3, "m1": 4}
"""MuJoCo geom groups of the marker plates, so that the camera which shades a plate itself can leave it out of its rays."""

_PLATE_THICKNESS_M = 0.003
_SKIN = (0.80, 0.62, 0.52)
_SHIRT = (0.64, 0.65, 0.62)
_HAIR = (0.22, 0.17, 0.14)
_STALK = (0.25, 0.25, 0.27)
_WHITE = (0.93, 0.93, 0.92)
_URDF_OPTIONS = '<mujoco><compiler fusestatic="false" discardvisual="false" boundmass="0.001" boundinertia="1e-6"/></mujoco>'


@contextmanager
def refusals_told(source: str) -> Iterator[None]:
    """Tell what MuJoCo refuses within, of the URDF or of what is added to it.

    Raises:
        BadInputError: It cannot be simulated.
    """
    try:
        yield
    except ValueError as error:
        told = " ".join(str(error).split())
        raise BadInputError(f"{source}: the exoskeleton's URDF cannot be simulated: {told}; correct that element") from error


def exoskeleton_spec(urdf_text: str, source: str) -> mujoco.MjSpec:
    """Return the exoskeleton as a MuJoCo specification whose world is the URDF's root link.

    Raises:
        BadInputError: MuJoCo cannot read the URDF.
    """
    head, tag, rest = urdf_text.partition("<robot")
    name, end, body = rest.partition(">")
    with refusals_told(source):
        return mujoco.MjSpec.from_string(f"{head}{tag}{name}{end}{_URDF_OPTIONS}{body}")


def arm_from_elw(upper_arm_m: float) -> Array:
    """Return the elbow frame seen from the arm frame (docs/frames.md)."""
    return transform(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), (0.0, 0.0, -upper_arm_m / 2))


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The compiled model and where things are in it.

    Attributes:
        model: The MuJoCo model.
        side: Which arm.
        anatomy: The patient's dimensions.
        links: The exoskeleton's links.
        joint_address: Position of each exoskeleton joint in qpos, by name.
        scapula_from_m0: (4, 4) marker plate on the scapula body (origin: GH centre).
        humerus_from_m1: (4, 4) marker plate on the humerus body (origin: GH centre).
        m0_from_gh: (4, 4) what calibration says, eq. (8).
        mounts: By marker, if plates are movable: the plate's own body and the place of its 7 coordinates in qpos.
    """

    model: mujoco.MjModel
    side: Side
    anatomy: Anatomy
    links: frozenset[str]
    joint_address: dict[str, int]
    scapula_from_m0: Array
    humerus_from_m1: Array
    m0_from_gh: Array
    mounts: dict[str, tuple[int, int]] = field(default_factory=dict)

    def pose_patient(self, data: mujoco.MjData, posture: Posture) -> None:
        """Write a posture (told for the right arm) into `data.qpos`, mirrored for a left arm."""

        def rotation(R: Array) -> Array:
            return quat_wxyz_from_matrix(R if self.side == "right" else MIRROR @ R @ MIRROR)

        sign = 1.0 if self.side == "right" else -1.0
        neutral = self.model.qpos0[self._patient : self._patient + 3]
        q = data.qpos[self._patient :]
        q[0:3] = neutral + posture.thorax_shift_m * (1.0, sign, 1.0)
        q[3:7] = rotation(posture.thorax)
        q[7:9] = posture.clavicle_rad
        q[9:13] = rotation(posture.scapula)
        q[13:17] = rotation(posture.gh)
        q[17:19] = posture.elbow_rad
        q[19:21] = posture.wrist_rad

    def move_plate(self, data: mujoco.MjData, marker: str, nominal_from_marker: Array) -> None:
        """Write the (4, 4) pose of a movable plate, seen from where the calibration has it, into `data.qpos`."""
        _, address = self.mounts[marker]
        data.qpos[address : address + 3] = nominal_from_marker[:3, 3]
        data.qpos[address + 3 : address + 7] = quat_wxyz_from_matrix(nominal_from_marker[:3, :3])

    @property
    def _patient(self) -> int:
        return int(self.model.joint("patient_thorax").qposadr[0])


def build_scene(station: StationConfig, urdf_text: str, source: str, body: Anatomy, *, movable_plates: bool = False) -> Scene:
    """Build the clinic described by a station file, with a patient in it.

    The markers sit exactly where the station's calibration says, or can be moved from there.

    Raises:
        BadInputError: The URDF cannot be simulated.
    """
    side = station.station.arm
    m0_from_gh = np.array(station.calibration.m0_from_gh)
    scapula_from_m0 = inverse(m0_from_gh)
    arm_from_humerus = transform(np.eye(3), (0.0, 0.0, body.upper_arm_m / 2))
    humerus_from_m1 = (
        inverse(arm_from_humerus) @ arm_from_elw(body.upper_arm_m) @ inverse(np.array(station.calibration.m1_from_elw))
    )
    spec = exoskeleton_spec(urdf_text, source)
    exoskeleton_joints = [joint.name for joint in spec.joints]
    links = frozenset(body.name for body in spec.bodies) - {spec.worldbody.name}
    with refusals_told(source):
        add_room(spec)
        builder = _PatientBuilder(spec, body, side)
        builder.add()
        for marker, bone, bone_from_marker in (("m0", "scapula", scapula_from_m0), ("m1", "humerus", humerus_from_m1)):
            builder.add_plate(bone, marker, bone_from_marker, station.markers[marker].plate_m, movable=movable_plates)
        model = spec.compile()
    return Scene(
        model=model,
        side=side,
        anatomy=body,
        links=links,
        joint_address={name: int(model.joint(name).qposadr[0]) for name in exoskeleton_joints},
        scapula_from_m0=scapula_from_m0,
        humerus_from_m1=humerus_from_m1,
        m0_from_gh=m0_from_gh,
        mounts={marker: _mount(model, marker) for marker in PLATE_GROUPS} if movable_plates else {},
    )


def _mount(model: mujoco.MjModel, marker: str) -> tuple[int, int]:
    return int(model.body(f"{marker}_mount").id), int(model.joint(f"{marker}_slide_x").qposadr[0])


def add_room(spec: mujoco.MjSpec) -> None:
    """Add floor and walls, a few metres away."""
    planes = (
        ((-1.2, 0.0, 0.0), (1.0, 0.0, 0.0), (0.48, 0.44, 0.40)),
        ((0.0, 0.0, -2.6), (0.0, 0.0, 1.0), (0.78, 0.77, 0.72)),
        ((0.0, 0.0, 2.2), (0.0, 0.0, -1.0), (0.74, 0.76, 0.76)),
        ((0.0, 2.2, 0.0), (0.0, -1.0, 0.0), (0.76, 0.75, 0.71)),
        ((0.0, -2.2, 0.0), (0.0, 1.0, 0.0), (0.70, 0.73, 0.76)),
    )
    for position, normal, rgb in planes:
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, pos=position, zaxis=normal, size=(0, 0, 1), rgba=(*rgb, 1.0))


def add_plate(body: mujoco.MjsBody, marker: str, body_from_marker: Array, plate_m: float, stalk_end: Array) -> None:
    """Add a marker plate (front face at the marker's origin) and its stalk, which ends at (3,) `stalk_end` of the body."""
    R, p = body_from_marker[:3, :3], body_from_marker[:3, 3]
    half = _PLATE_THICKNESS_M / 2
    body.add_geom(
        name=f"{marker}_plate",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=p - half * R[:, 2],
        quat=quat_wxyz_from_matrix(R),
        size=(plate_m / 2, plate_m / 2, half),
        rgba=(*_WHITE, 1.0),
        group=PLATE_GROUPS[marker],
    )
    start = p - (half * 2 + 0.006) * R[:, 2]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=(*start, *stalk_end), size=(0.006, 0, 0), rgba=(*_STALK, 1.0), group=1
    )


class _PatientBuilder:
    """Adds the patient to a specification: 9 joint axes of the upper limb, scapula and thorax free for recorded motion."""

    def __init__(self, spec: mujoco.MjSpec, body: Anatomy, side: Side) -> None:
        self._spec = spec
        self._body = body
        self._sign = 1.0 if side == "right" else -1.0

    def add(self) -> None:
        """Add thorax, clavicle, scapula, humerus, forearm and hand."""
        b, s = self._body, self._body.scale
        sc = b.gh_in_e_m + b.gh_from_ac_m + b.ac_from_sc_m
        thorax = self._body_at(self._spec.worldbody, "thorax", sc)
        thorax.add_freejoint(name="patient_thorax")
        self._capsule(thorax, (-0.10 * s, 0.06 * s, 0.06 * s), (-0.10 * s, -0.06 * s, 0.06 * s), 0.105 * s, _SHIRT)
        self._capsule(thorax, (-0.35 * s, 0.05 * s, 0.06 * s), (-0.35 * s, -0.05 * s, 0.06 * s), 0.115 * s, _SHIRT)
        self._capsule(thorax, (-0.005 * s, 0.11 * s, 0.05 * s), (-0.005 * s, -0.08 * s, 0.05 * s), 0.045 * s, _SHIRT)
        self._capsule(thorax, (0.0, 0.0, 0.05 * s), (0.12 * s, 0.0, 0.03 * s), 0.055 * s, _SKIN)
        self._capsule(thorax, (0.18 * s, 0.0, 0.02 * s), (0.24 * s, 0.0, 0.02 * s), 0.085 * s, _HAIR)
        self._capsule(thorax, (-0.05 * s, 0.18 * s, 0.05 * s), (-0.33 * s, 0.22 * s, 0.03 * s), 0.045 * s, _SHIRT)
        clavicle = self._body_at(thorax, "clavicle", (0.0, 0.0, 0.0))
        self._hinge(clavicle, "patient_protraction", (1.0, 0.0, 0.0))
        self._hinge(clavicle, "patient_elevation", (0.0, 0.0, 1.0))
        # The scapula body's origin is the GH centre; its joint is the acromioclavicular one.
        scapula = self._body_at(clavicle, "scapula", -b.ac_from_sc_m - b.gh_from_ac_m)
        scapula.add_joint(name="patient_scapula", type=mujoco.mjtJoint.mjJNT_BALL, pos=self._place(b.gh_from_ac_m))
        self._sphere(scapula, (0.0, 0.01 * s, 0.005 * s), 0.056 * s, _SHIRT)
        humerus = self._body_at(scapula, "humerus", (0.0, 0.0, 0.0))
        humerus.add_joint(name="patient_gh", type=mujoco.mjtJoint.mjJNT_BALL)
        length = b.upper_arm_m
        self._capsule(humerus, (0.0, 0.0, -0.02), (0.0, 0.0, -0.55 * length), 0.044 * s, _SHIRT)
        self._capsule(humerus, (0.0, 0.0, -0.55 * length), (0.0, 0.0, -length), 0.037 * s, _SKIN)
        forearm = self._body_at(humerus, "forearm", (0.0, 0.0, -length))
        self._hinge(forearm, "patient_elbow", (1.0, 0.0, 0.0))
        self._hinge(forearm, "patient_pronation", (0.0, 0.0, 1.0))
        self._capsule(forearm, (0.0, 0.0, 0.0), (0.0, 0.0, -b.forearm_m), 0.032 * s, _SKIN)
        hand = self._body_at(forearm, "hand", (0.0, 0.0, -b.forearm_m))
        self._hinge(hand, "patient_wrist_flexion", (1.0, 0.0, 0.0))
        self._hinge(hand, "patient_wrist_deviation", (0.0, 1.0, 0.0))
        self._capsule(hand, (0.0, 0.0, -0.03 * s), (0.0, 0.0, -0.7 * b.hand_m), 0.026 * s, _SKIN)

    def add_plate(self, body_name: str, marker: str, body_from_marker: Array, plate_m: float, *, movable: bool) -> None:
        """Add a marker plate (front face at the marker's origin) and its stalk; movable ones on a body of their own."""
        R, p = body_from_marker[:3, :3], body_from_marker[:3, 3]
        body = self._spec.body(body_name)
        end = self._place(self._body.gh_from_ac_m) if marker == "m0" else p - 0.035 * R[:, 2]
        if movable:
            body = self._add_mount(body, marker, body_from_marker)
            end = R.T @ (end - p)
            R, p = np.eye(3), np.zeros(3)
        add_plate(body, marker, transform(R, p), plate_m, end)

    @staticmethod
    def _add_mount(bone: mujoco.MjsBody, marker: str, bone_from_marker: Array) -> mujoco.MjsBody:
        """Add a body at the marker that slides along and then turns about the marker's nominal axes."""
        mount = bone.add_body(
            name=f"{marker}_mount",
            pos=bone_from_marker[:3, 3],
            quat=quat_wxyz_from_matrix(bone_from_marker[:3, :3]),
            mass=1.0,
            inertia=(1.0, 1.0, 1.0),
            ipos=(0, 0, 0),
        )
        for name, axis in zip("xyz", np.eye(3), strict=True):
            mount.add_joint(name=f"{marker}_slide_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        mount.add_joint(name=f"{marker}_turn", type=mujoco.mjtJoint.mjJNT_BALL)
        return mount

    def _place(self, point_m: tuple[float, float, float] | Array) -> Array:
        return np.asarray(point_m, dtype=np.float64) * (1.0, self._sign, 1.0)

    def _body_at(self, parent: mujoco.MjsBody, name: str, position_m: tuple[float, float, float] | Array) -> mujoco.MjsBody:
        return parent.add_body(name=name, pos=self._place(position_m), mass=1.0, inertia=(1.0, 1.0, 1.0), ipos=(0, 0, 0))

    def _hinge(self, body: mujoco.MjsBody, name: str, axis: tuple[float, float, float]) -> None:
        # An axis of rotation is an axial vector: the mirror turns it round unless it is along y.
        x, y, z = axis
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=(self._sign * x, y, self._sign * z))

    def _capsule(
        self,
        body: mujoco.MjsBody,
        start_m: tuple[float, float, float],
        end_m: tuple[float, float, float],
        radius_m: float,
        rgb: tuple[float, float, float],
    ) -> None:
        ends = (*self._place(start_m), *self._place(end_m))
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=(radius_m, 0, 0), rgba=(*rgb, 1.0), group=1, mass=0)

    def _sphere(
        self, body: mujoco.MjsBody, centre_m: tuple[float, float, float], radius_m: float, rgb: tuple[float, float, float]
    ) -> None:
        centre = self._place(centre_m)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=centre, size=(radius_m, 0, 0), rgba=(*rgb, 1.0), group=1, mass=0)
