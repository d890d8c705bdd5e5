"""Forward kinematics, fast: T_link^E as a product of one matrix per moving joint, everything that stands still merged."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3, skew
from ghest_rt.kinematics.chain import Drives, chain
from ghest_rt.kinematics.urdf import Joint, JointKind, parse_urdf


class ForwardKinematics:
    """Poses of links in the base link, from the positions of the measured joints.

    A revolute joint's motion is I + sin(q) K + (1 - cos(q)) K^2 (Rodrigues), a prismatic one's I + q P, so that each moving
    joint with the fixed part before it is a sum of three constant matrices: evaluating a chain is one product with all of them
    and one small matrix product per moving joint.
    """

    def __init__(
        self,
        urdf_text: str,
        source: str,
        *,
        base_link: str,
        links: Sequence[str],
        settings_m: Mapping[str, float],
        measured_joints: Sequence[str],
    ) -> None:
        """Prepare the chains.

        Args:
            urdf_text: The URDF.
            source: Where it came from, for messages.
            base_link: The link in whose frame poses are given (E).
            links: The links whose poses are wanted.
            settings_m: Prismatic joints set per patient, metres.
            measured_joints: The joints in the order of `joint_positions`.

        Raises:
            BadInputError: The URDF is bad, lacks a link or joint, or leaves a joint's position open.
        """
        urdf = parse_urdf(urdf_text, source)
        drives = Drives(urdf, settings_m, measured_joints)
        self._compiled = {
            link: _CompiledChain(chain(urdf, base_link, link), drives, len(measured_joints)) for link in dict.fromkeys(links)
        }
        self._limits = np.array([(urdf.joints[name].lower, urdf.joints[name].upper) for name in measured_joints]).reshape(-1, 2)

    @property
    def limits(self) -> Array:
        """(n, 2) least and greatest position of each measured joint, rad or m; infinite where the URDF states none."""
        return self._limits

    def moves(self, link: str) -> bool:
        """Say whether a link's pose depends on the measured joints at all (that of the base does not)."""
        return self._compiled[link].moves

    def link_pose(self, link: str, joint_positions: Array) -> Array:
        """Return T_link^E.

        Args:
            link: One of the links named at construction.
            joint_positions: (n,) measured positions in the order of `measured_joints`, rad (m for prismatic joints).

        Returns:
            (4, 4) pose of the link in the base link's frame, metres.
        """
        return self._compiled[link].pose(joint_positions)


class _CompiledChain:
    """One chain with everything constant merged; see `ForwardKinematics`."""

    def __init__(self, path: Sequence[Joint], drives: Drives, measured_count: int) -> None:
        constant_parts: list[Array] = []
        first_parts: list[Array] = []
        second_parts: list[Array] = []
        gains: list[Array] = []
        offsets: list[float] = []
        prismatic: list[int] = []
        still = np.eye(4)
        for joint in path:
            still = still @ joint.parent_from_joint
            drive = drives.of(joint)
            if drive.measured is None:
                still = still @ _motion(joint, drive.constant)
                continue
            first, second = _generators(joint)
            if joint.kind is JointKind.PRISMATIC:
                prismatic.append(len(offsets))
            constant_parts.append(still)
            first_parts.append(still @ first)
            second_parts.append(still @ second)
            row = np.zeros(measured_count)
            row[drive.measured] = drive.gain
            gains.append(row)
            offsets.append(drive.constant)
            still = np.eye(4)
        self.moves = bool(offsets)
        self._still = still
        # The posture asked for last: camera and forearm on one link ask for the same.
        self._known = b"", still
        if self.moves:
            # What stands still behind the last moving joint is folded into that joint's matrices.
            for parts in (constant_parts, first_parts, second_parts):
                parts[-1] = parts[-1] @ still
            self._basis = _basis(constant_parts, first_parts, second_parts)
            self._gain = np.array(gains)
            self._offset = np.array(offsets)
            self._prismatic: NDArray[np.intp] | None = np.array(prismatic, dtype=np.intp) if prismatic else None

    def pose(self, joint_positions: Array) -> Array:
        if not self.moves:
            return self._still.copy()
        key = joint_positions.tobytes()
        known_key, known = self._known
        if key == known_key:
            return known.copy()
        q = self._gain.dot(joint_positions)
        q += self._offset
        count = len(q)
        factors = np.empty(2 * count + 1)
        np.sin(q, out=factors[:count])
        np.cos(q, out=factors[count:-1])
        factors[-1] = 1.0
        if self._prismatic is not None:
            factors[self._prismatic] = q[self._prismatic]
        steps = factors.dot(self._basis).reshape(count, 4, 4)
        pose = steps[0]
        for step in steps[1:]:
            pose = pose.dot(step)
        self._known = key, pose
        return np.array(pose)


def _basis(constant: Sequence[Array], first: Sequence[Array], second: Sequence[Array]) -> Array:
    """Return the (2 n + 1, 16 n) matrix that makes all n joints' matrices of (sines, cosines, 1)."""
    count = len(constant)
    basis = np.zeros((2 * count + 1, 16 * count))
    for j, parts in enumerate(zip(constant, first, second, strict=True)):
        here = slice(16 * j, 16 * j + 16)
        still, sine, versine = (part.ravel() for part in parts)
        basis[j, here], basis[count + j, here], basis[-1, here] = sine, -versine, still + versine
    return basis


def _motion(joint: Joint, position: float) -> Array:
    """Return the (4, 4) motion of a joint at a position, rad or m."""
    if joint.kind is JointKind.PRISMATIC:
        return transform(np.eye(3), position * joint.axis)
    return transform(exp_so3(position * joint.axis), np.zeros(3))


def _generators(joint: Joint) -> tuple[Array, Array]:
    """Return the (4, 4) factors of sin(q) and 1 - cos(q); for a prismatic joint those of q and of nothing."""
    first, second = np.zeros((4, 4)), np.zeros((4, 4))
    if joint.kind is JointKind.PRISMATIC:
        first[:3, 3] = joint.axis
    else:
        K = skew(joint.axis)
        first[:3, :3] = K
        second[:3, :3] = K @ K
    return first, second
