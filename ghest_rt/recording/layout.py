"""What a recording holds and under which names: docs/recording-format.md in code."""

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet

FORMAT_VERSION = "1"
PROFILE = "ghest"
FACTS = "ghest"
GRID = "ghest.grid"
GRID_T_0_NS = "t_0_ns"
STATION_ATTACHMENT = "station.toml"
URDF_ATTACHMENT = "exoskeleton.urdf"

ENCODER_TOPIC = "/encoders/joints"
TRUTH_TOPIC = "/truth/state"
# What was published meanwhile; not read back.
ANGLES_TOPIC = "/gh/angles"
HEALTH_TOPIC = "/health"
EVENTS_TOPIC = "/events"

IMAGE_SCHEMA: str = RawImage.DESCRIPTOR.full_name
CALIBRATION_SCHEMA: str = CameraCalibration.DESCRIPTOR.full_name
CAMERA_SCHEMA = "ghest.CameraInfo"
DEVICE_TIME_SCHEMA = "ghest.DeviceTime"
ENCODER_SCHEMA = "ghest.EncoderSample"
TRUTH_SCHEMA = "ghest.Truth"


def color_topic(camera: str) -> str:
    """Return the topic of a camera's colour images."""
    return f"/{camera}/color/image"


def depth_topic(camera: str) -> str:
    """Return the topic of a camera's depth images."""
    return f"/{camera}/depth/image"


def color_calibration_topic(camera: str) -> str:
    """Return the topic of a camera's colour calibration."""
    return f"/{camera}/color/calibration"


def depth_calibration_topic(camera: str) -> str:
    """Return the topic of a camera's depth calibration."""
    return f"/{camera}/depth/calibration"


def camera_topic(camera: str) -> str:
    """Return the topic of a camera's facts."""
    return f"/{camera}/info"


def device_time_topic(camera: str) -> str:
    """Return the topic of the raw device times of a camera's frames."""
    return f"/{camera}/device_time"


def image_schema_data() -> bytes:
    """Return the FileDescriptorSet of foxglove.RawImage."""
    return _descriptor_set(RawImage.DESCRIPTOR.file)


def calibration_schema_data() -> bytes:
    """Return the FileDescriptorSet of foxglove.CameraCalibration."""
    return _descriptor_set(CameraCalibration.DESCRIPTOR.file)


def _descriptor_set(file: FileDescriptor) -> bytes:
    """Return the file and all it imports, imports first, as viewers expect it in a protobuf schema record."""
    files: dict[str, FileDescriptor] = {}

    def add(one: FileDescriptor) -> None:
        for imported in one.dependencies:
            add(imported)
        files.setdefault(one.name, one)

    add(file)
    found = FileDescriptorSet()
    for one in files.values():
        one.CopyToProto(found.file.add())
    return bytes(found.SerializeToString(deterministic=True))
