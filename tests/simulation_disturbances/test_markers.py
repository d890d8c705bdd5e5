"""Markers that move: where they really are, what the cameras see of it, and what stays as it was."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import angle_between_rad, log_so3, rot_z
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.disturbances import parse_shift, parse_turn
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.world import World


@cache
def world(shift: str = "", turn: str = "", soft_tissue: str = "none", arm: str = "right", movement: str = "COMB") -> World:
    moves = tuple(map(parse_shift, shift.split())) + tuple(map(parse_turn, turn.split()))
    return build_world(
        SimulateOptions(
            out=Path("unused.mcap"),
            movement=movement,
            seed=4,
            duration_s=0.6,
            arm=arm,  # type: ignore[arg-type]
            marker_moves=moves,
            soft_tissue=soft_tissue,  # type: ignore[arg-type]
        )
    )


def truth(of: World, t_s: float = 0.3) -> TruthSample:
    return of.truth_at(of.timeline.start_ns + round(t_s * 1e9))


def moved(marker: str, of: World, arm: str = "right", movement: str = "COMB", t_s: float = 0.3) -> np.ndarray:
    """The marker's pose seen from where it is in the same session without disturbances."""
    name = f"e_from_{marker}"
    return np.asarray(inverse(getattr(truth(world(arm=arm, movement=movement), t_s), name)) @ getattr(truth(of, t_s), name))


@pytest.mark.parametrize("arm", ["right", "left"])
@pytest.mark.parametrize(("axis", "index"), [("x", 0), ("y", 1), ("z", 2)])
def test_m0_shifts_along_the_axes_of_the_gh_frame(axis: str, index: int, arm: str) -> None:
    disturbed = world(f"m0:{axis}:0.02", arm=arm)
    shift_in_e = truth(disturbed).e_from_m0[:3, 3] - truth(world(arm=arm)).e_from_m0[:3, 3]
    plain = truth(world(arm=arm))
    e_from_gh = plain.e_from_arm[:3, :3] @ plain.gh_from_arm.T
    np.testing.assert_allclose(e_from_gh.T @ shift_in_e, 0.02 * np.eye(3)[index], atol=1e-12)
    assert angle_between_rad(moved("m0", disturbed, arm)[:3, :3], np.eye(3)) < 1e-7


@pytest.mark.parametrize(("axis", "column"), [("x", (0.02, 0, 0)), ("y", (0, 0, 0.02)), ("z", (0, -0.02, 0))])
def test_m1_shifts_along_the_axes_of_the_elbow_frame(axis: str, column: tuple[float, float, float]) -> None:
    """The elbow frame's y points along the arm, to GH: the arm frame's z."""
    shift_in_e = truth(world(f"m1:{axis}:0.02")).e_from_m1[:3, 3] - truth(world()).e_from_m1[:3, 3]
    np.testing.assert_allclose(truth(world()).e_from_arm[:3, :3].T @ shift_in_e, column, atol=1e-12)


@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_a_turn_is_about_the_markers_own_centre_and_axis(marker: str) -> None:
    pose = moved(marker, world(turn=f"{marker}:z:5"))
    np.testing.assert_allclose(pose[:3, :3], rot_z(np.radians(5)), atol=1e-12)
    np.testing.assert_allclose(pose[:3, 3], 0.0, atol=1e-12)


@pytest.mark.parametrize("disturbed", [{"shift": "m0:x:0.02 m1:x:0.02", "turn": "m0:z:5"}, {"soft_tissue": "severe"}])
def test_bones_and_exoskeleton_do_not_move_and_the_truth_stays_that_of_the_bones(disturbed: dict[str, str]) -> None:
    plain, other = truth(world()), truth(world(**disturbed))
    for name in ("gh_from_arm", "m0_from_arm", "e_from_arm"):
        np.testing.assert_allclose(getattr(other, name), getattr(plain, name), atol=1e-12)
    assert other.joints_rad == plain.joints_rad
    assert world(**disturbed).station.toml_text == world().station.toml_text


