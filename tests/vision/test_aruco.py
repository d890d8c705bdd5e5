"""Method aruco: the rival finds its own marker, with our axes."""

import numpy as np
import pytest

from ghest_rt.errors import BadInputError
from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.factory import make_detector
from tests.vision.scenes import MARKER, Scene, pose_error, random_pose, render, sr300_camera


@pytest.mark.parametrize(("marker_name", "code"), [("m0", 0), ("m1", 1)])
def test_the_code_is_found_with_the_marker_s_axes(marker_name, code):
    info = sr300_camera((-0.1, 0.04, 0.001, -0.001, 0.0))
    rng = np.random.default_rng(21)
    detector = make_detector("aruco", "r0", marker_name, MARKER, info)
    for _ in range(3):
        scene = Scene(random_pose(rng, (0.24, 0.28), max_tilt_deg=30), code=code)
        seen = detector.detect(render(scene, info, rng, samples=2, with_depth=False))
        assert seen.status is MarkerStatus.OK
        assert seen.covariance is None
        assert not seen.depth_used
        rotation_deg, position_mm = pose_error(seen.camera_from_marker, scene.pose)
        assert rotation_deg < 4.0
        assert position_mm < 4.0


def test_another_code_is_not_taken_for_ours():
    info = sr300_camera()
    scene = Scene(random_pose(np.random.default_rng(3), (0.24, 0.28)), code=1)
    seen = make_detector("aruco", "r0", "m0", MARKER, info).detect(render(scene, info, samples=1, with_depth=False))
    assert seen.status is MarkerStatus.NOT_FOUND


def test_only_the_two_markers_have_codes():
    with pytest.raises(BadInputError, match="m0, m1"):
        make_detector("aruco", "r0", "m7", MARKER, sr300_camera())
