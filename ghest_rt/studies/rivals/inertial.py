"""Rival 6: inertial sensors on scapula and upper arm, simulated from the true poses, fused by the library imufusion."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.extras import need_extra
from ghest_rt.geometry.so3 import Array, log_so3, matrix_from_quat_wxyz, quat_wxyz_from_matrix, slerp
from ghest_rt.messages.results import GhEstimate, MarkerObservation, Reason, TruthSample
from ghest_rt.studies.rivals.encoder_only import orientation_only

RECOMMENDED_GAIN = 0.5
"""The library's own."""

_G_MPS2 = 9.80665
# Rows: the axes of imufusion's earth (X level, ahead of the patient; Y to the left; Z up) in E.
EARTH_FROM_E = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuProfile:
    """An inertial sensor of the better consumer class, after its factory calibration and a still phase at the start.

    Attributes:
        rate_hz: Samples per second.
        gyro_noise_dps_rthz: Density of the gyroscope's white noise.
        gyro_bias_dps: Standard deviation of what is left of its offset, per axis.
        gyro_bias_walk_dps_rts: Random walk of that offset.
        accel_noise_g_rthz: Density of the accelerometer's white noise.
        accel_bias_g: Standard deviation of its offset, per axis.
    """

    rate_hz: float = 100.0
    gyro_noise_dps_rthz: float = 0.01
    gyro_bias_dps: float = 0.05
    gyro_bias_walk_dps_rts: float = 0.002
    accel_noise_g_rthz: float = 0.0002
    accel_bias_g: float = 0.004


@dataclass(frozen=True, slots=True, eq=False)
class ImuTrack:
    """What one sensor measured.

    Attributes:
        t_ns: (n,) times.
        gyro_dps: (n, 3) mean rate since the sample before, sensor axes.
        accel_g: (n, 3) specific force, sensor axes.
        earth_from_sensor: (3, 3) true attitude one period before the first sample: the initial calibration.
    """

    t_ns: Sequence[int]
    gyro_dps: Array
    accel_g: Array
    earth_from_sensor: Array


def simulate_imus(
    truth_at: Callable[[int], TruthSample], start_ns: int, end_ns: int, profile: ImuProfile, seed: int
) -> tuple[ImuTrack, ImuTrack]:
    """Return what sensors at the places of m0 (scapula) and m1 (upper arm) measure; the bones' own movement, no soft tissue.

    Args:
        truth_at: The truth at an instant.
        start_ns: Time of the first sample.
        end_ns: Time of the last.
        profile: The sensors.
        seed: Seeds noise and offsets.
    """
    step_ns = round(1e9 / profile.rate_hz)
    times = list(range(start_ns - step_ns, end_ns + 2 * step_ns, step_ns))
    truths = [truth_at(t_ns) for t_ns in times]
    rng = np.random.default_rng((seed, *b"imu"))
    scapula = _measure(times, [t.e_from_m0 for t in truths], profile, rng)
    arm = _measure(times, [t.e_from_m1 for t in truths], profile, rng)
    return scapula, arm


def _measure(times: Sequence[int], poses: Sequence[Array], profile: ImuProfile, rng: np.random.Generator) -> ImuTrack:
    dt_s = 1.0 / profile.rate_hz
    R = np.array([EARTH_FROM_E @ pose[:3, :3] for pose in poses])
    p_m = np.array([EARTH_FROM_E @ pose[:3, 3] for pose in poses])
    n = len(times) - 2
    rate_dps = np.degrees([log_so3(R[k].T @ R[k + 1]) for k in range(n)]) / dt_s
    force_mps2 = (p_m[2:] - 2.0 * p_m[1:-1] + p_m[:-2]) / dt_s**2 + np.array([0.0, 0.0, _G_MPS2])
    force_g = np.einsum("kji,kj->ki", R[1:-1], force_mps2) / _G_MPS2
    band = math.sqrt(profile.rate_hz / 2.0)
    walk = np.cumsum(rng.standard_normal((n, 3)), axis=0) * profile.gyro_bias_walk_dps_rts * math.sqrt(dt_s)
    gyro_bias = rng.standard_normal(3) * profile.gyro_bias_dps + walk
    accel_bias = rng.standard_normal(3) * profile.accel_bias_g
    return ImuTrack(
        t_ns=times[1:-1],
        gyro_dps=rate_dps + gyro_bias + rng.standard_normal((n, 3)) * profile.gyro_noise_dps_rthz * band,
        accel_g=force_g + accel_bias + rng.standard_normal((n, 3)) * profile.accel_noise_g_rthz * band,
        earth_from_sensor=R[0],
    )


