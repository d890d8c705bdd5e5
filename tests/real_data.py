"""Real recordings, which are others' and so not in this repository: the folder that GHEST_RT_REAL_DATA names.

`armeo_recordings/*.csv`: exports of Armeocontrol. `human_motion/*.mot`: recorded movement (docs/rivals.md says where from).
"""

import os
from pathlib import Path

import pytest

VARIABLE = "GHEST_RT_REAL_DATA"


def real_files(pattern: str) -> list[Path]:
    """Return the files of that folder, or skip the test: `pattern` such as "human_motion/*.mot"."""
    folder = os.environ.get(VARIABLE)
    files = sorted(Path(folder).glob(pattern)) if folder else []
    if not files:
        pytest.skip(f"needs {pattern} in a folder that {VARIABLE} names")
    return files
