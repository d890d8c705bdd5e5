"""One simulated scene that feeds all fixtures: images, joint angles and truth on one time axis, for ever to and fro.

World time s runs 0 .. D and back again, the movement with it, which turns round within a tenth of a second, as hard as an arm
can: one that turned in an instant nothing could forecast. World time is a function of the host's monotonic clock alone, so
every process that knows the epoch knows what cameras see, what encoders read and what is true at any instant, without talking
to the others.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ghest_drivers.samples import Intrinsics

FRAME_RATE_HZ = 60
TRUTH_RATE_HZ = 500
DURATION_S = 2.0
TURN_S = 0.1  # from full speed one way to full speed the other way
DEPTH_UNIT_M = 1e-4  # what an OAK camera sends
STATION_FILE = "hil-scene.toml"


@dataclass(frozen=True, slots=True)
class Scene:
    """What a folder written by `write_scene` holds.

    Attributes:
        epoch_ns: Monotonic time of world time 0.
        color: By camera, (n, H, W, 3) uint8 at 60 Hz of world time.
        depth: By camera, (n, H, W) uint16, registered to colour.
        intrinsics: Of both images of both cameras.
        joint_names: As in the station file.
        joints_rad: (m, joints) at 500 Hz of world time.
        gh_from_arm: (m, 3, 3), likewise.
    """

    epoch_ns: int
    color: dict[str, np.ndarray]
    depth: dict[str, np.ndarray]
    intrinsics: Intrinsics
    joint_names: tuple[str, ...]
    joints_rad: np.ndarray
    gh_from_arm: np.ndarray

    def world_s(self, t_ns: int) -> float:
        """World time at an instant of the monotonic clock."""
        duration_ns = round(DURATION_S * 1e9)
        passed_ns = (t_ns - self.epoch_ns) % (2 * duration_ns)
        return min(passed_ns, 2 * duration_ns - passed_ns) * 1e-9

    def frame_time_ns(self, j: int) -> int:
        """When the cameras expose frame `j`."""
        return self.epoch_ns + round(j * 1e9 / FRAME_RATE_HZ)

    def frame_index(self, j: int) -> int:
        """Which of the images frame `j` is."""
        return round(self.world_s(self.frame_time_ns(j)) * FRAME_RATE_HZ)

    def joints_at(self, t_ns: int) -> list[float]:
        """Joint angles at an instant, radians."""
        at = self.world_s(t_ns) * TRUTH_RATE_HZ
        return [float(np.interp(at, np.arange(len(column)), column)) for column in self.joints_rad.T]

    def error_deg(self, t_ns: int, quaternion_wxyz: list[float]) -> float:
        """Angle between a published orientation and the true one."""
        from scipy.spatial.transform import Rotation, Slerp  # the fixtures' processes start sooner without

        at = self.world_s(t_ns) * TRUTH_RATE_HZ
        k = min(int(at), len(self.gh_from_arm) - 2)
        truth = Slerp([k, k + 1], Rotation.from_matrix(self.gh_from_arm[k : k + 2]))(at)
        w, x, y, z = quaternion_wxyz
        return float(np.degrees((truth.inv() * Rotation.from_quat([x, y, z, w])).magnitude()))


def movement_s(world_s: float) -> float:
    """Time of the movement at a world time: at its own pace, but from rest and to rest at both ends."""
    half_s = TURN_S / 2.0
    near_s = min(world_s, DURATION_S - world_s, half_s)
    slowed_s = near_s * near_s / TURN_S
    if near_s == half_s:
        return world_s - half_s / 2.0
    return slowed_s if world_s < half_s else DURATION_S - half_s - slowed_s


def write_scene(folder: Path, epoch_ns: int) -> None:
    """Simulate the scene (needs the extra `sim`) and write it, with the station file that belongs to it."""
    from dataclasses import replace

    from ghest_rt.config.shipped import shipped_config_dir
    from ghest_rt.simulation.building import build_world
    from ghest_rt.simulation.options import SimulateOptions
    from ghest_rt.simulation.sensors import PAPER, SENSOR_SETS, SensorSet

    camera = replace(
        PAPER.camera,
        rate_hz=float(FRAME_RATE_HZ),
        depth_unit_m=DEPTH_UNIT_M,
        color_noise=2.0,
        depth_noise_m=2e-4,
        supersampling=4,
    )
    SENSOR_SETS["hil"] = SensorSet("hil", camera, PAPER.encoders)
    config = shipped_config_dir()
    text = (config / "station-sim.toml").read_text()
    (folder / "armeo_spring.urdf").write_text((config / "armeo_spring.urdf").read_text())
    (folder / STATION_FILE).write_text(text)
    world = build_world(
        SimulateOptions(
            out=Path(),
            movement="COMB",
            sensor="hil",
            seed=11,
            duration_s=DURATION_S + 0.1,
            station=folder / STATION_FILE,
        )
    )
    start_ns = world.timeline.start_ns
    frames = round(DURATION_S * FRAME_RATE_HZ) + 1
    arrays: dict[str, np.ndarray] = {}
    for name in ("r0", "r1"):
        images = [world.render(name, start_ns + round(movement_s(k / FRAME_RATE_HZ) * 1e9)) for k in range(frames)]
        arrays[f"color_{name}"] = np.stack([image.color_rgb for image in images])
        arrays[f"depth_{name}"] = np.stack([image.depth_counts for image in images if image.depth_counts is not None])
    samples = round(DURATION_S * TRUTH_RATE_HZ) + 1
    truth = [world.truth_at(start_ns + round(movement_s(k / TRUTH_RATE_HZ) * 1e9)) for k in range(samples)]
    joints = world.encoder_info().joint_names
    arrays["joints_rad"] = np.array([[sample.joints_rad[joint] for joint in joints] for sample in truth])
    arrays["gh_from_arm"] = np.stack([sample.gh_from_arm for sample in truth])
    np.savez(folder / "scene.npz", **arrays)
    pinhole = world.camera_info("r0").color
    facts = {
        "epoch_ns": epoch_ns,
        "joints": joints,
        "pinhole": [pinhole.width_px, pinhole.height_px, pinhole.fx_px, pinhole.fy_px, pinhole.cx_px, pinhole.cy_px],
        "settings_m": world.station.config.exoskeleton.settings_m,
    }
    (folder / "scene.json").write_text(json.dumps(facts))


def read_scene(folder: Path) -> Scene:
    """Read what `write_scene` wrote."""
    facts = json.loads((folder / "scene.json").read_text())
    with np.load(folder / "scene.npz") as arrays:
        return Scene(
            facts["epoch_ns"],
            {name: arrays[f"color_{name}"] for name in ("r0", "r1")},
            {name: arrays[f"depth_{name}"] for name in ("r0", "r1")},
            Intrinsics(*facts["pinhole"]),
            tuple(facts["joints"]),
            arrays["joints_rad"],
            arrays["gh_from_arm"],
        )
