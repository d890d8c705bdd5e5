"""`ghest-rt` with the fixtures' devices in place of the hardware: `python -m tests.hil.service run --station FILE …`.

Everything else is the product: what the station file calls `realsense` or `oak` is made by a fixture, in the factory's table.
"""

from ghest_drivers import factory
from ghest_drivers.factory import Backend


def main() -> None:
    factory.CAMERAS["realsense"] = Backend("tests.hil.realsense_fixture", "supervised", "realsense")
    factory.CAMERAS["oak"] = Backend("tests.hil.oak_fixture", "supervised", "oak")
    from ghest_rt.cli.main import main as ghest_rt

    ghest_rt()


if __name__ == "__main__":
    main()
