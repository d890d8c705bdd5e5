"""A session as the estimator meets it: what became of the markers in every frame, the encoder rows, and the truth."""

from collections.abc import Collection
from dataclasses import dataclass

from ghest_drivers.samples import CameraInfo, EncoderSample
from ghest_rt.config.load import LoadedStation
from ghest_rt.messages.results import MarkerObservation, TruthSample
from ghest_rt.simulation.world import World
from ghest_rt.vision.station import Method, StationVision


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """Everything of a session but its images.

    Attributes:
        station: The station file, fitted to the patient.
        camera_infos: What is fixed about each camera.
        joints: The joints measured.
        encoders: The encoder rows, in order.
        truth: The truth, every 5 ms.
        markers: What became of the marker in each frame, in order, by (method, camera).
    """

    station: LoadedStation
    camera_infos: dict[str, CameraInfo]
    joints: tuple[str, ...]
    encoders: list[EncoderSample]
    truth: list[TruthSample]
    markers: dict[tuple[Method, str], list[MarkerObservation]]


def observe(world: World, methods: Collection[Method], cameras: Collection[str] | None = None) -> Observed:
    """Render a session and look for the markers, each frame once for all methods.

    Args:
        world: The simulated clinic.
        methods: Methods whose observations are wanted.
        cameras: Only these cameras' frames; None for all.
    """
    infos = {name: world.camera_info(name) for name in world.camera_names}
    visions: dict[Method, StationVision] = {method: StationVision(world.station.config, infos, method) for method in methods}
    markers: dict[tuple[Method, str], list[MarkerObservation]] = {}
    for name in world.camera_names if cameras is None else cameras:
        found: dict[Method, list[MarkerObservation]] = {method: [] for method in methods}
        for k in range(world.frame_count(name)):
            frame = world.frame(name, k)
            if frame is not None:
                for method, vision in visions.items():
                    found[method].append(vision.observe(frame))
        markers.update({(method, name): observations for method, observations in found.items()})
    rows = (world.encoder_sample(k) for k in range(world.encoder_count))
    return Observed(
        station=world.station,
        camera_infos=infos,
        joints=world.encoder_info().joint_names,
        encoders=[row for row in rows if row is not None],
        truth=[world.truth_at(t_ns) for t_ns in world.truth_times_ns],
        markers=markers,
    )


def with_markers_of(base: Observed, moved: Observed) -> Observed:
    """Return a session in which some cameras' markers are those of another, with that other one's truth.

    The two differ in nothing but where markers are on their bones: what the remaining cameras see is the same in both.
    """
    return Observed(base.station, base.camera_infos, base.joints, base.encoders, moved.truth, {**base.markers, **moved.markers})
