"""The simulated clinic as a whole: two cameras, encoders and the truth, all on one time axis from 0."""

import mujoco
import numpy as np

from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.anatomy import Anatomy
from ghest_rt.simulation.attachment import Attachment
from ghest_rt.simulation.camera import FrameTimes, SimulatedCamera
from ghest_rt.simulation.clinic import Clinic
from ghest_rt.simulation.coupling import ExoskeletonMotion
from ghest_rt.simulation.disturbances import MarkerMove
from ghest_rt.simulation.encoders import LEAD_S, SimulatedEncoders
from ghest_rt.simulation.imaging import Light
from ghest_rt.simulation.optics import Imaging
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.scene import build_scene
from ghest_rt.simulation.sensors import SensorSet
from ghest_rt.simulation.soft_tissue import SoftTissue
from ghest_rt.simulation.texture import MarkerTexture, make_texture
from ghest_rt.simulation.timeline import Timeline

TRUTH_STEP_NS = 5_000_000


class World:
    """What devices and truth of the simulated clinic deliver; the same arguments give the same samples, in any order of asking.

    A camera's frames may be asked for by one thread at a time, different cameras and the encoders by different threads.

    Args:
        station: The station file, with the prismatic settings made for this patient.
        body: The patient.
        motion: What the patient does.
        sensors: The kind of cameras and encoders.
        seed: Seeds noise, phases and timing.
        texture: What is printed on the markers.
        light: The light in the room.
        duration_s: How much of the movement; None for all of it.
        marker_moves: Markers that are not where the calibration says.
        soft_tissue: How skin moves the markers; None for markers fixed to the bones.
        imaging: What goes wrong with the colour images; None for nothing.

    Raises:
        BadInputError: The duration is not positive, or the station's URDF or encoder joints cannot be simulated.
        GhestError: The exoskeleton cannot follow this movement.
    """

    def __init__(
        self,
        station: LoadedStation,
        body: Anatomy,
        motion: Motion,
        sensors: SensorSet,
        *,
        seed: int,
        texture: MarkerTexture = "disks",
        light: Light | None = None,
        duration_s: float | None = None,
        marker_moves: tuple[MarkerMove, ...] = (),
        soft_tissue: SoftTissue | None = None,
        imaging: Imaging | None = None,
    ) -> None:
        if duration_s is not None and not duration_s > 0:
            raise BadInputError(f"duration {duration_s} s: give a positive number of seconds")
        config = station.config
        settings = config.exoskeleton.settings_m
        duration = motion.duration_s if duration_s is None else min(duration_s, motion.duration_s)
        disturbed = bool(marker_moves) or soft_tissue is not None
        scene = build_scene(config, station.urdf_text, station.source, body, movable_plates=disturbed)
        unknown = sorted({*config.encoders.joints, *settings} - set(scene.joint_address))
        if unknown:
            raise BadInputError(
                f"{station.source}: the URDF has no joint {', '.join(unknown)}; see encoders.joints and settings_m"
            )
        exoskeleton = ExoskeletonMotion(
            scene, motion, duration_s=duration, settings_m=settings, urdf_text=station.urdf_text, source=station.source
        )
        self.station = station
        self.timeline = Timeline(duration)
        attachment = Attachment(scene, marker_moves, soft_tissue) if disturbed else None
        self._clinic = Clinic(scene, config, motion, exoskeleton, attachment)
        imaging = imaging or Imaging()
        printed = {marker: imaging.printed(config.markers[marker], marker, seed) for marker in config.markers}
        self._cameras = {
            name: SimulatedCamera(
                self._clinic,
                name,
                marker_name=camera.marker,
                marker=config.markers[camera.marker],
                texture=make_texture(texture, printed[camera.marker], camera.marker),
                profile=sensors.camera,
                light=light or Light(),
                imaging=imaging,
                timeline=self.timeline,
                seed=seed,
            )
            for name, camera in config.cameras.items()
        }
        self._encoders = SimulatedEncoders(self._clinic, config.encoders.joints, sensors.encoders, self.timeline, seed)
        self._data = mujoco.MjData(scene.model)

    @property
    def camera_names(self) -> tuple[str, ...]:
        """The cameras."""
        return tuple(self._cameras)

    def camera_from_marker(self, name: str, t_ns: int) -> Array:
        """Return the true pose (4, 4) of a camera's marker in it at any instant. For one thread at a time."""
        self._clinic.place(self._data, self.timeline.movement_s(t_ns))
        marker = self.station.config.cameras[name].marker
        return inverse(self._clinic.e_from_camera(self._data, name)) @ self._clinic.e_from_marker(self._data, marker)

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
        """Return frame `k` of a camera, or None after the end."""
        camera = self._cameras[name]
        return camera.frame(k) if k < camera.frame_count else None

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
        return self._clinic.truth(self._data, self.timeline.movement_s(t_ns), t_ns)
