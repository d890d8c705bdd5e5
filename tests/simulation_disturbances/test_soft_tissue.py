"""Soft tissue as a function of the posture."""

import numpy as np
import pytest

from ghest_rt.geometry.so3 import Array, log_so3, rot_x, rot_y, rot_z
from ghest_rt.simulation.posture import Posture
from ghest_rt.simulation.soft_tissue import SOFT_TISSUES, axial_rotation_rad, elevation_rad

PLACE_M = np.array([0.05, 0.01, 0.08])


def posture(gh: Array, clavicle: tuple[float, float] = (0.0, 0.0)) -> Posture:
    return Posture(np.eye(3), np.zeros(3), clavicle, np.eye(3), gh, (0.0, 0.0), (0.0, 0.0))


@pytest.mark.parametrize("degrees", [0, 30, 90, 150, 180])
def test_elevation_counts_from_the_hanging_arm_in_every_plane(degrees: int) -> None:
    forwards = rot_y(np.radians(90 - degrees))  # level forwards is neutral
    assert np.degrees(elevation_rad(posture(forwards))) == pytest.approx(degrees, abs=1e-5)
    assert np.degrees(elevation_rad(posture(rot_x(-0.7) @ forwards))) == pytest.approx(degrees, abs=1e-5)


def test_raising_the_shoulder_girdle_with_the_arm_counts_as_elevation() -> None:
    aside = rot_x(np.radians(-90))
    raised = abs(elevation_rad(posture(aside, (0.0, 0.2))) - elevation_rad(posture(aside)))
    assert raised == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize(("name", "most_m"), [("published", 0.029), ("severe", 0.0435)])
def test_the_acromion_marker_slides_more_the_higher_the_arm(name: str, most_m: float) -> None:
    soft = SOFT_TISSUES[name]
    slides = []
    for degrees in range(0, 181, 15):
        shift = soft.scapula_from_skin(posture(rot_y(np.radians(90 - degrees))), PLACE_M) @ (*PLACE_M, 1.0) - (*PLACE_M, 1.0)
        slides.append(float(np.linalg.norm(shift)))
    assert slides[0] == pytest.approx(0.0, abs=1e-9)
    assert slides == sorted(slides)
    assert slides[-1] == pytest.approx(most_m, abs=1e-9)


@pytest.mark.parametrize("degrees", [-120, -30, 0, 45, 120])
def test_the_humerus_marker_lags_behind_axial_rotation_and_the_elbow_stays(degrees: int) -> None:
    turned = posture(rot_y(0.4) @ rot_z(np.radians(degrees)))
    skin = SOFT_TISSUES["published"].humerus_from_skin(turned, PLACE_M)
    np.testing.assert_allclose(log_so3(skin[:3, :3]), [0.0, 0.0, -0.30 * axial_rotation_rad(turned)], atol=1e-9)
    elbow = np.array([0.0, 0.0, -0.32, 1.0])
    np.testing.assert_allclose(skin @ elbow, elbow, atol=1e-12)
    assert np.degrees(axial_rotation_rad(turned)) == pytest.approx(degrees, abs=6.0)
    assert np.degrees(axial_rotation_rad(posture(rot_z(np.radians(degrees))))) == pytest.approx(degrees, abs=1e-6)
