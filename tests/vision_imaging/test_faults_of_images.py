"""What `ghest-rt simulate --image …` does to the images, and who is told."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.recording.reader import Recording
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.optics import parse_imaging
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.world import World


@cache
def world(*texts: str, sensor: str = "paper") -> World:
    options = SimulateOptions(
        out=Path("unused.mcap"),
        movement="COMB",
        sensor=sensor,  # type: ignore[arg-type]
        seed=4,
        duration_s=1.0,
        imaging=parse_imaging(texts),
    )
    return build_world(options)


def image(*texts: str, k: int = 40) -> np.ndarray:
    frame = world(*texts).frame("r1", k)
    assert frame is not None
    return frame.color_rgb.astype(float)


def plate_pixels(k: int = 40) -> tuple[slice, slice]:
    """Pixels around the plate of m1."""
    info = world().camera_info("r1")
    pose = world().camera_from_marker("r1", world().frame_times("r1", k).color_ns)
    u, v = (info.color.matrix @ (pose[:3, 3] / pose[2, 3]))[:2].round().astype(int)
    return slice(v - 16, v + 17), slice(u - 16, u + 17)


def test_a_mosaic_leaves_one_measured_colour_per_pixel_and_interpolates_the_others() -> None:
    plain, mosaic = image()[2:-2, 2:-2], image("bayer")[2:-2, 2:-2]
    for channel, rows, columns in ((0, 0, 0), (1, 0, 1), (1, 1, 0), (2, 1, 1)):
        np.testing.assert_allclose(mosaic[rows::2, columns::2, channel], plain[rows::2, columns::2, channel], atol=1.0)
    green = mosaic[..., 1]
    around = (green[:-2, 1:-1] + green[2:, 1:-1] + green[1:-1, :-2] + green[1:-1, 2:]) / 4.0
    np.testing.assert_allclose(green[1:-1, 1:-1][::2, ::2], around[::2, ::2], atol=1.0)
    assert np.abs(mosaic - plain).max() > 20.0


def test_defocus_softens_edges_and_keeps_the_light() -> None:
    around = plate_pixels()
    plain, soft = image()[around], image("defocus:1.5")[around]
    steepest = [np.abs(np.diff(picture[..., 0], axis=1)).max() for picture in (plain, soft)]
    assert steepest[1] < 0.8 * steepest[0]
    assert soft.mean() == pytest.approx(plain.mean(), rel=0.01)


def test_a_long_exposure_smears_what_moves_along_its_way() -> None:
    around = plate_pixels()
    short, longer = image()[around], image("motion-blur:0.03")[around]
    assert 2.0 < np.abs(short - longer).max() < 120.0
    np.testing.assert_array_equal(image(), image("motion-blur:0"))


def test_gain_and_gamma_are_those_asked_for() -> None:
    around = plate_pixels()
    plain = image()[around]
    np.testing.assert_allclose(image("gamma:1.3")[around], 255.0 * (plain / 255.0) ** 1.3, atol=1.5)
    np.testing.assert_allclose(image("gain:1.2")[around], np.minimum(1.2 * plain, 255.0), atol=1.5)


def test_wrong_colours_are_on_the_print_and_not_in_the_station_file() -> None:
    around = plate_pixels()
    away = np.abs(image("wrong-color:20")[around] - image()[around])
    assert 14.0 < away.max() < 22.0  # in the room's light
    assert world("wrong-color:20").station.config.markers == world().station.config.markers


def test_distortion_is_told_to_the_calibration_unless_it_is_the_untold_one() -> None:
    told, untold = world("distortion:-0.08"), world("untold-distortion:-0.05")
    assert told.camera_info("r1").color.distortion[0] == -0.08
    assert told.camera_info("r1").depth == told.camera_info("r1").color  # depth stays aligned with colour
    assert untold.camera_info("r1").color == world().camera_info("r1").color
    for bent in (told, untold):
        frame = bent.frame("r1", 40)
        assert frame is not None
        assert np.abs(frame.color_rgb - image()).max() > 50.0


def test_of_a_sensor_with_two_lenses_the_colour_lens_alone_is_bent() -> None:
    plain, bent = (world(*texts, sensor="sr300").camera_info("r0") for texts in ((), ("distortion:0.02",)))
    assert bent.depth == plain.depth
    assert bent.color.distortion[0] == pytest.approx(plain.color.distortion[0] + 0.02)


def test_the_recording_tells_what_was_wrong(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    given = ["--image", "bayer", "--image", "defocus:0.8"]
    command = ["simulate", "--movement", "SFE", "--duration", "0.05", "--out", str(out), *given]
    assert CliRunner().invoke(app, command).exit_code == 0
    facts = Recording(out).facts
    assert facts["image"] == "bayer defocus:0.8"
    assert " ".join(given) in facts["command"]


@pytest.mark.parametrize(
    ("texts", "told"),
    [
        (("blur:1",), r"--image blur:1: 'blur' is unknown: give one of bayer, defocus:PIXELS, motion-blur:SECONDS"),
        (("bayer:1",), r"--image bayer:1: give it as bayer$"),
        (("defocus",), r"--image defocus: give it as defocus:PIXELS"),
        (("defocus:9",), r"PIXELS '9' cannot be used: give the radius of the circle of confusion, 0 to 3 pixels"),
        (("motion-blur:8ms",), r"SECONDS '8ms' cannot be used: give an exposure time from 0 to 0.03 seconds"),
        (("gamma:1.2", "gamma:1.3"), r"--image gamma:1.3: there is another gamma already: give one of a kind"),
    ],
)
def test_what_cannot_be_used_is_told_with_its_remedy(texts: tuple[str, ...], told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        parse_imaging(texts)
