"""`ghest-rt` with the fixtures' devices in place of the hardware: `python -m tests.hil.service run --station FILE …`.

Everything else is the product: what the station file calls `realsense` or `oak` is made by a fixture, in the factory's table.
"""

import os
import time

from ghest_drivers import factory
from ghest_drivers.factory import Backend
from tests.hil.injection import Injected, hil_folder

HANGS = "GHEST_HIL_HANGS"  # set: the fault "hang" of the device "service" stops the event loop, and the loop alone


def main() -> None:
    factory.CAMERAS["realsense"] = Backend("tests.hil.realsense_fixture", "supervised", "realsense")
    factory.CAMERAS["oak"] = Backend("tests.hil.oak_fixture", "supervised", "oak")
    from ghest_rt.cli.main import main as ghest_rt

    if HANGS in os.environ:
        _let_the_loop_hang_on_request()
    ghest_rt()


def _let_the_loop_hang_on_request() -> None:
    from ghest_rt.cli.live import LiveView

    injected = Injected(hil_folder(), "service")
    keep = LiveView.angles

    def angles(self: LiveView, message: object, estimate: object) -> None:
        keep(self, message, estimate)  # type: ignore[arg-type]
        if injected.fault(time.monotonic_ns()) == "hang":
            time.sleep(60)

    LiveView.angles = angles  # type: ignore[method-assign]


if __name__ == "__main__":
    main()