def test_a_drift_that_begins_later_is_not_there_before() -> None:
    drifting = world("m1:z:0.02@0.2")
    way = [float(np.linalg.norm(moved("m1", drifting, t_s=t)[:3, 3])) for t in (0.0, 0.2, 0.45, 0.6)]
    assert way[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert 0.0 < way[2] < way[3] < 0.02


def test_the_cameras_see_the_markers_where_they_really_are() -> None:
    disturbed = world("m0:y:0.015 m1:x:0.02", turn="m1:z:8")
    t_ns = disturbed.timeline.start_ns + 300_000_000
    for camera, marker in (("r0", "m0"), ("r1", "m1")):
        frame, before = disturbed.render(camera, t_ns), world().render(camera, t_ns)
        k, station = frame.info.color, disturbed.station.config
        # Where it ought to be: the pose seen in the undisturbed picture, moved as the truth says.
        a, colors = station.markers[marker].half_spacing_m, station.markers[marker].disk_rgb
        pose = _seen(before.color_rgb, np.array(colors), a, k.matrix) @ moved(marker, disturbed)
        disks = pose @ np.array([(a, -a, 0, 1), (-a, -a, 0, 1), (a, a, 0, 1), (-a, a, 0, 1)], dtype=float).T
        uv = (k.matrix @ disks[:3])[:2] / disks[2]
        for (u, v), nominal in zip(np.rint(uv.T).astype(int), colors, strict=True):
            hue = frame.color_rgb[v, u] / np.linalg.norm(frame.color_rgb[v, u])
            assert hue @ nominal / np.linalg.norm(nominal) > 0.99
        assert frame.depth_counts is not None
        centre = np.rint((k.matrix @ pose[:3, 3])[:2] / pose[2, 3]).astype(int)
        assert frame.depth_counts[centre[1], centre[0]] * 1e-5 == pytest.approx(pose[2, 3], abs=0.002)


def test_a_shift_of_nothing_gives_the_same_pictures() -> None:
    t_ns = world().timeline.start_ns + 300_000_000
    for camera in ("r0", "r1"):
        still, plain = world("m0:x:0").render(camera, t_ns), world().render(camera, t_ns)
        assert np.mean(np.abs(still.color_rgb.astype(int) - plain.color_rgb) > 1) < 1e-3
        assert still.depth_counts is not None
        assert plain.depth_counts is not None
        assert np.mean(np.abs(still.depth_counts.astype(int) - plain.depth_counts) > 1) < 1e-3


def _seen(picture: np.ndarray, colors: np.ndarray, a: float, camera: np.ndarray) -> np.ndarray:
    """The marker's pose from the centroids of the pixels nearest each disk's hue."""
    hue = picture / np.maximum(np.linalg.norm(picture.astype(float), axis=2, keepdims=True), 1.0)
    saturated = picture.max(axis=2).astype(int) - picture.min(axis=2) > 80
    likeness = np.stack([hue @ (c / np.linalg.norm(c)) for c in colors], axis=2)
    nearest = np.where(saturated & (likeness.max(axis=2) > 0.985), likeness.argmax(axis=2), -1)
    uv = np.array([np.argwhere(nearest == i).mean(axis=0)[::-1] for i in range(4)])
    points = np.array([(a, -a, 0), (-a, -a, 0), (a, a, 0), (-a, a, 0)], dtype=float)
    _, rotation, position = cv2.solvePnP(points, uv, camera, None, flags=cv2.SOLVEPNP_ITERATIVE)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(rotation)[0], position[:, 0]
    return pose


def test_the_acromion_marker_slides_and_the_humerus_marker_lags_with_the_posture() -> None:
    soft = world(soft_tissue="published", movement="SIR")
    for t_s in (0.0, 0.3, 0.6):
        gh = truth(soft, t_s).gh_from_arm
        pose = moved("m1", soft, movement="SIR", t_s=t_s)
        twist = 2 * np.arctan2(gh[1, 0] - gh[0, 1], 1 + np.trace(gh))  # swing-twist about z
        turn = log_so3(pose[:3, :3])
        assert np.linalg.norm(turn) == pytest.approx(0.30 * abs(twist), abs=1e-6)
        slide = np.linalg.norm(moved("m0", soft, movement="SIR", t_s=t_s)[:3, 3])
        assert 0.010 < slide < 0.019  # the arm is about level: half of 29 mm


def test_soft_tissue_of_a_left_arm_is_that_of_the_right_in_the_mirror() -> None:
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    for marker in ("m0", "m1"):
        displacement = {}
        for arm in ("right", "left"):
            plain, soft = truth(world(arm=arm)), truth(world(soft_tissue="severe", arm=arm))
            displacement[arm] = getattr(soft, f"e_from_{marker}") @ inverse(getattr(plain, f"e_from_{marker}"))
        assert angle_between_rad(displacement["right"][:3, :3], np.eye(3)) > np.radians(1.0)
        np.testing.assert_allclose(displacement["left"], mirror @ displacement["right"] @ mirror, atol=1e-9)
