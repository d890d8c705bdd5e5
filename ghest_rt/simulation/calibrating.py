"""What a calibration session of the simulated clinic sees besides the markers: `[calibration.reference]` of a station file.

The patient sits in the neutral posture, elbow bent, markers where the calibration has them. What is seen there is not repeated
exactly by a later session; by how much not is drawn from the tolerances of the station file. Nothing of the later session, nor
of what goes wrong with its markers, is used.
"""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.anatomy import Anatomy
from ghest_rt.simulation.coupling import ExoskeletonMotion
from ghest_rt.simulation.posture import Posture
from ghest_rt.simulation.scene import arm_from_elw, build_scene

_BENT_RAD = math.radians(90.0)


@dataclass(frozen=True, slots=True)
class _Held:
    """A patient who holds still in the neutral posture, elbow bent."""

    name: str = "neutral"
    duration_s: float = 0.0

    def at(self, t_s: float) -> Posture:
        """Return the posture."""
        return Posture(np.eye(3), np.zeros(3), (0.0, 0.0), np.eye(3), np.eye(3), (_BENT_RAD, 0.0), (0.0, 0.0))


def with_reference(station: LoadedStation, body: Anatomy, seed: int, session: str) -> LoadedStation:
    """Return the station with `[calibration.reference]` as a calibration session finds it, in its text as well.

    Args:
        station: With the settings made for this patient. One that has a reference stays as it is.
        body: The patient.
        seed: Of what the session to come does not repeat exactly.
        session: Names that session: another one of the same seed repeats other things inexactly. The simulated clinic names it
            by the movement alone, so that the station file tells nothing of what goes wrong.

    Raises:
        BadInputError: The station's URDF cannot be simulated.
        GhestError: The exoskeleton cannot follow the patient into the neutral posture.
    """
    reference = station.config.calibration.reference
    if reference.model_fields_set:
        return station
    elbow, forearm_rad = _neutral(station, body)
    rng = np.random.default_rng((seed, *b"reference", *session.encode()))
    elbow = elbow + reference.elbow_sigma_m * rng.standard_normal(3)
    forearm_offset_deg = reference.forearm_sigma_deg * rng.standard_normal()
    lines = ["[calibration.reference]", f"elbow_in_link_m = {np.round(elbow, 5).tolist()}"]
    if forearm_rad is not None:
        lines.append(f"forearm_twist_deg = {math.degrees(forearm_rad) + forearm_offset_deg:.3f}")
    text = station.toml_text.rstrip("\n") + "\n\n" + "\n".join(lines) + "\n"
    return replace(station, toml_text=text, config=parse_station(text, station.source))


def _neutral(station: LoadedStation, body: Anatomy) -> tuple[Array, float | None]:
    """Return the (3,) elbow in the link of camera r1, and how the forearm stands out of the elbow frame's y-z plane."""
    config = station.config
    scene = build_scene(config, station.urdf_text, station.source, body)
    motion = _Held()
    exoskeleton = ExoskeletonMotion(
        scene,
        motion,
        duration_s=motion.duration_s,
        settings_m=config.exoskeleton.settings_m,
        urdf_text=station.urdf_text,
        source=station.source,
    )
    data = mujoco.MjData(scene.model)
    scene.pose_patient(data, motion.at(0.0))
    data.qpos[[scene.joint_address[name] for name in exoskeleton.names]] = exoskeleton.at(0.0)
    mujoco.mj_kinematics(scene.model, data)
    link = data.body(config.cameras["r1"].link)
    elbow = link.xmat.reshape(3, 3).T @ (data.body("forearm").xpos - link.xpos)
    if config.elbow is None:
        return elbow, None
    e_from_elw = data.body("humerus").xmat.reshape(3, 3) @ arm_from_elw(body.upper_arm_m)[:3, :3]
    e_from_link = data.body(config.elbow.link).xmat.reshape(3, 3)
    x, _, z = e_from_elw.T @ e_from_link @ np.array(config.elbow.axis)
    return elbow, math.atan2(x, z) if z > 0.0 else math.atan2(-x, -z)
