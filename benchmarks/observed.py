"""Simulated sessions as estimators get them: observations, encoder rows, truth. Simulated once, kept in out/benchmarks/."""

import hashlib
import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.scenes import FOLDER
from ghest_drivers.samples import CameraInfo, EncoderSample
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.messages.results import GhEstimate, MarkerObservation
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.calibrating import with_reference
from ghest_rt.simulation.faults import FaultyDevices
from ghest_rt.simulation.fitting import fit_station
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.engine.salt import code_salt
from ghest_rt.studies.observing.tasks import observe_session
from ghest_rt.studies.truth import TruthTrack
from ghest_rt.sync.grid import Grid
from ghest_rt.vision.station import Method

Sample = MarkerObservation | EncoderSample


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """A session after vision.

    Attributes:
        station: The station file as calibrated.
        infos: The cameras.
        joints: The joints that the encoders measure.
        samples: In the order of arrival.
        truth: The truth.
        start_ns: Capture time of the first frame with which both markers have been in view.
        end_ns: That of the last frame.
        movement_start_ns: When the movement's time is 0.
    """

    station: LoadedStation
    infos: dict[str, CameraInfo]
    joints: tuple[str, ...]
    samples: list[Sample]
    truth: TruthTrack
    start_ns: int
    end_ns: int
    movement_start_ns: int


def observed(options: SimulateOptions, vision: Method, *, reference: str | None = None) -> Session:
    """Return a session as the detectors of method `vision` see it; `options.out` does not matter.

    Args:
        options: What is simulated.
        vision: The detectors.
        reference: Names the calibration session whose `[calibration.reference]` the station file gets; None for none.
    """
    body = anatomy(options.height_m)
    station = fit_station(load_station(options.station or shipped_station(options)), body)
    calibration = station.config.calibration
    geometry = (station.urdf_text, calibration.link_from_camera, calibration.m0_from_gh, calibration.m1_from_elw)
    code = code_salt(observe_session.__module__)
    key = hashlib.sha256(repr((options, vision, geometry, code)).encode()).hexdigest()[:16]
    path = FOLDER / "observed" / f"{key}.pickle"
    if path.exists():
        session: Session = pickle.loads(path.read_bytes())
    else:
        session = _observe(options, vision)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_bytes(pickle.dumps(session))
        part.replace(path)
    # What does not change the images may have changed in the station file since.
    return replace(session, station=station if reference is None else with_reference(station, body, options.seed, reference))


def shipped_station(options: SimulateOptions) -> Path:
    """Return the station file that ships for a sensor and an arm."""
    sensor = "" if options.sensor == "paper" else f"{options.sensor}-"
    return shipped_config_dir() / f"station-{sensor}sim{'-left' if options.arm == 'left' else ''}.toml"


def _observe(options: SimulateOptions, vision: Method) -> Session:
    world = build_world(options)
    devices = FaultyDevices(options.faults, world.camera_names, options.seed)
    infos = {camera: world.camera_info(camera) for camera in world.camera_names}
    joints = world.encoder_info().joint_names
    pipeline = Pipeline(world.station, infos, joints, vision)
    samples: list[Sample] = []
    first_ns: list[int] = []
    for camera in world.camera_names:
        for k in range(world.frame_count(camera)):
            frame = world.frame(camera, k) if devices.delivers_frame(camera, k) else None
            if frame is not None:
                samples.append(pipeline.observe(devices.spoil(frame, world.timeline.movement_s(frame.t_capture_ns))))
        first_ns.append(next(s.t_capture_ns for s in samples if isinstance(s, MarkerObservation) and s.camera == camera))
    end_ns = max(sample.t_capture_ns for sample in samples)
    for k in range(world.encoder_count):
        row = world.encoder_sample(k)
        if row is not None and devices.delivers_encoders(world.timeline.movement_s(row.t_capture_ns)):
            samples.append(row)
    samples.sort(key=lambda sample: sample.t_arrival_ns)
    truth = TruthTrack()
    for t_ns in world.truth_times_ns:
        truth.add(world.truth_at(t_ns))
    return Session(world.station, infos, joints, samples, truth, max(first_ns), end_ns, world.timeline.start_ns)


def estimates(
    session: Session, estimator: GhEstimator, lag_ns: int, tick: Callable[[], None] = lambda: None
) -> list[GhEstimate]:
    """Return the estimates on the publishing grid, each from what has arrived by its instant and the lag.

    Args:
        session: The session.
        estimator: One that has not been used yet.
        lag_ns: How long after an instant its estimate is asked for.
        tick: Called after each estimate.
    """
    grid = Grid(session.start_ns, session.station.config.rate_hz)
    found: list[GhEstimate] = []
    waiting = iter(session.samples)
    sample = next(waiting, None)
    k = 0
    while (t_ns := grid.at(k)) <= session.end_ns:
        while sample is not None and sample.t_arrival_ns <= t_ns + lag_ns:
            if isinstance(sample, MarkerObservation):
                estimator.add_marker(sample)
            else:
                estimator.add_encoder(sample)
            sample = next(waiting, None)
        found.append(estimator.estimate(t_ns))
        tick()
        k += 1
    return found
