"""The poses of a calibration session: photometric markers through the paper's chain, equations (6) and (7)."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.arm_chain import ArmChain
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import GhEstimate, Reason
from ghest_rt.recording.reader import Recording
from ghest_rt.sync.encoder_track import EncoderTrack

Progress = Callable[[float], None]

# What is said of the angles by the calibration that is there does not matter: the poses are good.
_GOOD = (Reason.NONE, Reason.UNCERTAIN)


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """Everything at the n instants at which both markers and the joints are known.

    Attributes:
        t_s: (n,) seconds since the first instant of the grid.
        e_from_m0: (n, 4, 4) marker m0 in E.
        e_from_m1: (n, 4, 4) marker m1 in E.
        e_from_link: (n, 4, 4) the link that carries camera r1, in E.
        forearm_in_e: (n, 3) direction of the forearm, elbow to wrist; None where it is not on the exoskeleton.
        instants: How many instants the grid has.
        missing: How many of them do not count, by reason.
        period_s: From one instant of the grid to the next.
    """

    t_s: Array
    e_from_m0: Array
    e_from_m1: Array
    e_from_link: Array
    forearm_in_e: Array | None
    instants: int
    missing: dict[str, int]
    period_s: float

    @property
    def seen_s(self) -> float:
        """For how long both markers and the joints are known."""
        return len(self.t_s) * self.period_s

    @property
    def seen_fraction(self) -> float:
        """Share of the instants that count."""
        return len(self.t_s) / self.instants if self.instants else 0.0


def read_session(recording: Recording, station: LoadedStation, progress: Progress | None = None) -> Session:
    """Return the poses of a recording.

    Args:
        recording: Of a calibration session.
        station: Geometry, camera mounts and markers; its `m0_from_gh` and `m1_from_elw` are not used.
        progress: Told the share done, 0 to 1.

    Raises:
        BadInputError: The recording does not belong to the station.
    """
    _check_same(recording, station)
    pipeline = Pipeline(station, recording.camera_infos, recording.encoder_joints, "photometric")
    encoders: list[EncoderSample] = []

    def events() -> Iterator[object]:
        for event in recording.events():
            if isinstance(event, EncoderSample):
                encoders.append(event)
            yield event

    estimates: list[GhEstimate] = []
    for estimate in estimate_events(events(), pipeline):
        estimates.append(estimate)
        if progress is not None and len(estimates) % 20 == 0:
            progress(min(1.0, (estimate.t_sample_ns - estimates[0].t_sample_ns) / max(recording.duration_ns, 1)))
    return session_of(estimates, encoders, station, recording.encoder_joints)


def session_of(
    estimates: Sequence[GhEstimate], encoders: Iterable[EncoderSample], station: LoadedStation, encoder_joints: Sequence[str]
) -> Session:
    """Return the poses that estimates of method `photometric` rest on, with the joints at the same instants."""
    chain = ArmChain(station.config, station.urdf_text, station.source, encoder_joints)
    track = EncoderTrack(chain.limits)
    taken = sorted((sample.t_capture_ns, sample.angles_rad) for sample in encoders if track.add(sample) is None)
    good = [
        (estimate.t_sample_ns, estimate.e_from_m0, estimate.e_from_m1)
        for estimate in estimates
        if estimate.reason in _GOOD and estimate.e_from_m0 is not None and estimate.e_from_m1 is not None
    ]
    missing = Counter(str(estimate.reason) for estimate in estimates if estimate.reason not in _GOOD)
    t_ns = np.array([t for t, _, _ in good], dtype=np.int64)
    joints = _joints_at(t_ns, taken, len(encoder_joints))
    r1_from_link = inverse(station.config.calibration.link_from_camera_array("r1"))
    links = [chain.e_from_camera("r1", q) @ r1_from_link for q in joints]
    forearms = [forearm for q in joints if (forearm := chain.forearm_in_e(q)) is not None]
    first_ns = estimates[0].t_sample_ns if estimates else 0
    return Session(
        t_s=np.asarray((t_ns - first_ns) * 1e-9, dtype=np.float64),
        e_from_m0=np.array([m0 for _, m0, _ in good]).reshape(-1, 4, 4),
        e_from_m1=np.array([m1 for _, _, m1 in good]).reshape(-1, 4, 4),
        e_from_link=np.array(links).reshape(-1, 4, 4),
        forearm_in_e=np.array(forearms) if forearms else None,
        instants=len(estimates),
        missing=dict(missing),
        period_s=1.0 / station.config.rate_hz,
    )


def _joints_at(t_ns: np.ndarray[tuple[int], np.dtype[np.int64]], taken: list[tuple[int, Array]], count: int) -> Array:
    if not taken or not len(t_ns):
        return np.zeros((0, count))
    times = np.array([t for t, _ in taken])
    angles = np.array([angles for _, angles in taken])
    return np.column_stack([np.interp(t_ns - times[0], times - times[0], column) for column in angles.T])


def _check_same(recording: Recording, station: LoadedStation) -> None:
    """Refuse a recording made on another arm, with other settings or another exoskeleton.

    Raises:
        BadInputError: It was.
    """
    own, given = recording.station.config, station.config
    for key, there, here in (
        ("station.arm", own.station.arm, given.station.arm),
        ("exoskeleton.settings_m", own.exoskeleton.settings_m, given.exoskeleton.settings_m),
    ):
        if there != here:
            raise BadInputError(
                f"{station.source}: {key} is {here}, but {recording.path} was recorded with {there}; "
                "take the station file that the session was recorded with, or record another session"
            )
    if recording.station.urdf_text != station.urdf_text:
        raise BadInputError(
            f"{station.source}: its URDF is not the one that {recording.path} was recorded with; record another session"
        )
