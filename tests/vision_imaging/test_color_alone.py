"""Pose from colour alone where the two poses of a plane look most alike: nearly facing the camera."""

import numpy as np
import pytest

from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.factory import make_detector
from tests.vision.scenes import MARKER, Scene, paper_camera, pose_error, random_pose, render, sr300_camera


@pytest.mark.parametrize(
    ("info", "distance_m", "limit_deg"),
    [(paper_camera(), (0.16, 0.20), 0.5), (sr300_camera(), (0.24, 0.28), 0.2)],
    ids=["paper", "sr300"],
)
def test_a_tracked_marker_does_not_flip(info, distance_m, limit_deg) -> None:
    rng = np.random.default_rng(5)
    for _ in range(3):
        pose = random_pose(rng, distance_m, max_tilt_deg=10.0)
        detector = make_detector("photometric", "r0", "m0", MARKER, info, color_only=True)
        for k in range(3):
            pose[:3, :3] = exp_so3(np.array([0.01, 0.006, 0.004])) @ pose[:3, :3]
            scene = Scene(pose, color_noise=4.0)
            seen = detector.detect(render(scene, info, rng, seq=k, t_ns=k * 16_000_000, with_depth=False, samples=4))
            assert seen.status is MarkerStatus.COLOR_ONLY
            assert pose_error(seen.camera_from_marker, pose)[0] < limit_deg
