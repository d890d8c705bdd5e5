"""Calibration sessions made of formulas: a shoulder that moves, two markers on it, noise, and whatever shall be wrong."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ghest_rt.calibration.session import Session
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array, exp_so3, rot_x, rot_y, rot_z

M0_FROM_GH = transform(exp_so3(np.array([0.05, -0.03, 0.08])), (-0.055, -0.010, -0.085))
M1_FROM_ELW = transform(exp_so3(np.array([-0.06, 0.04, 0.02])), (0.003, -0.045, -0.055))
ARM_M = 0.31
RATE_HZ = 60.0
# Axes of the elbow frame in the arm frame, docs/frames.md: x, then z of the arm, then their product.
ARM_FROM_ELW = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])

Angles = Callable[[float], tuple[float, float, float, float]]


def angles(t_s: float) -> tuple[float, float, float, float]:
    """Return a, b, g and the elbow's bend: four seconds of rest, then eight of everything together."""
    if t_s < 4.0:
        return 0.0, 0.0, 0.0, math.radians(90.0)
    s = t_s - 4.0
    ease = min(1.0, s)
    a, b, g = (
        math.radians(amplitude) * ease * math.sin(rate * s) for amplitude, rate in ((20.0, 1.1), (25.0, 1.7), (22.0, 2.3))
    )
    return a, b, g, math.radians(90.0 + 20.0 * ease * math.sin(1.3 * s))


def session(
    movement: Angles = angles,
    *,
    seconds: float = 14.0,
    noise_m: float = 0.0005,
    noise_rad: float = 0.002,
    seed: int = 0,
    rate_hz: float = RATE_HZ,
) -> Session:
    """Return a session of that movement, right arm."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 1.0 / rate_hz)
    m0, m1, link, forearm = [], [], [], []
    for t_s in times.tolist():
        a, b, g, bend = movement(t_s)
        e_from_gh = transform(rot_x(0.12 * b) @ rot_z(-0.16 * a), (0.04, 0.025, -0.15))
        e_from_arm = e_from_gh @ transform(rot_y(a) @ rot_x(b) @ rot_z(g), np.zeros(3))
        e_from_elw = e_from_arm @ transform(ARM_FROM_ELW, (0.0, 0.0, -ARM_M))
        # Stretched, the forearm goes on along -y of the elbow frame; bent by 90 degrees it points along -z, to the left.
        moving = 0.0 if bend == math.pi / 2 else 1.0
        e_from_link = (
            e_from_elw @ transform(rot_x(bend - math.pi / 2), np.zeros(3)) @ transform(rot_z(0.3 * a * moving), np.zeros(3))
        )
        noisy = [transform(exp_so3(noise_rad * rng.standard_normal(3)), noise_m * rng.standard_normal(3)) for _ in range(2)]
        m0.append(e_from_gh @ inverse(M0_FROM_GH) @ noisy[0])
        m1.append(e_from_elw @ inverse(M1_FROM_ELW) @ noisy[1])
        link.append(e_from_link)
        forearm.append(e_from_link[:3, :3] @ np.array([0.0, 0.0, -1.0]))
    return Session(times, np.array(m0), np.array(m1), np.array(link), np.array(forearm), len(times), {}, 1.0 / rate_hz)


def with_slide(whole: Session, from_s: float, slide_m: Array) -> Session:
    """Return the session with m1 displaced along its own axes from some time on."""
    moved = whole.e_from_m1.copy()
    late = whole.t_s >= from_s
    moved[late] = moved[late] @ transform(np.eye(3), slide_m)
    return replace(whole, e_from_m1=moved)


def only(whole: Session, share: float) -> Session:
    """Return the session with a share of its instants, evenly spread."""
    return at(whole, np.flatnonzero(np.diff(np.floor(np.arange(len(whole.t_s) + 1) * share)) > 0))


def with_wander(whole: Session, wander_m: float) -> Session:
    """Return the session with m0 wandering to and fro along all axes of E."""
    wandering = whole.e_from_m0.copy()
    wandering[:, :3, 3] += wander_m * np.sin(np.outer(whole.t_s, (1.9, 2.9, 0.9)))
    return replace(whole, e_from_m0=wandering)


def at(whole: Session, kept: NDArray[np.int64]) -> Session:
    """Return the session with some of its instants, by number, as if the others had not been seen."""
    assert whole.forearm_in_e is not None
    return replace(
        whole,
        t_s=whole.t_s[kept],
        e_from_m0=whole.e_from_m0[kept],
        e_from_m1=whole.e_from_m1[kept],
        e_from_link=whole.e_from_link[kept],
        forearm_in_e=whole.forearm_in_e[kept],
        missing={"m1_not_seen": len(whole.t_s) - len(kept)},
    )


def with_frozen_encoders(whole: Session) -> Session:
    """Return the session as it looks when the encoders tell the same all the time: camera r1 seems to stand still."""
    assert whole.forearm_in_e is not None
    link = np.broadcast_to(whole.e_from_link[0], whole.e_from_link.shape)
    m1 = np.array([link[0] @ inverse(then) @ pose for then, pose in zip(whole.e_from_link, whole.e_from_m1, strict=True)])
    return replace(whole, e_from_link=link, e_from_m1=m1, forearm_in_e=np.broadcast_to(whole.forearm_in_e[0], (len(m1), 3)))
