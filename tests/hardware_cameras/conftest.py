"""An open RealSense software device; its SDK is imported for the tests that use it alone."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.hardware_cameras.realsense_rig import Rig


@pytest.fixture
def rig() -> "Iterator[Rig]":
    from tests.hardware_cameras.realsense_rig import opened

    with opened() as rig:
        yield rig
