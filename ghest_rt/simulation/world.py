"""The simulated clinic as a whole: exoskeleton, patient and markers, with their devices and truth."""

from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.anatomy import Anatomy
from ghest_rt.simulation.attachment import Attachment
from ghest_rt.simulation.clinic import Clinic
from ghest_rt.simulation.coupling import ExoskeletonMotion
from ghest_rt.simulation.disturbances import MarkerMove
from ghest_rt.simulation.imaging import Light
from ghest_rt.simulation.optics import Imaging
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.scene import build_scene
from ghest_rt.simulation.sensors import SensorSet
from ghest_rt.simulation.soft_tissue import SoftTissue
from ghest_rt.simulation.staged import StagedWorld
from ghest_rt.simulation.texture import MarkerTexture
from ghest_rt.simulation.timeline import Timeline


class World(StagedWorld):
    """The simulated clinic: a patient with one arm in the exoskeleton.

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
        attachment = Attachment(scene, marker_moves, soft_tissue) if disturbed else None
        super().__init__(
            station,
            Clinic(scene, config, motion, exoskeleton, attachment),
            sensors,
            Timeline(duration),
            motion_name=motion.name,
            seed=seed,
            texture=texture,
            light=light,
            imaging=imaging,
        )
