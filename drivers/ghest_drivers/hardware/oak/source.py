"""Where the images come from: the nodes that run on a device."""

from dataclasses import dataclass
from typing import Protocol

from ghest_drivers.errors import DeviceNotFound, DriverError
from ghest_drivers.hardware.oak.devices import find_device
from ghest_drivers.hardware.oak.sdk import dai
from ghest_drivers.hardware.oak.settings import OakSettings
from ghest_drivers.hardware.oak.sockets import choose_sockets

DEPTH_UNIT_M = 0.0001
_STEREO_SIZE_PX = (640, 400)


@dataclass(frozen=True, slots=True)
class Images:
    """A pipeline, not yet started, with the inputs of its host part connected.

    Attributes:
        pipeline: The SDK's pipeline.
        model: Product name.
        serial: Device id.
    """

    pipeline: "dai.Pipeline"
    model: str
    serial: str


class Source(Protocol):
    """Makes a pipeline whose colour and depth images reach a Sync node."""

    def connect(self, settings: OakSettings) -> tuple[Images, "dai.node.Sync"]:
        """Return the pipeline and its Sync node, with inputs "color" and, if depth is asked for, "depth" linked.

        Raises:
            DeviceNotFound: No such device, or it does not start.
            DriverError: It lacks what the settings ask for.
        """
        ...

    def temperature_c(self) -> float | None:
        """Return the device's temperature, degrees Celsius; None where it does not tell."""
        ...

    def release(self) -> None:
        """Let go of the device; the pipeline has stopped."""
        ...


class ConnectedOak:
    """A device on USB, chosen by its id."""

    def __init__(self, mxid: str) -> None:
        self._mxid = mxid
        self._device: dai.Device | None = None

    def connect(self, settings: OakSettings) -> tuple[Images, "dai.node.Sync"]:
        """Boot the device and lay out its nodes."""
        found = find_device(self._mxid)
        try:
            device = self._device = dai.Device(found)
        except RuntimeError as error:
            raise DeviceNotFound(f"OAK camera {self._mxid} does not start: {error}") from error
        if device.getPlatform() != dai.Platform.RVC2:
            raise DriverError(f"{device.getPlatformAsString()} devices are not supported: use an OAK-D or an OAK-D SR (RVC2)")
        pipeline = dai.Pipeline(device)
        sync = pipeline.create(dai.node.Sync)
        _lay_out(pipeline, device, sync, settings)
        return Images(pipeline, str(device.getProductName()), self._mxid), sync

    def temperature_c(self) -> float | None:
        """Return the mean of the chip's sensors."""
        return None if self._device is None else float(self._device.getChipTemperature().average)

    def release(self) -> None:
        """Close the device."""
        device, self._device = self._device, None
        if device is not None:
            device.close()


def _lay_out(pipeline: "dai.Pipeline", device: "dai.Device", sync: "dai.node.Sync", settings: OakSettings) -> None:
    sockets = choose_sockets(device.getConnectedCameraFeatures())
    size_px = (settings.width_px, settings.height_px)
    cameras = {
        socket: pipeline.create(dai.node.Camera).build(socket, sensorFps=float(settings.rate_hz))
        for socket in ({sockets.color, sockets.left, sockets.right} if settings.depth else {sockets.color})
    }
    for camera in cameras.values():
        if settings.auto_exposure:
            camera.initialControl.setAutoExposureEnable()
        elif settings.exposure_us is not None:
            camera.initialControl.setManualExposure(settings.exposure_us, settings.sensitivity_iso)
    # Undistorted by the device, so that colour is a pinhole image like the depth image aligned to it.
    color = cameras[sockets.color].requestOutput(size_px, dai.ImgFrame.Type.RGB888i, enableUndistortion=True)
    color.link(sync.inputs["color"])
    if not settings.depth:
        return
    stereo = pipeline.create(dai.node.StereoDepth)
    stereo.setDefaultProfilePreset(dai.node.StereoDepth.PresetMode.ROBOTICS)
    stereo.setLeftRightCheck(True)
    stereo.setSubpixel(True)
    stereo.setExtendedDisparity(settings.extended_disparity)
    stereo.initialConfig.setDepthUnit(dai.LengthUnit.CUSTOM)
    stereo.initialConfig.setCustomDepthUnitMultiplier(1.0 / DEPTH_UNIT_M)
    cameras[sockets.left].requestOutput(_STEREO_SIZE_PX, dai.ImgFrame.Type.GRAY8).link(stereo.left)
    cameras[sockets.right].requestOutput(_STEREO_SIZE_PX, dai.ImgFrame.Type.GRAY8).link(stereo.right)
    color.link(stereo.inputAlignTo)
    stereo.depth.link(sync.inputs["depth"])
