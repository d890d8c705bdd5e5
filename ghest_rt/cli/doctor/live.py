"""Opens a station's devices for some seconds and measures what they deliver."""

import asyncio
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DriverError, EndOfStream, ReadTimeout
from ghest_drivers.interfaces import EncoderLink, RgbdCamera
from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.cli.doctor.findings import Finding, missing, note, ok

_READ_S = 0.25
_LEAST_RATE = 0.95
_MOST_MISSING = 0.01
_LEAST_DEPTH = 0.5
_MOST_INTERFERENCE = 0.2
_LEAST_ENCODER_HZ = 30.0


@dataclass(slots=True)
class CameraMeasurement:
    """What a camera delivered.

    Attributes:
        seqs: Sequence numbers.
        captures_ns: Capture times.
        ages_ms: From capture to delivery.
        depth_fractions: Of the middle of each depth image, how much was measured; 0 without a depth image.
        bad: Frames that could not be used.
        rate_hz: Nominal rate.
        problem: What ended it early.
    """

    seqs: list[int] = field(default_factory=list)
    captures_ns: list[int] = field(default_factory=list)
    ages_ms: list[float] = field(default_factory=list)
    depth_fractions: list[float] = field(default_factory=list)
    bad: int = 0
    rate_hz: float = 0.0
    problem: str | None = None

    def add(self, frame: RgbdFrame) -> None:
        """Take in a frame."""
        self.seqs.append(frame.seq)
        self.captures_ns.append(frame.t_capture_ns)
        self.ages_ms.append((frame.t_arrival_ns - frame.t_capture_ns) * 1e-6)
        self.depth_fractions.append(_middle_fraction(frame))

    @property
    def measured_hz(self) -> float:
        """The rate of capture; 0 with fewer than two frames."""
        if len(self.captures_ns) < 2:
            return 0.0
        return (len(self.captures_ns) - 1) * 1e9 / (self.captures_ns[-1] - self.captures_ns[0])

    @property
    def missing_fraction(self) -> float:
        """Frames that the camera counted and that did not arrive."""
        span = self.seqs[-1] - self.seqs[0] + 1 if self.seqs else 0
        return 1.0 - len(self.seqs) / span if span else 0.0

    @property
    def depth_fraction(self) -> float:
        """Mean of `depth_fractions`."""
        return float(np.mean(self.depth_fractions)) if self.depth_fractions else 0.0


