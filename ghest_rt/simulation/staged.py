"""Devices and truth of a moving scene: two cameras and encoders, all on one time axis from 0."""

from dataclasses import replace

import mujoco
import numpy as np

from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame
from ghest_rt.config.load import LoadedStation
from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.camera import FrameTimes, SimulatedCamera
from ghest_rt.simulation.encoders import LEAD_S, SimulatedEncoders
from ghest_rt.simulation.imaging import Light
from ghest_rt.simulation.optics import Imaging
from ghest_rt.simulation.sensors import SensorSet
from ghest_rt.simulation.stage import Stage
from ghest_rt.simulation.texture import MarkerTexture, make_texture
from ghest_rt.simulation.timeline import Timeline

TRUTH_STEP_NS = 5_000_000


class StagedWorld:
    """What devices and truth of a scene deliver; the same arguments give the same samples, in any order of asking.

    A camera's frames may be asked for by one thread at a time, different cameras and the encoders by different threads.

    Args:
        station: The station file.
        stage: The moving scene.
        sensors: The kind of cameras and encoders.
        timeline: Where the movement is on the time axis.
        motion_name: What the movement is called in recordings.
        seed: Seeds noise, phases and timing.
        texture: What is printed on the markers.
        light: The light in the room; None for the usual one.
        imaging: What goes wrong with the colour images; None for nothing.
    """

    def __init__(
        self,
        station: LoadedStation,
        stage: Stage,
        sensors: SensorSet,
        timeline: Timeline,
        *,
        motion_name: str,
        seed: int,
        texture: MarkerTexture = "disks",
        light: Light | None = None,
        imaging: Imaging | None = None,
    ) -> None:
        self.station = station
        self.timeline = timeline
        self.motion_name = motion_name
        self._stage = stage
        config = station.config
        imaging = imaging or Imaging()
        light = light or Light()
        printed = {marker: imaging.printed(config.markers[marker], marker, seed) for marker in config.markers}
        self._cameras = {
            name: SimulatedCamera(
                stage,
                name,
                marker_name=camera.marker,
                marker=config.markers[camera.marker],
                texture=make_texture(texture, printed[camera.marker], camera.marker),
                profile=sensors.camera,
                light=light,
                imaging=imaging,
                timeline=self.timeline,
                seed=seed,
            )
            for name, camera in config.cameras.items()
        }
        self._encoders = SimulatedEncoders(stage, config.encoders.joints, sensors.encoders, self.timeline, seed)
        self._data = mujoco.MjData(stage.model)

    @property
    def camera_names(self) -> tuple[str, ...]:
        """The cameras."""
        return tuple(self._cameras)

    def camera_from_marker(self, name: str, t_ns: int) -> Array:
        """Return the true pose (4, 4) of a camera's marker in it at any instant. For one thread at a time."""
        self._stage.place(self._data, self.timeline.movement_s(t_ns))
        marker = self.station.config.cameras[name].marker
        return inverse(self._stage.e_from_camera(self._data, name)) @ self._stage.e_from_marker(self._data, marker)

    def camera_info(self, name: str) -> CameraInfo:
        """Return what is fixed about a camera."""
        return self._cameras[name].info

    def frame_count(self, name: str) -> int:
        """Return how many frames a camera takes."""
        return self._cameras[name].frame_count

    def frame_times(self, name: str, k: int) -> FrameTimes:
        """Return when a camera's frame `k` happens, without rendering it."""
        return self._cameras[name].times(k)

    def frame(self, name: str, k: int) -> RgbdFrame | None:
        """Return frame `k` of a camera, or None after the end; without depth if the station file says `depth = false`."""
        camera = self._cameras[name]
        if k >= camera.frame_count:
            return None
        frame = camera.frame(k)
        return frame if self.station.config.cameras[name].depth else replace(frame, depth_counts=None)

    def render(self, name: str, t_ns: int) -> RgbdFrame:
        """Return what a camera would see at any instant of the movement, as if it exposed colour and depth then.

        Its `seq` is 0; noise is that of no frame in particular but the same for the same instant.
        """
        camera = self._cameras[name]
        color, depth = camera.images(t_ns, t_ns, np.random.default_rng(t_ns))
        return RgbdFrame(camera.info, 0, color, depth, t_ns, t_ns, t_ns, t_ns)

    def encoder_info(self) -> EncoderInfo:
        """Return the joints measured."""
        return self._encoders.info

    @property
    def encoder_count(self) -> int:
        """How many rows the encoders send."""
        return self._encoders.sample_count

    def encoder_arrival_ns(self, k: int) -> int:
        """Return when encoder row `k` is delivered."""
        return self._encoders.arrival_ns(k)

    def encoder_sample(self, k: int) -> EncoderSample | None:
        """Return encoder row `k`, or None after the end."""
        return self._encoders.sample(k) if k < self._encoders.sample_count else None

    @property
    def truth_times_ns(self) -> range:
        """When the truth is recorded: every 5 ms from before the movement until after it."""
        lead_ns = round(LEAD_S * 1e9)
        first = -((lead_ns - self.timeline.start_ns) // TRUTH_STEP_NS) * TRUTH_STEP_NS
        return range(first, self.timeline.end_ns + lead_ns, TRUTH_STEP_NS)

    def truth_at(self, t_ns: int) -> TruthSample:
        """Return the truth at any instant. For one thread at a time."""
        return self._stage.truth(self._data, self.timeline.movement_s(t_ns), t_ns)
