"""Method refined against the truth: single frames, random poses, clean and noisy, any light."""

import itertools

import numpy as np
import pytest

from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.factory import make_detector
from tests.vision.scenes import MARKER, Scene, error_vector, paper_camera, pose_error, random_pose, render, sr300_camera

CURVED = (-0.12, 0.05, 0.001, -0.001, 0.0)
NOISE = {"color_noise": 4.0, "depth_noise_m": 0.0005}


def _observe(info, scenes, rng, samples, **kwargs):
    """First sight of every scene by a new detector."""
    for scene in scenes:
        detector = make_detector("refined", "r0", "m0", MARKER, info, **kwargs)
        yield scene, detector.detect(render(scene, info, rng, samples=samples))


def _rms(info, scenes, rng, samples, status=MarkerStatus.OK, **kwargs):
    errors = []
    for scene, seen in _observe(info, scenes, rng, samples, **kwargs):
        assert seen.status is status
        assert seen.disks_used == 4
        errors.append(pose_error(seen.camera_from_marker, scene.pose))
    return np.sqrt(np.mean(np.square(errors), axis=0))


def test_the_paper_s_sensor_without_noise():
    rng = np.random.default_rng(41)
    scenes = [Scene(random_pose(rng)) for _ in range(30)]
    rotation_deg, position_mm = _rms(paper_camera(), scenes, rng, 8)
    assert rotation_deg < 0.01
    assert position_mm < 0.01


def test_the_paper_s_sensor_with_noise():
    rng = np.random.default_rng(42)
    scenes = [Scene(random_pose(rng), **NOISE) for _ in range(40)]
    rotation_deg, position_mm = _rms(paper_camera(), scenes, rng, 4)
    assert rotation_deg < 0.06
    assert position_mm < 0.02


@pytest.mark.parametrize("distortion", [(0.0,) * 5, CURVED], ids=["pinhole", "curved"])
def test_a_sensor_like_the_sr300_with_noise_and_its_own_depth_camera(distortion):
    rng = np.random.default_rng(43)
    scenes = [Scene(random_pose(rng, (0.24, 0.28), lateral_m=0.04), **NOISE) for _ in range(10)]
    rotation_deg, position_mm = _rms(sr300_camera(distortion), scenes, rng, 3)
    assert rotation_deg < 0.05
    assert position_mm < 0.03


def test_colour_alone():
    rng = np.random.default_rng(44)
    scenes = [Scene(random_pose(rng), color_noise=2.0) for _ in range(30)]
    rotation_deg, position_mm = _rms(paper_camera(), scenes, rng, 4, MarkerStatus.COLOR_ONLY, color_only=True)
    assert rotation_deg < 0.2
    assert position_mm < 0.15


@pytest.mark.parametrize("brightness", [0.7, 1.3])
def test_brightness_and_white_balance_do_not_matter(brightness):
    rng = np.random.default_rng(45)
    gains = [tuple(brightness * g for g in balance) for balance in itertools.product((0.7, 1.0, 1.3), repeat=3)]
    scenes = [Scene(random_pose(rng), gains=gain) for gain in gains]
    rotation_deg, position_mm = _rms(paper_camera(), scenes, rng, 4)
    assert rotation_deg < 0.05
    assert position_mm < 0.03


def test_a_bright_side_of_the_plate_does_not_pull_the_disks():
    rng = np.random.default_rng(46)
    scenes = [Scene(random_pose(rng), shading=tuple(rng.uniform(-0.25, 0.25, 2)), gains=(0.75,) * 3) for _ in range(30)]
    rotation_deg, position_mm = _rms(paper_camera(), scenes, rng, 8)
    assert rotation_deg < 0.03
    assert position_mm < 0.02


@pytest.mark.parametrize("color_only", [False, True])
def test_the_covariance_is_that_of_the_error(color_only):
    rng = np.random.default_rng(47)
    scenes = [Scene(random_pose(rng), **NOISE) for _ in range(50)]
    nees = []
    for scene, seen in _observe(paper_camera(), scenes, rng, 6, color_only=color_only):
        np.testing.assert_allclose(seen.covariance, seen.covariance.T, rtol=1e-9)
        error = error_vector(seen.camera_from_marker, scene.pose)
        nees.append(error @ np.linalg.solve(seen.covariance, error))
    assert 3.5 < np.mean(nees) < 9.0
    assert np.mean(np.array(nees) < 12.6) > 0.85  # the 95 % quantile of chi-squared with six degrees of freedom


def test_depth_halves_the_error_at_least():
    rng = np.random.default_rng(48)
    scenes = [Scene(random_pose(rng, max_tilt_deg=15), **NOISE) for _ in range(25)]
    with_depth = _rms(paper_camera(), scenes, np.random.default_rng(1), 3)
    without = _rms(paper_camera(), scenes, np.random.default_rng(1), 3, MarkerStatus.COLOR_ONLY, color_only=True)
    assert with_depth[0] < 0.5 * without[0]
