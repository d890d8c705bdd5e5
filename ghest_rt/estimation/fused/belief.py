"""What the filter believes at one instant: a point on the manifold and the covariance of the error around it."""

from dataclasses import dataclass, field

import numpy as np

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3

# The error state, in this order, all in E axes but the GH centre in the markers. Rotation errors are left perturbations: true =
# exp(error) R.
ACROMION = slice(0, 3)
GH = slice(3, 6)
ARM = slice(6, 9)
POSES = slice(0, 9)
GH_IN_MARKER = (slice(9, 12), slice(12, 15))
BOTH_GH = slice(9, 15)
ACROMION_RATE = slice(15, 18)
GH_RATE = slice(18, 21)
ARM_RATE = slice(21, 24)
RATES = slice(15, 24)
SIZE = 24

_THREE_HALVES = 1.5 * np.eye(3)


@dataclass(slots=True, eq=False)
class Streak:
    """Outliers of one marker in a row.

    Attributes:
        count: How many alike.
        length: How many in a row, alike or not.
        since_ns: Capture time of the first of those alike.
        residual: (6,) innovation of the first of those alike: rotation rad, position m, axes of the marker.
    """

    count: int = 0
    length: int = 0
    since_ns: int = 0
    residual: Array = field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """How a marker sits on its bone: as calibrated, until it is seen to jump.

    Attributes:
        slide: (3,) displacement, axes of the marker as calibrated, m.
        turn: (3, 3) calibrated_from_actual.
        slide_variance: Of each component of the slide, m^2, beyond calibration.
        turn_variance: Of each component of the turn, rad^2.
        jumped: Whether it has ever jumped.
    """

    slide: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: np.eye(3))
    slide_variance: float = 0.0
    turn_variance: float = 0.0
    jumped: bool = False


@dataclass(slots=True, eq=False)
class Belief:
    """State of the filter. Arrays are replaced, never written to, so that a copy shares them.

    Attributes:
        t_ns: The instant.
        e_from_r1: (4, 4) camera r1 in E at that instant, equation (6).
        e_from_marker: (3, 3) orientations of m0 and of m1 in E.
        p_gh: (3,) GH centre in E, m.
        rates: (9,) of m0 (rad/s), of the GH centre (m/s), of m1 beyond what the encoders tell (rad/s); E axes.
        gh_in_marker: (3,) GH centre in the frame of m0 as it is, and in that of m1, m.
        P: (24, 24) covariance of the error state.
        speed_rad_s: How fast camera r1 turns, averaged.
        agility: Factor on the process noise of m0 with the GH centre, and of m1.
        seen_ns: Capture time of the last measurement accepted of m0 and m1.
        taken: How many have been accepted of m0 and m1 since the start.
        surprise: Of m0 and m1: (3,) the last innovation of the rotation, whitened.
        strain: Of m0 and m1: (3,) the last innovation of the GH centre's place, whitened.
        slack: Factor on the creep of the GH centre in the markers.
        nis: Normalised innovation squared of the last sighting, as foretold (6 degrees of freedom).
        streaks: Outliers in a row of m0 and m1.
        base: How m0 and m1 sit on their bones, jumps included.
    """

    t_ns: int
    e_from_r1: Array
    e_from_marker: tuple[Array, Array]
    p_gh: Array
    rates: Array
    gh_in_marker: tuple[Array, Array]
    P: Array
    agility: tuple[float, float]
    seen_ns: tuple[int, int]
    taken: tuple[int, int] = (1, 1)
    speed_rad_s: float = 0.0
    surprise: tuple[Array, Array] = field(default_factory=lambda: (np.zeros(3), np.zeros(3)))
    strain: tuple[Array, Array] = field(default_factory=lambda: (np.zeros(3), np.zeros(3)))
    slack: float = 1.0
    nis: float = 0.0
    streaks: tuple[Streak, Streak] = field(default_factory=lambda: (Streak(), Streak()))
    base: tuple[Base, Base] = field(default_factory=lambda: (Base(), Base()))

    def copy(self) -> "Belief":
        """Return a copy that may be moved on without touching this one."""
        return Belief(
            self.t_ns,
            self.e_from_r1,
            self.e_from_marker,
            self.p_gh,
            self.rates,
            self.gh_in_marker,
            self.P,
            self.agility,
            self.seen_ns,
            self.taken,
            self.speed_rad_s,
            self.surprise,
            self.strain,
            self.slack,
            self.nis,
            self.streaks,
            self.base,
        )

    def e_from(self, marker: int) -> Array:
        """Return the (4, 4) pose of m0 (0) or m1 (1) in E, equation (7)."""
        R = self.e_from_marker[marker]
        return transform(R, self.p_gh - R.dot(self.gh_in_marker[marker]))

    def shift(self, error: Array) -> None:
        """Move the point by a (24,) error state."""
        m0, m1 = self.e_from_marker
        self.e_from_marker = (exp_so3(error[ACROMION]).dot(m0), exp_so3(error[ARM]).dot(m1))
        self.p_gh = self.p_gh + error[GH]
        self.rates = self.rates + error[RATES]
        in_m0, in_m1 = self.gh_in_marker
        self.gh_in_marker = (in_m0 + error[GH_IN_MARKER[0]], in_m1 + error[GH_IN_MARKER[1]])

    def straighten(self, marker: int) -> None:
        """Draw a marker's orientation back onto the rotations (first order): rounding never accumulates."""
        R = self.e_from_marker[marker]
        straight = R.dot(_THREE_HALVES - 0.5 * R.T.dot(R))
        self.e_from_marker = (straight, self.e_from_marker[1]) if marker == 0 else (self.e_from_marker[0], straight)
