"""A left arm is a right arm in the mirror: what is fused of the one is the mirror image of what is fused of the other."""

from dataclasses import replace

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.config.station import StationConfig
from ghest_rt.estimation.arm_chain import ArmChain
from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import MarkerObservation
from tests.estimation_fused.stand import (
    JOINTS,
    LINK_FROM_CAMERA,
    M0_FROM_GH,
    M1_FROM_ELW,
    MS,
    URDF,
    Drift,
    Trial,
    config,
    events,
    run,
    slide,
)

# The mirror of E, cameras, markers and arm: y to the other side. The elbow frame's y axis stays along the arm: z is mirrored.
MIRROR, ELBOW_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0]), np.diag([1.0, 1.0, -1.0, 1.0])
# Slides along y, and turns about axes in the mirror's plane, change their sign.
JOINT_SIGNS = np.array([1.0, -1.0, 1.0, 1.0, -1.0, -1.0])


def mirrored_estimator() -> FusedEstimator:
    right = config().model_dump(mode="json")
    right["station"]["arm"] = "left"
    right["calibration"]["link_from_camera"] = {name: (MIRROR @ T @ MIRROR).tolist() for name, T in LINK_FROM_CAMERA.items()}
    right["calibration"]["m0_from_gh"] = (MIRROR @ M0_FROM_GH @ MIRROR).tolist()
    right["calibration"]["m1_from_elw"] = (MIRROR @ M1_FROM_ELW @ ELBOW_MIRROR).tolist()
    left = StationConfig.model_validate(right)
    return FusedEstimator(ArmChain(left, URDF, "urdf", JOINTS), 100 * MS, dict.fromkeys(("r0", "r1"), round(1e9 / 60.0)))


def mirrored(sample: MarkerObservation | EncoderSample) -> MarkerObservation | EncoderSample:
    if isinstance(sample, EncoderSample):
        return replace(sample, angles_rad=JOINT_SIGNS * sample.angles_rad)
    if sample.camera_from_marker is None or sample.covariance is None:
        return sample
    # A turn is an axial vector: its sign changes where that of a slide does not.
    turned = np.diag([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
    return replace(
        sample, camera_from_marker=MIRROR @ sample.camera_from_marker @ MIRROR, covariance=turned @ sample.covariance @ turned
    )


@pytest.mark.parametrize(
    "drifts", [(), (Drift("m0", slide(1), 1.5),), (Drift("m1", slide(2), 1.5),)], ids=["plain", "m0", "m1"]
)
def test_a_mirrored_session_gives_mirrored_angles(drifts: tuple[Drift, ...]) -> None:
    trial = Trial(duration_s=3.0, drifts=drifts)
    left = mirrored_estimator()
    waiting = events(trial)
    M: Array = MIRROR[:3, :3]
    for j in run(trial):
        while waiting and waiting[0][0] <= j.estimate.t_sample_ns:
            sample = mirrored(waiting.pop(0)[1])
            if isinstance(sample, EncoderSample):
                left.add_encoder(sample)
            else:
                left.add_marker(sample)
        found, right = left.estimate(j.estimate.t_sample_ns), j.estimate
        assert (found.status, found.reason) == (right.status, right.reason)
        assert (found.gh_from_arm is None) == (right.gh_from_arm is None)
        if found.gh_from_arm is not None and right.gh_from_arm is not None:
            assert found.covariance is not None
            assert right.covariance is not None
            assert np.allclose(found.gh_from_arm, M @ right.gh_from_arm @ M, atol=1e-6)
            assert np.allclose(found.covariance, M @ right.covariance @ M, rtol=1e-3, atol=1e-10)
