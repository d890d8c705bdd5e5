"""Device faults of a simulated session: what cameras and encoders fail to deliver, and how it is written as an option."""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ghest_drivers.samples import RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.disturbances import number

FaultKind = Literal["blind", "depth-lost", "drop", "late", "encoders-silent"]

_DARK = 6  # of 255: a covered lens
_FORMS: dict[FaultKind, tuple[str, ...]] = {
    "blind": ("CAMERA", "START_S", "DURATION_S"),
    "depth-lost": ("CAMERA", "START_S", "DURATION_S"),
    "drop": ("CAMERA", "FRACTION"),
    "late": ("CAMERA", "FRACTION", "DELAY_S"),
    "encoders-silent": ("START_S", "DURATION_S"),
}
_LIMITS = {
    "START_S": ((0.0, 1e6), "give a second of the movement, not negative"),
    "DURATION_S": ((1e-3, 1e6), "give a positive number of seconds"),
    "FRACTION": ((0.0, 1.0), "give a fraction of the frames from 0 to 1"),
    "DELAY_S": ((0.0, 10.0), "give a delay from 0 to 10 seconds"),
}


@dataclass(frozen=True, slots=True)
class DeviceFault:
    """One fault.

    Attributes:
        kind: "blind": a camera's lens is covered; "depth-lost": its depth images hold no measurement; "drop": frames are lost;
            "late": frames are delivered late; "encoders-silent": no encoder rows.
        camera: Which camera; empty for the encoders.
        start_s: Time of the movement at which it begins ("blind", "depth-lost", "encoders-silent").
        duration_s: How long it lasts (the same).
        fraction: Share of the frames ("drop", "late").
        delay_s: By how much they are late ("late").
        text: As given on the command line.
    """

    kind: FaultKind
    camera: str
    start_s: float
    duration_s: float
    fraction: float
    delay_s: float
    text: str

    def holds(self, t_s: float) -> bool:
        """Return whether the fault lasts at `t_s` of the movement."""
        return self.start_s <= t_s < self.start_s + self.duration_s


def parse_fault(text: str) -> DeviceFault:
    """Return the fault of `--fault KIND:…`.

    Raises:
        BadInputError: It is not of a known form; the text says which part.
    """
    option = f"--fault {text}"
    name, *parts = text.split(":")
    kind = next((kind for kind in _FORMS if kind == name), None)
    if kind is None:
        raise BadInputError(f"{option}: fault {name!r} is unknown: give one of {', '.join(_FORMS)}")
    form = _FORMS[kind]
    if len(parts) != len(form):
        raise BadInputError(f"{option}: {len(parts)} values where {len(form)} belong: give it as {':'.join((kind, *form))}")
    given = dict(zip(form, parts, strict=True))
    camera = given.pop("CAMERA", "")
    values = {part: number(option, part, value, *_LIMITS[part]) for part, value in given.items()}
    return DeviceFault(
        kind=kind,
        camera=camera,
        start_s=values.get("START_S", 0.0),
        duration_s=values.get("DURATION_S", 0.0),
        fraction=values.get("FRACTION", 0.0),
        delay_s=values.get("DELAY_S", 0.0),
        text=text,
    )


class FaultyDevices:
    """Applies faults to what the simulated devices deliver; whether a frame is hit depends on seed, camera and number alone.

    Args:
        faults: The faults.
        cameras: The cameras there are.
        seed: Seeds which frames are hit.
        duration_s: How long the movement is.

    Raises:
        BadInputError: A fault names a camera that is not there, or begins after the end.
    """

    def __init__(
        self, faults: tuple[DeviceFault, ...], cameras: Collection[str], seed: int, duration_s: float = math.inf
    ) -> None:
        for fault in faults:
            if fault.kind != "encoders-silent" and fault.camera not in cameras:
                raise BadInputError(
                    f"--fault {fault.text}: camera {fault.camera!r} is not in the station file: "
                    f"give one of {', '.join(cameras)}"
                )
            if fault.start_s >= duration_s:
                raise BadInputError(
                    f"--fault {fault.text}: begins after the end, {duration_s:g} s: give an earlier second or simulate longer"
                )
        self._faults = faults
        self._seed = seed

    def delivers_frame(self, camera: str, k: int) -> bool:
        """Return whether frame `k` of a camera is delivered at all."""
        return not any(self._hits(index, camera, k) for index, fault in enumerate(self._faults) if fault.kind == "drop")

    def delivers_encoders(self, t_s: float) -> bool:
        """Return whether an encoder row latched at `t_s` of the movement is delivered."""
        return not any(fault.holds(t_s) for fault in self._faults if fault.kind == "encoders-silent")

    def delay_s(self, camera: str, k: int) -> float:
        """Return by how much frame `k` of a camera is delivered late."""
        late = (index for index, fault in enumerate(self._faults) if fault.kind == "late" and self._hits(index, camera, k))
        return sum((self._faults[index].delay_s for index in late), 0.0)

    def spoil(self, frame: RgbdFrame, t_s: float) -> RgbdFrame:
        """Return a frame of `t_s` of the movement as the faulty camera delivers it."""
        for fault in self._faults:
            if fault.camera != frame.info.name or not fault.holds(t_s):
                continue
            empty = None if frame.depth_counts is None else np.zeros_like(frame.depth_counts)
            if fault.kind == "blind":
                frame = replace(frame, color_rgb=np.full_like(frame.color_rgb, _DARK), depth_counts=empty)
            elif fault.kind == "depth-lost":
                frame = replace(frame, depth_counts=empty)
        return frame

    def _hits(self, index: int, camera: str, k: int) -> bool:
        fault = self._faults[index]
        draw = np.random.default_rng((self._seed, *camera.encode(), 3, index, k)).random()
        return fault.camera == camera and draw < fault.fraction
