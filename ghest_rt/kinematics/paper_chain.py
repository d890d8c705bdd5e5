"""Equations (6) and (7) of the paper: cameras and markers in the exoskeleton base frame E."""

import numpy as np

from ghest_rt.geometry.so3 import Array


def eq6_e_from_camera(e_from_link: Array, link_from_camera: Array) -> Array:
    """Equation (6), T_ri^E = T_l^E * T_ri^l: a camera in E.

    Args:
        e_from_link: (4, 4) pose of the link that carries the camera, by forward kinematics.
        link_from_camera: (4, 4) pose of the camera on that link, by calibration.

    Returns:
        (4, 4) pose of the camera in E, metres.
    """
    return np.asarray(e_from_link.dot(link_from_camera))


def eq7_e_from_marker(e_from_camera: Array, camera_from_marker: Array) -> Array:
    """Equation (7), T_mi^E = T_ri^E * T_mi^ri: a marker in E.

    Args:
        e_from_camera: (4, 4) pose of the camera in E, equation (6).
        camera_from_marker: (4, 4) pose of the marker in the camera, equations (4) and (5).

    Returns:
        (4, 4) pose of the marker in E, metres.
    """
    return np.asarray(e_from_camera.dot(camera_from_marker))
