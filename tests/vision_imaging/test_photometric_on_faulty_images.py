"""Method photometric on images with faults of lens, sensor and print: better than refined, and honest about it."""

import cv2
import numpy as np
import pytest

from benchmarks.imaging import bursts, errors
from ghest_rt.vision.photometric.mosaic import MosaicSense

CASES = {
    "none": (),
    "Bayer": ("bayer",),
    "defocus": ("defocus:2",),
    "gamma": ("gamma:1.2",),
    "gain": ("gain:1.15",),
    "several": ("bayer", "defocus:0.8", "wrong-color:12", "gamma:1.1"),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_no_worse_than_refined_and_knows_its_error(case: str) -> None:
    given = list(bursts("paper", CASES[case], "disks", 5, duration_s=6.0))
    (refined, _), (photometric, nees) = errors("refined", given), errors("photometric", given)
    assert len(refined) == len(photometric) == 10
    better = np.sqrt(np.mean(photometric**2, axis=0)) / np.sqrt(np.mean(refined**2, axis=0))
    assert better[0] < (0.5 if "bayer" in CASES[case] else 1.15)
    assert better[1] < (0.5 if "bayer" in CASES[case] else 1.05)
    assert np.mean(nees) < 12.0  # 6 of a perfect covariance


def _scene(rng: np.random.Generator, noise: float) -> np.ndarray:
    picture = np.full((64, 80, 3), 120.0)
    for center, rgb in (((20, 20), (220, 40, 60)), ((52, 22), (120, 180, 30)), ((24, 44), (0, 160, 170))):
        cv2.circle(picture, center, 9, rgb, -1, cv2.LINE_AA)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.6) + rng.normal(0.0, noise, picture.shape), 0, 255)


@pytest.mark.parametrize("noise", [0.0, 4.0])
@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_the_mosaic_s_pattern_is_found_wherever_red_is(row: int, column: int, noise: float) -> None:
    picture = _scene(np.random.default_rng(5), noise)
    expected = np.ones((2, 2), dtype=int)
    expected[row, column], expected[1 - row, 1 - column] = 0, 2
    v, u = np.mgrid[0:64, 0:80]
    raw = np.take_along_axis(picture, expected[v & 1, u & 1][..., None], axis=2)[..., 0]
    code = {
        (0, 0): cv2.COLOR_BayerBG2RGB,
        (0, 1): cv2.COLOR_BayerGB2RGB,
        (1, 0): cv2.COLOR_BayerGR2RGB,
        (1, 1): cv2.COLOR_BayerRG2RGB,
    }
    sense = MosaicSense()
    sense.learn(cv2.cvtColor(np.rint(raw).astype(np.uint8), code[row, column]), (3, 61), (5, 75))
    assert sense.channels is not None
    np.testing.assert_array_equal(sense.channels, expected)


@pytest.mark.parametrize("noise", [0.0, 4.0])
def test_no_pattern_is_found_where_there_is_none(noise: float) -> None:
    sense = MosaicSense()
    for _ in range(3):
        sense.learn(np.rint(_scene(np.random.default_rng(6), noise)).astype(np.uint8), (0, 64), (0, 80))
    assert sense.channels is None
