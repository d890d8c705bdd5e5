"""Method refined when things are in the way, out of view, missing or wrong."""

import numpy as np
import pytest

from ghest_drivers.samples import RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.factory import make_detector
from tests.vision.scenes import (
    MARKER,
    Blob,
    Scene,
    facing_pose,
    moved,
    paper_camera,
    pose_error,
    random_pose,
    render,
    sr300_camera,
)

INFO = paper_camera()
PLACES = np.array([[1, -1], [-1, -1], [1, 1], [-1, 1]]) * MARKER.half_spacing_m
FACING = Scene(facing_pose(0.25, 0.6, 0.1, [0.004, -0.003, 0.18]))


def _detector(info=INFO, **kwargs):
    return make_detector("refined", "r0", "m0", MARKER, info, **kwargs)


def _before(scene, place_m, radius_m, rgb, nearer_m=0.02):
    """A disk-shaped thing between the camera and a point of the plate."""
    point = scene.pose[:3, :3] @ [*place_m, 0.0] + scene.pose[:3, 3]
    return Blob(tuple(point * (1 - nearer_m / point[2])), radius_m, rgb)


def _within(seen, scene, rotation_deg, position_mm):
    assert seen.status in (MarkerStatus.OK, MarkerStatus.COLOR_ONLY)
    found = pose_error(seen.camera_from_marker, scene.pose)
    assert found[0] < rotation_deg
    assert found[1] < position_mm


@pytest.mark.parametrize("disk", range(4))
def test_one_disk_hidden(disk):
    scene = moved(FACING, blobs=(_before(FACING, PLACES[disk], 0.0085, (60.0, 60.0, 65.0)),))
    seen = _detector().detect(render(scene, INFO))
    assert seen.disks_used == 3
    assert seen.depth_used
    _within(seen, scene, 0.05, 0.05)


@pytest.mark.parametrize(
    "rgb", [(70.0, 55.0, 50.0), (225.0, 172.0, 145.0), (238.0, 238.0, 236.0)], ids=["dark", "skin", "white"]
)
def test_a_disk_partly_covered_is_left_out_and_does_not_pull(rgb):
    rng = np.random.default_rng(51)
    for k in range(8):
        angle = rng.uniform(0, 2 * np.pi)
        edge = PLACES[k % 4] + 0.009 * np.array([np.cos(angle), np.sin(angle)])
        scene = Scene(random_pose(rng))
        scene = moved(scene, blobs=(_before(scene, edge, 0.004, rgb),))
        _within(_detector().detect(render(scene, INFO, samples=4)), scene, 0.06, 0.05)


def test_two_disks_hidden_still_give_a_pose_with_depth_and_a_reason_without():
    blobs = tuple(_before(FACING, PLACES[k], 0.0085, (60.0, 60.0, 65.0)) for k in (0, 1))
    scene = moved(FACING, blobs=blobs)
    frame = render(scene, INFO)
    seen = _detector().detect(frame)
    assert seen.disks_used == 2
    _within(seen, scene, 0.1, 0.05)
    seen = _detector(color_only=True).detect(frame)
    assert seen.status is MarkerStatus.TOO_FEW_DISKS
    assert seen.camera_from_marker is None


def test_three_disks_hidden_give_a_reason():
    blobs = tuple(_before(FACING, PLACES[k], 0.0085, (60.0, 60.0, 65.0)) for k in (0, 1, 3))
    seen = _detector().detect(render(moved(FACING, blobs=blobs), INFO))
    assert seen.status is MarkerStatus.TOO_FEW_DISKS
    assert seen.camera_from_marker is None
    assert seen.covariance is None


def test_three_disks_without_depth_only_from_a_known_pose():
    covered = moved(FACING, blobs=(_before(FACING, PLACES[2], 0.0085, (60.0, 60.0, 65.0)),))
    detector = _detector(color_only=True)
    assert detector.detect(render(covered, INFO)).status is MarkerStatus.TOO_FEW_DISKS
    assert detector.detect(render(FACING, INFO, t_ns=10_000_000)).status is MarkerStatus.COLOR_ONLY
    seen = detector.detect(render(covered, INFO, t_ns=25_000_000))
    assert seen.disks_used == 3
    _within(seen, covered, 0.4, 0.2)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_marker_cut_by_the_border(side, axis):
    pose = facing_pose(0.2, 0.6, 0.0, [0.0, 0.0, 0.18])
    pose[axis, 3] = side * (64 / 154.5 * 0.18 - 0.014)
    seen = _detector().detect(render(Scene(pose), INFO))
    assert seen.disks_used == 2
    _within(seen, Scene(pose), 0.1, 0.06)


def test_a_marker_out_of_view_or_without_light_is_not_found():
    away = facing_pose(0.0, 0.0, 0.0, [0.2, 0.0, 0.18])
    detector = _detector()
    for scene in (Scene(away), moved(FACING, gains=(0.0, 0.0, 0.0))):
        seen = detector.detect(render(scene, INFO, samples=1))
        assert seen.status is MarkerStatus.NOT_FOUND
        assert seen.camera_from_marker is None


def test_distractors_of_the_disks_colours():
    rng = np.random.default_rng(52)
    for k in range(8):
        scene = Scene(random_pose(rng), textured=False, background_rgb=(235.0, 235.0, 235.0) if k % 2 else (118.0, 96.0, 84.0))
        blobs = []
        for _ in range(6):
            angle = rng.uniform(0, 2 * np.pi)
            center = scene.pose[:3, 3] + 0.056 * np.array([np.cos(angle), np.sin(angle), 0.2])
            blobs.append(Blob(tuple(center), rng.uniform(0.004, 0.009), MARKER.disk_rgb[rng.integers(4)]))
        scene = moved(scene, blobs=tuple(blobs))
        _within(_detector().detect(render(scene, INFO, samples=4)), scene, 0.06, 0.05)


