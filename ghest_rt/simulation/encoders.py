"""The encoder link of the simulated exoskeleton, with the timing of a real one."""

import math

import numpy as np

from ghest_drivers.samples import EncoderInfo, EncoderSample
from ghest_rt.simulation.sensors import EncoderProfile
from ghest_rt.simulation.stage import Stage
from ghest_rt.simulation.timeline import Timeline

LEAD_S = 0.1
"""The encoders run this long before the movement starts and after it ends."""

_MAX_DEVIATIONS = 3.0


class SimulatedEncoders:
    """All encoder rows of one movement. A repeated row carries the angles of the row before and a later time, as real ones do.

    Args:
        clinic: The moving scene.
        joints: The joints measured, in the order sent.
        profile: Timing and resolution.
        timeline: Where the movement is in the recording.
        seed: Seeds the timing.
    """

    def __init__(self, clinic: Stage, joints: tuple[str, ...], profile: EncoderProfile, timeline: Timeline, seed: int) -> None:
        self.info = EncoderInfo(name="encoders", joint_names=joints)
        self._clinic = clinic
        self._profile = profile
        self._timeline = timeline
        rng = np.random.default_rng((seed, *self.info.name.encode()))
        self._latch_ns: list[int] = []
        self._row_ns: list[int] = []
        t_ns = timeline.start_ns - round(LEAD_S * 1e9)
        end_ns = timeline.end_ns + round(LEAD_S * 1e9)
        while t_ns < end_ns:
            self._latch_ns.append(t_ns)
            self._row_ns.append(t_ns)
            if rng.random() < profile.repeat_probability:
                self._latch_ns.append(t_ns)
                self._row_ns.append(t_ns + round(rng.uniform(0.0, profile.repeat_delay_s) * 1e9))
            deviation = float(np.clip(rng.standard_normal(), -_MAX_DEVIATIONS, _MAX_DEVIATIONS))
            t_ns += round((profile.period_s + profile.period_sd_s * deviation) * 1e9)

    @property
    def sample_count(self) -> int:
        """How many rows there are."""
        return len(self._row_ns)

    def arrival_ns(self, k: int) -> int:
        """Return when row `k` is delivered."""
        return self._row_ns[k] + round(self._profile.latency_s * 1e9)

    def sample(self, k: int) -> EncoderSample:
        """Return row `k`."""
        row_ns = self._row_ns[k]
        joints = self._clinic.joints(self._timeline.movement_s(self._latch_ns[k]))
        angles = np.array([joints[name] for name in self.info.joint_names])
        if self._profile.bits is not None:
            step = 2.0 * math.pi / 2**self._profile.bits
            angles = np.rint(angles / step) * step
        elapsed_ns = (row_ns - self._timeline.start_ns) * (1.0 + self._profile.clock_drift)
        return EncoderSample(
            seq=k,
            angles_rad=angles,
            t_device_ns=self._timeline.start_ns + round(elapsed_ns),
            t_arrival_ns=self.arrival_ns(k),
            t_capture_ns=row_ns,
        )
