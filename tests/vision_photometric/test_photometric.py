"""Method photometric against the truth and beside method refined."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.factory import make_detector
from ghest_rt.vision.photometric.edge_profile import PIXEL_VARIANCE, EdgeProfile
from ghest_rt.vision.solve import Solver
from tests.vision.scenes import (
    MARKER,
    Blob,
    Scene,
    error_vector,
    facing_pose,
    paper_camera,
    pose_error,
    random_pose,
    render,
    sr300_camera,
)

CURVED = (-0.12, 0.05, 0.001, -0.001, 0.0)
NOISE = {"color_noise": 4.0, "depth_noise_m": 0.0005}


def _frames(info, scenes, rng, samples=6):
    return [(scene, render(scene, info, rng, samples=samples)) for scene in scenes]


def _rms(method, info, frames, **kwargs):
    errors = []
    for scene, frame in frames:
        seen = make_detector(method, "r0", "m0", MARKER, info, **kwargs).detect(frame)
        errors.append(pose_error(seen.camera_from_marker, scene.pose))
    return np.sqrt(np.mean(np.square(errors), axis=0))


def test_it_beats_refined_on_the_paper_s_sensor_with_noise():
    rng = np.random.default_rng(61)
    frames = _frames(paper_camera(), [Scene(random_pose(rng), **NOISE) for _ in range(30)], rng)
    refined, photometric = (_rms(method, paper_camera(), frames) for method in ("refined", "photometric"))
    assert photometric[0] < 0.9 * refined[0]
    assert photometric[0] < 0.04
    assert photometric[1] < 0.016


@pytest.mark.parametrize("distortion", [(0.0,) * 5, CURVED], ids=["pinhole", "curved"])
def test_it_beats_refined_on_a_sensor_like_the_sr300(distortion):
    info = sr300_camera(distortion)
    rng = np.random.default_rng(62)
    frames = _frames(info, [Scene(random_pose(rng, (0.24, 0.28), lateral_m=0.04), **NOISE) for _ in range(12)], rng, 6)
    refined, photometric = (_rms(method, info, frames) for method in ("refined", "photometric"))
    assert photometric[0] < 0.85 * refined[0]
    assert photometric[0] < 0.03


@pytest.mark.parametrize("color_only", [False, True])
def test_the_covariance_is_that_of_the_error(color_only):
    rng = np.random.default_rng(63)
    nees = []
    for scene, frame in _frames(paper_camera(), [Scene(random_pose(rng), **NOISE) for _ in range(50)], rng):
        seen = make_detector("photometric", "r0", "m0", MARKER, paper_camera(), color_only=color_only).detect(frame)
        error = error_vector(seen.camera_from_marker, scene.pose)
        nees.append(error @ np.linalg.solve(seen.covariance, error))
    assert 4.0 < np.mean(nees) < 8.5
    assert np.mean(np.array(nees) < 12.6) > 0.85  # the 95 % quantile of chi-squared with six degrees of freedom


@pytest.mark.parametrize("blur_px", [0.4, 0.8])
def test_blur_is_no_worse_than_refined(blur_px):
    rng = np.random.default_rng(64)
    frames = []
    for scene, frame in _frames(paper_camera(), [Scene(random_pose(rng), depth_noise_m=0.0005) for _ in range(20)], rng):
        soft = cv2.GaussianBlur(frame.color_rgb.astype(np.float32), (0, 0), blur_px)
        noisy = np.clip(np.rint(soft + rng.normal(0.0, 2.0, soft.shape)), 0, 255).astype(np.uint8)
        frames.append((scene, replace(frame, color_rgb=noisy)))
    refined, photometric = (_rms(method, paper_camera(), frames) for method in ("refined", "photometric"))
    assert (photometric < 1.05 * refined).all()


def test_colours_that_are_slightly_wrong_and_a_curved_tone_scale_do_no_harm():
    rng = np.random.default_rng(65)
    frames = []
    for scene, frame in _frames(paper_camera(), [Scene(random_pose(rng), **NOISE) for _ in range(20)], rng):
        bent = 255.0 * (frame.color_rgb / 255.0) ** 1.15 * (0.9, 1.0, 0.95)
        frames.append((scene, replace(frame, color_rgb=np.rint(bent).astype(np.uint8))))
    refined, photometric = (_rms(method, paper_camera(), frames) for method in ("refined", "photometric"))
    assert (photometric < 1.05 * refined).all()


def test_a_covered_disk_still_gives_a_pose():
    rng = np.random.default_rng(66)
    pose = random_pose(rng, max_tilt_deg=20.0, lateral_m=0.0)
    disk = (pose @ (MARKER.half_spacing_m, -MARKER.half_spacing_m, 0.0, 1.0))[:3]
    scene = Scene(pose, blobs=(Blob(tuple(0.8 * disk), 0.006, (30.0, 30.0, 30.0)),))
    seen = make_detector("photometric", "r0", "m0", MARKER, paper_camera()).detect(render(scene, paper_camera(), rng))
    assert seen.status is MarkerStatus.OK
    assert seen.disks_used == 3
    assert pose_error(seen.camera_from_marker, pose)[0] < 0.1


def test_the_same_frames_give_the_same_poses_after_a_reset():
    rng = np.random.default_rng(67)
    frames = [frame for _, frame in _frames(paper_camera(), [Scene(random_pose(rng), **NOISE)] * 3, rng)]
    detector = make_detector("photometric", "r0", "m0", MARKER, paper_camera())
    first = [detector.detect(frame).camera_from_marker for frame in frames]
    detector.reset()
    again = [detector.detect(frame).camera_from_marker for frame in frames]
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("blur_px", [0.08, 0.4, 1.12])
@pytest.mark.parametrize("angle_deg", [0.0, 20.0, 45.0])
def test_the_profile_has_the_pixel_s_and_the_blur_s_variance_whatever_the_direction(blur_px, angle_deg):
    distance_px = np.linspace(-3.999, 3.999, 4000)
    half_sine2 = np.full(4000, 0.5 * np.sin(2 * np.deg2rad(angle_deg)))
    covered, slope, _ = EdgeProfile(blur_px)(distance_px, half_sine2)
    density = -slope / -slope.sum()
    assert covered[0] == pytest.approx(1.0, abs=1e-3)
    assert covered[-1] == pytest.approx(0.0, abs=1e-3)
    assert density @ distance_px == pytest.approx(0.0, abs=0.01)
    assert density @ distance_px**2 == pytest.approx(PIXEL_VARIANCE + blur_px**2, rel=0.02)


@pytest.mark.parametrize(("info", "count"), [(paper_camera(), 40), (sr300_camera(), 16)], ids=["paper", "sr300"])
def test_from_a_good_prediction_it_is_no_worse_than_from_the_centres(info, count, monkeypatch):
    rng = np.random.default_rng(68)
    pose, poses, frames = random_pose(rng, (0.2, 0.24), max_tilt_deg=25.0), [], []
    for k in range(count):
        pose = pose.copy()
        pose[:3, :3] = exp_so3(np.array([0.006, -0.004, 0.003])) @ pose[:3, :3]
        pose[:3, 3] += (0.0002, 0.0003, -0.0004)
        poses.append(pose)
        frames.append(render(Scene(pose, **NOISE), info, rng, seq=k, t_ns=k * 16_000_000, samples=4))
    solved = []
    whole = Solver.track
    monkeypatch.setattr(Solver, "track", lambda *arguments: solved.append(1) or whole(*arguments))

    def tracked():
        solved.clear()
        detector = make_detector("photometric", "r0", "m0", MARKER, info)
        seen = [detector.detect(frame).camera_from_marker for frame in frames]
        errors = [pose_error(found, pose) for found, pose in zip(seen, poses, strict=True)]
        return np.sqrt(np.mean(np.square(errors), axis=0)), len(solved)

    straight, how_often = tracked()
    monkeypatch.setattr(Solver, "foretold", lambda *_: False)
    by_centres, always = tracked()
    assert how_often < 0.5 * always
    assert always == count - 1
    assert (straight < 1.1 * by_centres).all()


def test_a_disk_that_is_not_where_it_was_foretold_is_left_to_the_solver(monkeypatch):
    rng = np.random.default_rng(69)
    still = render(Scene(facing_pose(0.3, 0.4, 0.2, [0.0, 0.0, 0.16])), paper_camera(), rng)
    moved = render(Scene(facing_pose(0.3, 0.4, 0.2, [0.001, 0.0, 0.16])), paper_camera(), rng, seq=1, t_ns=16_000_000)
    solved = []
    whole = Solver.track
    monkeypatch.setattr(Solver, "track", lambda *arguments: solved.append(1) or whole(*arguments))
    detector = make_detector("photometric", "r0", "m0", MARKER, paper_camera())
    detector.detect(still)
    seen = detector.detect(moved)
    assert len(solved) == 1
    assert pose_error(seen.camera_from_marker, facing_pose(0.3, 0.4, 0.2, [0.001, 0.0, 0.16]))[1] < 0.02
