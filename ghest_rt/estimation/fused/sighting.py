"""A marker seen: what the filter takes in."""

from typing import NamedTuple

from ghest_rt.geometry.so3 import Array


class Sighting(NamedTuple):
    """One marker's pose in one frame.

    Attributes:
        marker: 0 for m0, 1 for m1.
        t_ns: Capture time, host time.
        pose: (4, 4) in E, equation (7), metres.
        covariance: (6, 6) of (rotation error rad, translation error m), E axes.
        e_from_r1: (4, 4) camera r1 in E at that time, equation (6).
        color_only: Depth took no part in it.
        joints: (n,) joint positions at that time, rad (m for prismatic joints).
        fewer_disks: It rests on fewer than four disks.
    """

    marker: int
    t_ns: int
    pose: Array
    covariance: Array
    e_from_r1: Array
    color_only: bool
    fewer_disks: bool
    joints: Array
