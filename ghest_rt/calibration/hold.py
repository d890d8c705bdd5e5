"""The neutral posture that a calibration session begins with: where it is in the recording, and how still it was."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.calibration.session import Session
from ghest_rt.geometry.so3 import Array, angle_between_rad, nearest_rotation

LEAST_S = 2.0
"""So long a posture must be held."""
BEGINS_WITHIN_S = 15.0
"""After so long in the recording it is not looked for any more."""
STILL_RAD = math.radians(0.8)
"""Of each marker, root mean square."""
STILL_M = 0.005
LEAST_SEEN = 0.6
"""Share of the posture's instants at which both markers must be known."""

_LEAST_SPAN = 0.9  # from the first instant known to the last, as a share of the posture
_STEP_S = 0.25
_ENDING_S = 0.5  # a movement begins slowly: the last of a hold is left out where enough remains


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """A posture held still.

    Attributes:
        within: (n,) which instants of the session belong to it.
        start_s: When it begins.
        end_s: When it ends.
        e_from_m0: (3, 3) mean attitude of m0.
        e_from_m1: (3, 3) mean attitude of m1.
        m0_rad: By how much m0's attitude strayed, root mean square.
        m1_rad: The same of m1.
    """

    within: NDArray[np.bool_]
    start_s: float
    end_s: float
    e_from_m0: Array
    e_from_m1: Array
    m0_rad: float
    m1_rad: float


def find_hold(session: Session) -> Hold | None:
    """Return the first still stretch of at least `LEAST_S`, as long as it lasts; None if there is none."""
    if not len(session.t_s):
        return None
    start_s, step_s = float(session.t_s[0]), _step_s(session)
    while start_s <= BEGINS_WITHIN_S:
        hold = _held(session, start_s, start_s + LEAST_S)
        if hold is not None:
            whole = _as_long_as_it_lasts(session, hold)
            return _held(session, whole.start_s, max(whole.end_s - _ENDING_S, hold.end_s)) or whole
        start_s += step_s
    return None


def _as_long_as_it_lasts(session: Session, hold: Hold) -> Hold:
    step_s = _step_s(session)
    while True:
        newest = _held(session, hold.end_s, hold.end_s + step_s, least_span=0.0)
        longer = _held(session, hold.start_s, hold.end_s + step_s)
        if newest is None or longer is None:
            return hold
        for mean, now in ((hold.e_from_m0, newest.e_from_m0), (hold.e_from_m1, newest.e_from_m1)):
            if angle_between_rad(mean, now) > STILL_RAD:
                return hold
        hold = longer


def _step_s(session: Session) -> float:
    """Return how far the ends of the stretches that are tried lie apart: one instant at least."""
    return max(_STEP_S, session.period_s)


def _held(session: Session, start_s: float, end_s: float, least_span: float = _LEAST_SPAN) -> Hold | None:
    """Return a stretch if it is still, and seen for most of its time."""
    within = (session.t_s >= start_s) & (session.t_s < end_s)
    t_s, length_s = session.t_s[within], end_s - start_s
    if not len(t_s) or len(t_s) * session.period_s < LEAST_SEEN * length_s:
        return None
    if float(t_s[-1] - t_s[0]) + session.period_s < least_span * length_s:
        return None
    means, strays = [], []
    for poses in (session.e_from_m0[within], session.e_from_m1[within]):
        mean = nearest_rotation(poses[:, :3, :3].mean(axis=0))
        stray_rad = math.sqrt(np.mean([angle_between_rad(mean, R) ** 2 for R in poses[:, :3, :3]]))
        if stray_rad > STILL_RAD or float(np.sqrt(poses[:, :3, 3].var(axis=0).sum())) > STILL_M:
            return None
        means.append(mean)
        strays.append(stray_rad)
    return Hold(within, start_s, end_s, means[0], means[1], strays[0], strays[1])
