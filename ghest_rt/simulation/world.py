"""The simulated clinic as a whole: exoskeleton, patient and markers, with their devices and truth."""

from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.anatomy import Anatomy
from ghest_rt.simulation.attachment import Attachment
from ghest_rt.simulation.clinic import Clinic
from ghest_rt.simulation.coupling import JOINTS, LINKS, ExoskeletonMotion
from ghest_rt.simulation.disturbances import MarkerMove, check_moves
from ghest_rt.simulation.imaging import Light
from ghest_rt.simulation.optics import Imaging
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.scene import Scene, build_scene
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
        BadInputError: The station's URDF, cameras' links or encoder joints cannot be simulated, or a marker moves too far or
            not before the end.
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
        config = station.config
        settings = config.exoskeleton.settings_m
        duration = motion.duration_s if duration_s is None else min(duration_s, motion.duration_s)
        check_moves(marker_moves, duration)
        disturbed = bool(marker_moves) or soft_tissue is not None
        scene = build_scene(config, station.urdf_text, station.source, body, movable_plates=disturbed)
        _check_names(scene, station)
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


def _check_names(scene: Scene, station: LoadedStation) -> None:
    config = station.config
    joints = sorted({*config.encoders.joints, *config.exoskeleton.settings_m, *JOINTS} - set(scene.joint_address))
    if joints:
        raise BadInputError(
            f"{station.source}: the URDF has no joint {', '.join(joints)}; see encoders.joints and settings_m (the simulated "
            f"patient's exoskeleton needs {', '.join(sorted(JOINTS))})"
        )
    for name, camera in config.cameras.items():
        if camera.link not in scene.links:
            known = ", ".join(sorted(scene.links))
            raise BadInputError(f'{station.source}: cameras.{name}.link: the URDF has no link "{camera.link}"; it has {known}')
    links = sorted(LINKS - scene.links)
    if links:
        raise BadInputError(
            f"{station.source}: the URDF has no link {', '.join(links)}, which the simulated patient's cuffs are fixed to; "
            "name the links as config/armeo_spring.urdf does"
        )