class InertialEstimator:
    """A `GhEstimator` from two inertial sensors, without magnetometers: motors and steel of an exoskeleton disturb these.

    Both attitudes are given at the start, and so is how each sensor sits on its bone; from then on the filter is on its own.
    Rejections and the correction of the gyroscopes' offset are the library's recommended ones, and so is the gain unless told
    otherwise.
    """

    def __init__(
        self,
        scapula: ImuTrack,
        arm: ImuTrack,
        gh_from_scapula_sensor: Array,
        arm_from_arm_sensor: Array,
        gain: float = RECOMMENDED_GAIN,
        *,
        correct_offset: bool = True,
    ) -> None:
        """Set the filters on the initial attitudes.

        Args:
            scapula: The sensor on the scapula.
            arm: The sensor on the upper arm.
            gh_from_scapula_sensor: (3, 3) that sensor's rotation in the GH frame.
            arm_from_arm_sensor: (3, 3) the other's in the arm frame.
            gain: How strongly the accelerometers correct the gyroscopes; 0 leaves them alone.
            correct_offset: Whether the library's own algorithm learns the gyroscopes' offset while a sensor seems to be still.

        Raises:
            GhestError: imufusion is not installed.
        """
        self._filters = (_Attitude(scapula, gain, correct_offset), _Attitude(arm, gain, correct_offset))
        self._gh_from_scapula = gh_from_scapula_sensor
        self._arm_from_sensor = arm_from_arm_sensor

    def add_encoder(self, sample: EncoderSample) -> None:
        """Pass over an encoder sample: the method does without."""

    def add_marker(self, observation: MarkerObservation) -> None:
        """Pass over a marker."""

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used: none."""
        return {}

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at `t_ns`; instants in their order. Orientation only."""
        scapula, arm = (attitude.at(t_ns) for attitude in self._filters)
        if scapula is None or arm is None:
            return orientation_only(t_ns, None, Reason.STARTING, {})
        rotation = self._gh_from_scapula @ scapula.T @ arm @ self._arm_from_sensor.T
        return orientation_only(t_ns, rotation, Reason.NONE, {})


class _Attitude:
    """One sensor's filter, stepped up to the instants asked for."""

    def __init__(self, track: ImuTrack, gain: float, correct_offset: bool) -> None:
        need_extra("study", "the inertial rival")
        import imufusion  # noqa: PLC0415 - an extra, imported only when used

        self._track = track
        self._next = 0
        self._before = self._after = track.earth_from_sensor
        rate_hz = 1e9 / (track.t_ns[1] - track.t_ns[0])
        self._ahrs = imufusion.Ahrs()
        settings = imufusion.AhrsSettings()
        settings.sample_rate = rate_hz
        settings.gain = gain
        settings.acceleration_rejection = 10.0
        settings.rejection_timeout = 5 * rate_hz
        self._ahrs.set_settings(settings)
        # As the library says: "should be used in conjunction with the AHRS algorithm to achieve best performance".
        self._offset = imufusion.Bias().set_settings(imufusion.BiasSettings(sample_rate=rate_hz)) if correct_offset else None
        self._ahrs.skip_startup()
        self._ahrs.set_quaternion(quat_wxyz_from_matrix(track.earth_from_sensor))

    def at(self, t_ns: int) -> Array | None:
        """Return earth_from_sensor, (3, 3), interpolated between the samples on either side; None outside them."""
        track = self._track
        while self._next < len(track.t_ns) and (self._next == 0 or track.t_ns[self._next - 1] < t_ns):
            gyro_dps = track.gyro_dps[self._next]
            if self._offset is not None:
                gyro_dps = self._offset.update(gyro_dps)
            self._ahrs.update_no_magnetometer(gyro_dps, track.accel_g[self._next])
            self._before = self._after
            self._after = matrix_from_quat_wxyz(np.asarray(self._ahrs.get_quaternion(), dtype=np.float64))
            self._next += 1
        after_ns = track.t_ns[self._next - 1]
        if after_ns == t_ns:
            return self._after
        if self._next < 2 or after_ns < t_ns:
            return None
        before_ns = track.t_ns[self._next - 2]
        return slerp(self._before, self._after, (t_ns - before_ns) / (after_ns - before_ns))
