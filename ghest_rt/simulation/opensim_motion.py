"""Recorded shoulder movement of real people (OpenSim, thoracoscapular model of Seth et al. 2019) as motion of the patient.

OpenSim's axes (X forwards, Y up, Z to the right) are E's by a rotation: X = -z, Y = x, Z = -y.

Glenohumeral joint: `R = R_Y(plane_elv) R_-X(shoulder_elv) R_Y(axial_rot)`, scapula to humerus, taken over exactly. OpenSim's
zero is the arm hanging with the elbow bending forwards; ours is the arm stretched forward. A fixed rotation converts the
axes of the humerus: along the shaft (Y) is the arm's z, forwards (X, where the bent forearm points) its y, right (Z) its x.

Thorax, clavicle and scapula: what is recorded against the first row is applied, since the seat puts the patient's resting
posture where the exoskeleton needs it. Clavicle: protraction and elevation move the acromion. Scapula: its attitude on the
thorax is composed of abduction (about the vertical), upward rotation (about the normal of the scapular plane, which is
turned 35 degrees to the side), elevation (tilt about the axis towards the glenoid) and winging (about the medial border, taken
as vertical); the ellipsoid of the model is not reproduced. The elbow is not measured in such files: it is held at 90 degrees.
"""

import math

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array, rot_x, rot_z
from ghest_rt.simulation.opensim_file import MotionTable
from ghest_rt.simulation.posture import Posture

E_FROM_OPENSIM = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
HUMERUS_FROM_ARM = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Columns: the arm's x, y, z axes in OpenSim's humerus axes."""

_X, _Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
_TURN_RAD = math.radians(35.0)
_SCAPULA_NORMAL = np.array([-math.cos(_TURN_RAD), 0.0, math.sin(_TURN_RAD)])
_TO_GLENOID = np.array([math.sin(_TURN_RAD), 0.0, math.cos(_TURN_RAD)])
_PAD_S = 0.3
_REQUIRED = ("plane_elv", "shoulder_elv", "axial_rot")
_ELBOW_RAD = math.radians(90.0)


class OpenSimMotion:
    """A recorded movement, interpolated by rotation splines.

    Args:
        table: The motion file's content.
        name: What to call it.

    Raises:
        BadInputError: The GH joint's columns are missing.
    """

    def __init__(self, table: MotionTable, name: str) -> None:
        missing = [column for column in _REQUIRED if column not in table.columns]
        if missing:
            raise BadInputError(
                f"{table.source}: no column {', '.join(missing)}; the motion must come from a model with the thoracoscapular "
                f"coordinates ({', '.join(_REQUIRED)}, and clavicle, scapula and thorax if recorded)"
            )
        t = table.t_s - table.t_s[0]
        factor = math.pi / 180.0 if table.in_degrees else 1.0
        zero = np.zeros_like(t)

        def angle(column: str) -> Array:
            return np.asarray(factor * table.columns.get(column, zero), dtype=np.float64)

        def metres(column: str) -> Array:
            return np.asarray(table.columns.get(column, zero), dtype=np.float64)

        in_scapula = _about(_Y, angle("plane_elv")) * _about(-_X, angle("shoulder_elv")) * _about(_Y, angle("axial_rot"))
        gh = Rotation.from_matrix(E_FROM_OPENSIM @ in_scapula.as_matrix() @ HUMERUS_FROM_ARM)
        scapula = (
            _about(_Y, angle("scapula_abduction"))
            * _about(_SCAPULA_NORMAL, angle("scapula_upward_rot"))
            * _about(_TO_GLENOID, angle("scapula_elevation"))
            * _about(_Y, angle("scapula_winging"))
        )
        thorax = (
            _about(_X, angle("ground_thorax_rot_x"))
            * _about(_Y, angle("ground_thorax_rot_y"))
            * _about(np.array([0.0, 0.0, 1.0]), angle("ground_thorax_rot_z"))
        )
        shift = np.column_stack([metres(f"ground_thorax_t{axis}") for axis in "xyz"]) @ E_FROM_OPENSIM.T
        clavicle = np.column_stack([angle("clav_prot"), angle("clav_elev")])
        self._name = name
        self._duration_s = float(t[-1])
        self._gh = _rotation_spline(t, gh)
        self._scapula = _rotation_spline(t, _in_e(scapula * scapula[0].inv()))
        self._thorax = _rotation_spline(t, _in_e(thorax * thorax[0].inv()))
        self._rest = _padded_spline(t, np.column_stack((shift - shift[0], clavicle - clavicle[0])))

    @property
    def name(self) -> str:
        """The file's stem."""
        return self._name

    @property
    def duration_s(self) -> float:
        """Time from the first to the last row."""
        return self._duration_s

    def at(self, t_s: float) -> Posture:
        """Return the posture at `t_s` after the first row."""
        x, y, z, protraction, elevation = (float(v) for v in self._rest(t_s))
        clavicle = rot_x(protraction) @ rot_z(elevation)
        return Posture(
            thorax=self._thorax(t_s).as_matrix(),
            thorax_shift_m=np.array([x, y, z]),
            clavicle_rad=(protraction, elevation),
            scapula=clavicle.T @ self._scapula(t_s).as_matrix(),
            gh=self._gh(t_s).as_matrix(),
            elbow_rad=(_ELBOW_RAD, 0.0),
            wrist_rad=(0.0, 0.0),
        )


def _about(axis: Array, angles_rad: Array) -> Rotation:
    return Rotation.from_rotvec(angles_rad[:, None] * axis)


def _in_e(rotation: Rotation) -> Rotation:
    """Express a rotation given in OpenSim's axes in those of E."""
    return Rotation.from_matrix(E_FROM_OPENSIM @ rotation.as_matrix() @ E_FROM_OPENSIM.T)


def _pad_counts(t: Array) -> tuple[int, int]:
    """Return how many rows at the start and at the end are within the padding."""
    head = int(np.searchsorted(t, _PAD_S))
    tail = int(len(t) - 1 - np.searchsorted(t, t[-1] - _PAD_S, side="right") + 1)
    return max(1, min(head, len(t) - 1)), max(1, min(tail, len(t) - 1))


def _padded_times(t: Array, head: int, tail: int) -> Array:
    return np.concatenate((t[0] - (t[1 : head + 1] - t[0])[::-1], t, t[-1] + (t[-1] - t[-1 - tail : -1])[::-1]))


def _padded_spline(t: Array, values: Array) -> CubicSpline:
    """Return a spline that goes on before the first and after the last row as it began and ended (point reflection)."""
    head, tail = _pad_counts(t)
    before = 2 * values[0] - values[1 : head + 1][::-1]
    after = 2 * values[-1] - values[-1 - tail : -1][::-1]
    return CubicSpline(_padded_times(t, head, tail), np.concatenate((before, values, after)))


def _rotation_spline(t: Array, rotations: Rotation) -> RotationSpline:
    """Do the same for rotations: the movement away from the end, reversed."""
    head, tail = _pad_counts(t)
    first, last = rotations[0], rotations[-1]
    before = first * (first.inv() * rotations[1 : head + 1]).inv()
    after = last * (last.inv() * rotations[len(t) - 1 - tail : len(t) - 1]).inv()
    return RotationSpline(_padded_times(t, head, tail), Rotation.concatenate((before[::-1], rotations, after[::-1])))