def _middle_fraction(frame: RgbdFrame) -> float:
    if frame.depth_counts is None:
        return 0.0
    height, width = frame.depth_counts.shape
    middle = frame.depth_counts[height // 4 : height - height // 4, width // 4 : width - width // 4]
    return np.count_nonzero(middle) / middle.size


def measure_camera(camera: RgbdCamera, seconds: float, clock: Clock) -> CameraMeasurement:
    """Read an open camera for some seconds."""
    measurement = CameraMeasurement(rate_hz=camera.info.rate_hz)
    deadline_ns = clock.now_ns() + round(seconds * 1e9)
    while clock.now_ns() < deadline_ns:
        try:
            measurement.add(camera.read(_READ_S))
        except ReadTimeout:
            continue
        except BadDeviceData:
            measurement.bad += 1
        except EndOfStream:
            break
        except DriverError as error:
            measurement.problem = str(error)
            break
    return measurement


def check_cameras(cameras: dict[str, RgbdCamera], seconds: float, clock: Clock) -> Iterator[Finding]:
    """Measure each camera alone, then all at once."""
    alone: dict[str, CameraMeasurement] = {}
    for name, camera in cameras.items():
        try:
            camera.open()
            alone[name] = measure_camera(camera, seconds, clock)
        except DriverError as error:
            yield missing(f"camera {name}, live", str(error), "see docs/hardware.md", exit_code=3)
            continue
        finally:
            camera.close()
        yield from _judge(f"camera {name}, live", alone[name])
    if len(alone) > 1:
        yield from _check_together({name: cameras[name] for name in alone}, alone, seconds, clock)


def _check_together(
    cameras: dict[str, RgbdCamera], alone: dict[str, CameraMeasurement], seconds: float, clock: Clock
) -> Iterator[Finding]:
    together: dict[str, CameraMeasurement] = {}

    def run(name: str) -> None:
        try:
            cameras[name].open()
            together[name] = measure_camera(cameras[name], seconds, clock)
        except DriverError as error:
            together[name] = CameraMeasurement(problem=str(error))
        finally:
            cameras[name].close()

    threads = [threading.Thread(target=run, args=(name,)) for name in cameras]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name, measurement in together.items():
        check = f"camera {name}, all at once"
        yield from _judge(check, measurement)
        before, now = alone[name].depth_fraction, measurement.depth_fraction
        if measurement.problem is None and before > 0 and now < (1 - _MOST_INTERFERENCE) * before:
            detail = f"depth falls from {before:.0%} to {now:.0%} of the image while the other camera runs"
            yield note(check, detail, "their projectors disturb each other: see docs/hardware.md, 'Two cameras'")


def _judge(check: str, measured: CameraMeasurement) -> Iterator[Finding]:
    if measured.problem is not None or not measured.seqs:
        detail = measured.problem or "no frame"
        yield missing(check, detail, "unplug the camera, plug it in again, and see docs/hardware.md", exit_code=3)
        return
    ages_ms = np.array(measured.ages_ms)
    detail = (
        f"{len(measured.seqs)} frames, {measured.measured_hz:.2f} Hz, {measured.missing_fraction:.1%} missing, "
        f"depth in {measured.depth_fraction:.0%} of the middle, {np.median(ages_ms):.1f} ms old on arrival "
        f"(99 %: {np.quantile(ages_ms, 0.99):.1f} ms)"
    )
    problems = []
    if measured.measured_hz < _LEAST_RATE * measured.rate_hz:
        problems.append(f"too slow for {measured.rate_hz:g} Hz: check the USB port, exposure_us and the load of the machine")
    if measured.missing_fraction > _MOST_MISSING:
        problems.append("frames are lost: give each camera a USB controller of its own")
    if measured.depth_fraction < _LEAST_DEPTH:
        problems.append("hardly any depth: is the marker within the camera's range?")
    if measured.bad:
        problems.append(f"{measured.bad} unusable frames")
    yield note(check, detail, "; ".join(problems)) if problems else ok(check, detail)


async def _read_encoders(link: EncoderLink, seconds: float, clock: Clock) -> list[EncoderSample]:
    samples: list[EncoderSample] = []
    await link.open()
    try:
        deadline_ns = clock.now_ns() + round(seconds * 1e9)
        while clock.now_ns() < deadline_ns:
            try:
                samples.append(await link.read(_READ_S))
            except ReadTimeout:
                continue
            except EndOfStream:
                break
    finally:
        await link.close()
    return samples


def check_encoders(link: EncoderLink, seconds: float, clock: Clock) -> Finding:
    """Read the encoders for some seconds."""
    check = "encoders, live"
    remedy = "see docs/encoder-links.md"
    try:
        samples = asyncio.run(_read_encoders(link, seconds, clock))
    except DriverError as error:
        return missing(check, str(error), remedy, exit_code=3)
    if len(samples) < 2:
        return missing(check, f"{len(samples)} samples", remedy, exit_code=3)
    rate_hz = (len(samples) - 1) * 1e9 / max(samples[-1].t_capture_ns - samples[0].t_capture_ns, 1)
    angles_deg = ", ".join(f"{angle:.1f}" for angle in np.degrees(samples[-1].angles_rad))
    lost = samples[-1].seq - samples[0].seq + 1 - len(samples)
    detail = f"{len(samples)} samples, {rate_hz:.1f} Hz, {lost} lost; last angles {angles_deg} deg"
    if rate_hz < _LEAST_ENCODER_HZ or lost > _MOST_MISSING * len(samples):
        return note(check, detail, remedy)
    return ok(check, detail)