def test_a_picture_of_the_marker_with_two_colours_exchanged_is_refused():
    swapped = MARKER.model_copy(update={"disk_rgb": tuple(MARKER.disk_rgb[k] for k in (1, 0, 2, 3))})
    seen = _detector().detect(render(moved(FACING, marker=swapped), INFO))
    assert seen.camera_from_marker is None


@pytest.mark.parametrize("depth", ["none", "zero", "noise", "behind"])
def test_unusable_depth_falls_back_to_colour(depth):
    frame = render(FACING, INFO)
    counts = {
        "none": None,
        "zero": np.zeros((128, 128), dtype=np.uint16),
        "noise": np.random.default_rng(1).integers(0, 65535, (128, 128)).astype(np.uint16),
        "behind": np.full((128, 128), 26000, dtype=np.uint16),
    }[depth]
    frame = RgbdFrame(INFO, 0, frame.color_rgb, counts, 0, 0, 0, 0)
    seen = _detector().detect(frame)
    assert seen.status is MarkerStatus.COLOR_ONLY
    assert not seen.depth_used
    _within(seen, FACING, 0.3, 0.15)


def test_half_of_the_depth_missing_is_enough():
    frame = render(FACING, INFO)
    depth = frame.depth_counts.copy()
    depth[:, ::2] = 0
    seen = _detector().detect(RgbdFrame(INFO, 0, frame.color_rgb, depth, 0, 0, 0, 0))
    assert seen.depth_used
    _within(seen, FACING, 0.02, 0.02)


def test_a_depth_scale_that_is_a_little_off_is_admitted_in_the_covariance():
    frame = render(FACING, INFO)
    detector = _detector()
    exact = detector.detect(frame)
    scaled = RgbdFrame(INFO, 1, frame.color_rgb, np.rint(frame.depth_counts * 1.004).astype(np.uint16), 0, 0, 0, 0)
    off = detector.detect(scaled)
    assert off.status is MarkerStatus.OK
    assert np.trace(off.covariance) > 10 * np.trace(exact.covariance)


def test_depth_taken_a_little_later_is_moved_back_to_the_colour_s_time():
    speed = np.array([0.05, -0.03, 0.15])
    info = INFO

    def scene_at(t_s, later_s):
        pose, then = FACING.pose.copy(), FACING.pose.copy()
        pose[:3, 3] += t_s * speed
        then[:3, 3] += (t_s + later_s) * speed
        return Scene(pose, depth_pose=then)

    errors = {}
    for told in (True, False):
        detector = _detector()
        for k in range(6):
            t_ns = k * 15_000_000
            scene = scene_at(t_ns * 1e-9, 0.006)
            frame = render(scene, info, t_ns=t_ns, t_depth_ns=t_ns + 6_000_000 * told, samples=4)
            seen = detector.detect(frame)
        errors[told] = pose_error(seen.camera_from_marker, scene.pose)[1]
    assert errors[True] < 0.03
    assert errors[True] < 0.2 * errors[False]


@pytest.mark.parametrize("method", ["refined", "paper", "aruco"])
def test_images_of_the_wrong_size_or_type_are_refused_by_name(method):
    detector = make_detector(method, "r0", "m0", MARKER, INFO)
    good = render(FACING, INFO, samples=1)

    def frame(color=good.color_rgb, depth=good.depth_counts):
        return RgbdFrame(INFO, 7, color, depth, 0, 0, 0, 0)

    with pytest.raises(BadInputError, match=r"camera r0, frame 7.*colour.*\(64, 128, 3\).*\(128, 128, 3\)"):
        detector.detect(frame(color=good.color_rgb[:64]))
    with pytest.raises(BadInputError, match="float32"):
        detector.detect(frame(color=good.color_rgb.astype(np.float32)))
    with pytest.raises(BadInputError, match=r"depth image is uint16 \(128, 64\)"):
        detector.detect(frame(depth=good.depth_counts[:, :64]))
    with pytest.raises(BadInputError, match="depth image is float64"):
        detector.detect(frame(depth=np.full((128, 128), np.nan)))


def test_noise_images_never_give_a_pose_or_a_crash():
    rng = np.random.default_rng(53)
    for info in (INFO, sr300_camera()):
        detector = _detector(info)
        size = (info.color.height_px, info.color.width_px, 3)
        for _ in range(4):
            color = rng.integers(0, 256, size, dtype=np.uint8)
            depth = rng.integers(0, 4000, (info.depth.height_px, info.depth.width_px)).astype(np.uint16)
            assert detector.detect(RgbdFrame(info, 0, color, depth, 0, 0, 0, 0)).camera_from_marker is None


def test_unknown_methods_and_impossible_wishes_are_refused():
    with pytest.raises(BadInputError, match="paper, refined, aruco"):
        make_detector("magic", "r0", "m0", MARKER, INFO)
    with pytest.raises(BadInputError, match="depth"):
        make_detector("paper", "r0", "m0", MARKER, INFO, color_only=True)


def test_too_far_to_be_resolved():
    far = Scene(facing_pose(0.2, 0.5, 0.0, [0.0, 0.0, 1.2]), background_m=2.0)
    seen = _detector().detect(render(far, INFO))
    assert seen.status in (MarkerStatus.NOT_FOUND, MarkerStatus.TOO_FEW_DISKS, MarkerStatus.OUT_OF_RANGE)
    assert seen.camera_from_marker is None
