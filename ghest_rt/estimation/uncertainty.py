"""First-order propagation of the marker poses' covariances to the arm's rotation and the GH angles.

True pose of a marker = exp(theta) R, p + t (left perturbation, axes of the frame in which the pose is given). With
d = p_G - p_elw = L V, lever arms l0 = R_m0 p_G^m0 and l1 = R_m1 p_elw^m1 in E, and u the elbow's x axis = s V + c x_arm:

    delta d  = t0 - [l0]x theta0 - t1 + [l1]x theta1
    phi_perp = V x (delta d) / L                                       (turns V)
    phi_V    = theta1 . V + (s / c) (phi_perp - theta1) . x_arm        (keeps u in the plane of V and x_arm)
    epsilon  = gh_from_e (phi_perp + phi_V V - theta0)

An error of m0's rotation acts twice: on p_G by its lever arm, and on the frame in which the arm is expressed.
"""

import math

import numpy as np

from ghest_rt.geometry.so3 import Array, skew

# The standard deviation of an angle of which nothing is known: uniform over the circle.
_UNKNOWN_RAD = math.pi / math.sqrt(3.0)


def covariance_in_e(covariance: Array, e_from_camera: Array) -> Array:
    """Return a marker's (6, 6) pose covariance, given in camera axes, in E axes.

    Args:
        covariance: (6, 6) of (rotation error rad, translation error m) in camera axes.
        e_from_camera: (4, 4) pose of the camera in E, taken as exact.
    """
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = e_from_camera[:3, :3]
    return np.asarray(turn.dot(covariance).dot(turn.T))


def rotation_jacobians(
    e_from_m0: Array, e_from_m1: Array, e_from_gh: Array, e_from_elw: Array, e_from_arm: Array
) -> tuple[Array, Array]:
    """Return how the error of gh_from_arm depends on the errors of the two marker poses.

    Args:
        e_from_m0: (4, 4) marker m0 in E, equation (7).
        e_from_m1: (4, 4) marker m1 in E, equation (7).
        e_from_gh: (4, 4) GH joint frame in E, equation (8).
        e_from_elw: (4, 4) elbow frame in E, equation (9).
        e_from_arm: (4, 4) upper arm in E, steps (3) to (5).

    Returns:
        Two (3, 6) Jacobians of the rotation error epsilon (rad, GH axes; true = exp(epsilon) gh_from_arm) with respect to
        (theta, t) of m0 and of m1 in E axes.
    """
    gh_from_e = e_from_gh[:3, :3].T
    x, V = e_from_arm[:3, 0], e_from_arm[:3, 2]
    u = e_from_elw[:3, 0]
    d = e_from_gh[:3, 3] - e_from_elw[:3, 3]
    length = math.sqrt(float(d @ d))
    ratio = float(u @ V) / float(u @ x)
    turn = skew(V / length)
    # phi = from_d delta_d + from_theta1 theta1
    along = ratio * np.outer(V, x)
    from_d = turn + along @ turn
    from_theta1 = np.outer(V, V) - along
    lever_0 = skew(e_from_gh[:3, 3] - e_from_m0[:3, 3])
    lever_1 = skew(e_from_elw[:3, 3] - e_from_m1[:3, 3])
    J_0, J_1 = np.empty((3, 6)), np.empty((3, 6))
    J_0[:, :3] = -from_d @ lever_0 - np.eye(3)
    J_0[:, 3:] = from_d
    J_1[:, :3] = from_d @ lever_1 + from_theta1
    J_1[:, 3:] = -from_d
    return gh_from_e @ J_0, gh_from_e @ J_1


def euler_sigma_rad(gh_from_arm: Array, covariance: Array) -> tuple[float, float, float]:
    """Return the standard deviations of the y-x-z angles (a, b, g): those of flexion, abduction and rotation, rad.

    epsilon = a' e_y + b' Ry(a) e_x + g' V, solved for (a', b', g'). At the singularity (b = ±90 deg) a and g are undetermined:
    no value exceeds pi / sqrt(3), that of an angle of which nothing is known.

    Args:
        gh_from_arm: (3, 3) rotation.
        covariance: (3, 3) of its rotation error, rad, GH axes.
    """
    vx, vy, vz = gh_from_arm[:, 2].tolist()
    cosine_b = math.hypot(vx, vz)
    if cosine_b < 1e-9:
        sine_a, cosine_a = 0.0, 1.0
        cosine_b = 1e-9
    else:
        sine_a, cosine_a = vx / cosine_b, vz / cosine_b
    # Rows of the inverse of [e_y, Ry e_x, V], with V = (sin a cos b, -sin b, cos a cos b).
    tangent = -vy / cosine_b
    rows = (
        (tangent * sine_a, 1.0, tangent * cosine_a),
        (cosine_a, 0.0, -sine_a),
        (sine_a / cosine_b, 0.0, cosine_a / cosine_b),
    )
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = covariance.tolist()
    variances = (x * x * xx + y * y * yy + z * z * zz + 2.0 * (x * y * xy + x * z * xz + y * z * yz) for x, y, z in rows)
    a, b, g = (min(math.sqrt(max(v, 0.0)), _UNKNOWN_RAD) for v in variances)
    return a, b, g
