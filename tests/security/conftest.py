"""A clinic and its attacked station, made once."""

from collections.abc import Iterator

import pytest

from tests.security.clinic import Clinic, make_clinic
from tests.security.target import Target, attacked


@pytest.fixture(scope="session")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Clinic:
    return make_clinic(tmp_path_factory.mktemp("clinic"))


@pytest.fixture(scope="module")
def target() -> Iterator[Target]:
    with attacked() as one:
        yield one
