"""The far side of a CAN bus: encoder boxes written for the tests, layouts by cantools."""

from pathlib import Path

import can
import cantools

from ghest_drivers.hardware.encoders.can_layout import CanLayout
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.checksums import crc8_j1850

ARMEO_DBC = (Path(__file__).parents[2] / "config" / "armeo_spring.dbc").read_text(encoding="utf-8")
ARMEO = cantools.database.load_string(ARMEO_DBC, "dbc")
DEG = 0.017453292519943295

ARMEO_SOURCES = (
    "Armeo_Shoulder.InnerShoulder",
    "Armeo_Shoulder.OuterShoulder",
    "Armeo_Shoulder.UpperShoulder",
    "Armeo_Elbow.Elbow",
    "Armeo_Elbow.Forearm",
    "Armeo_Elbow.ProSupination",
    "Armeo_Wrist.FlexionExtension",
)
ARMEO_CHANNELS = tuple(Channel(f"j{k}", source, rad_per_count=DEG) for k, source in enumerate(ARMEO_SOURCES))
ARMEO_LAYOUT = CanLayout(
    ARMEO_DBC,
    time_signal="Armeo_Wrist.DeviceTime",
    time_tick_ns=10_000,
    status_signal="Armeo_Wrist.Status",
    counter_signal="Counter",
    checksum_signal="Checksum",
)


def armeo_frames(seq: int, t_device_ns: int, angles_deg: list[float], status: int = 0) -> list[can.Message]:
    """Return the three frames of one sample."""
    values: dict[str, float] = {
        source.partition(".")[2]: angle for source, angle in zip(ARMEO_SOURCES, angles_deg, strict=True)
    }
    values |= {"Counter": seq % 256, "Checksum": 0, "Status": status, "DeviceTime": t_device_ns // 10_000 % (1 << 24) * 10}
    frames = []
    for message in sorted(ARMEO.messages, key=lambda message: message.frame_id):
        data = message.encode({name: values[name] for name in (signal.name for signal in message.signals)})[:-1]
        data += bytes([crc8_j1850(message.frame_id.to_bytes(2, "little") + data)])
        frames.append(can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False))
    return frames


# The public layout of an ODrive's cyclic encoder message: two 32-bit floats, turns and turns per second, id = node << 5 | 9.
ODRIVE_DBC = """VERSION ""
NS_ :
BS_:
BU_: Master ODrive
BO_ 9 Axis0_Get_Encoder_Estimates: 8 ODrive
 SG_ Pos_Estimate : 0|32@1- (1,0) [0|0] "rev" Master
 SG_ Vel_Estimate : 32|32@1- (1,0) [0|0] "rev/s" Master
SIG_VALTYPE_ 9 Pos_Estimate : 1;
SIG_VALTYPE_ 9 Vel_Estimate : 1;
"""
