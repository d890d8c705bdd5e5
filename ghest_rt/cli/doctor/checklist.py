"""What only a physical device can show, to be gone through once per station. docs/hardware.md says how, item by item."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Item:
    """One thing to try on site.

    Attributes:
        id: Its name, and its heading in docs/hardware.md.
        what: What to see.
        backends: Camera backends that it applies to.
    """

    id: str
    what: str
    backends: tuple[str, ...] = ("realsense", "oak")


CHECKLIST = (
    Item("usb", "every camera on a USB 3 controller of its own, none behind a hub"),
    Item("rate", "60 frames a second for ten minutes, under 1 % missing: ghest-rt doctor --station FILE --live 600"),
    Item("unplug", "pull a camera's cable during a run and plug it in again: frames are back without a restart"),
    Item("hang", "stop a camera's process (kill -STOP): it is replaced, and the hardware reset, within seconds"),
    Item("latency", "capture times against the encoders: swing the arm, no lag between the two; set latency_ms"),
    Item("depth-unit", "a flat board at a measured 0.300 m reads 0.300 m, within 2 mm"),
    Item("depth-lens", "the same board reads flat to the corners: a bowl means that the lens model is read the wrong way"),
    Item("depth-offset", "a marker's depth edge lies on its colour edge, within two pixels, at 0.25 m and 0.5 m"),
    Item("exposure", "exposure_us = 2000 gives a quarter of the brightness of 8000; capture times follow"),
    Item("interference", "depth with both cameras running is as dense as with one", ("realsense",)),
    Item("clock", "80 minutes without a clock_suspect frame: the counter wraps after 71.6", ("realsense",)),
    Item(
        "sockets", "colour is the sensor that is expected, depth is aligned to it, nearest depth as in the data sheet", ("oak",)
    ),
    Item("colours", "the four disks are told apart in the clinic's light, lamps on and off"),
)


def items_for(backends: set[str]) -> tuple[Item, ...]:
    """Return the items that apply to a station with these camera backends."""
    return tuple(item for item in CHECKLIST if backends & set(item.backends))
