"""What drives each joint between the base link and another link: an encoder, a setting, another joint, or nothing."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ghest_rt.errors import BadInputError
from ghest_rt.kinematics.urdf import Joint, JointKind, Urdf


@dataclass(frozen=True, slots=True)
class JointDrive:
    """Position of one joint = sum of `gain` * measured position + `constant`.

    Attributes:
        measured: Index of the measured joint that drives it; None if it stands still.
        gain: Factor on that joint's position; the product of the mimic multipliers.
        constant: Added position, rad or m.
    """

    measured: int | None
    gain: float
    constant: float


class Drives:
    """Resolves joints to what drives them, and checks settings and measured joints against the URDF."""

    def __init__(self, urdf: Urdf, settings_m: Mapping[str, float], measured_joints: Sequence[str]) -> None:
        """Check the names.

        Raises:
            BadInputError: A setting or measured joint is unknown, of the wrong type, given twice, or out of its limits.
        """
        self._settings_m = dict(settings_m)
        self._measured = {name: index for index, name in enumerate(measured_joints)}
        if len(self._measured) < len(measured_joints):
            raise BadInputError(
                f"encoders.joints names a joint twice: {', '.join(measured_joints)}; remove one ({urdf.source})"
            )
        for name in measured_joints:
            joint = _known(urdf, name, "encoders.joints")
            if joint.kind not in (JointKind.REVOLUTE, JointKind.CONTINUOUS, JointKind.PRISMATIC):
                raise BadInputError(f"encoders.joints: {joint.where} is {joint.kind}, nothing to measure; remove it")
        for name, value in self._settings_m.items():
            _check_setting(_known(urdf, name, "exoskeleton.settings_m"), value, measured=name in self._measured)
        self._joints = urdf.joints

    def of(self, joint: Joint) -> JointDrive:
        """Return what drives a joint.

        Raises:
            BadInputError: Nothing does, or its type has no single position, or mimic joints follow each other in a circle.
        """
        gain, constant = 1.0, 0.0
        at = joint
        for _ in range(len(self._joints) + 1):
            if at.kind is JointKind.FIXED:
                return JointDrive(None, 0.0, constant)
            if at.kind in (JointKind.FLOATING, JointKind.PLANAR):
                raise BadInputError(f"{at.where}: a {at.kind} joint cannot lie between the base link and a camera; split it")
            if at.name in self._measured:
                return JointDrive(self._measured[at.name], gain, constant)
            if at.name in self._settings_m:
                return JointDrive(None, 0.0, constant + gain * self._settings_m[at.name])
            if at.mimic is None:
                if at.kind is JointKind.PRISMATIC:
                    remedy = f"set its length in exoskeleton.settings_m.{at.name}, or measure it (encoders.joints)"
                else:
                    remedy = "add it to encoders.joints if it is measured, or make it fixed in the URDF"
                raise BadInputError(f"{at.where}: its position is neither measured, set, mimicked nor fixed; {remedy}")
            constant += gain * at.mimic.offset
            gain *= at.mimic.multiplier
            at = self._joints[at.mimic.joint]
        raise BadInputError(f"{joint.where}: the mimic joints follow each other in a circle; break it")


def chain(urdf: Urdf, base_link: str, link: str) -> tuple[Joint, ...]:
    """Return the joints from `base_link` down to `link`.

    Raises:
        BadInputError: A link is unknown, or `link` is not below `base_link`.
    """
    for name in (base_link, link):
        if name not in urdf.links:
            raise BadInputError(f'{urdf.source}: has no link "{name}"; it has {", ".join(urdf.links)}')
    path: list[Joint] = []
    at = link
    while at != base_link:
        if at not in urdf.joint_above:
            raise BadInputError(
                f'{urdf.source}: link "{link}" is not below the base link "{base_link}"; choose another base link'
            )
        path.append(urdf.joint_above[at])
        at = path[-1].parent
    return tuple(reversed(path))


def _known(urdf: Urdf, name: str, key: str) -> Joint:
    if name not in urdf.joints:
        nearest = difflib.get_close_matches(name, urdf.joints, n=1)
        guess = f"; did you mean {nearest[0]}?" if nearest else ""
        raise BadInputError(f'{key}: {urdf.source} has no joint "{name}"; it has {", ".join(urdf.joints)}{guess}')
    return urdf.joints[name]


def _check_setting(joint: Joint, value_m: float, *, measured: bool) -> None:
    key = f"exoskeleton.settings_m.{joint.name}"
    if joint.kind is not JointKind.PRISMATIC:
        raise BadInputError(f"{key}: {joint.where} is {joint.kind}; only prismatic joints are set, remove it")
    if measured:
        raise BadInputError(f"{key}: {joint.where} is also in encoders.joints; remove one")
    if joint.mimic is not None:
        raise BadInputError(f'{key}: {joint.where} mimics "{joint.mimic.joint}"; set that one')
    if not joint.lower <= value_m <= joint.upper:
        raise BadInputError(
            f"{key} = {value_m:g} m is outside the limits {joint.lower:g} to {joint.upper:g} m of {joint.where}; "
            "correct it (metres, not millimetres)"
        )
