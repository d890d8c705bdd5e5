"""What was not used is told in words, and every reason stands in docs/health.md."""

import re
from pathlib import Path

import pytest

from ghest_rt.cli.unused_words import DOUBTED, REASONS, unused_in_words
from ghest_rt.estimation.fused.filter import Outcome
from ghest_rt.sync.encoder_track import EncoderRejection

HEALTH = (Path(__file__).parents[2] / "docs" / "health.md").read_text(encoding="utf-8")


def test_it_is_told_in_words() -> None:
    assert unused_in_words({}) == ""
    assert unused_in_words({"encoders_repeated": 2}) == "samples not used: 2 encoder rows came twice"
    told = unused_in_words({"m1_jump": 1, "m0_outlier": 1, "r0_duplicate": 3})
    assert told == (
        "samples not used: 1 sighting of m0 did not fit what was foretold, "
        "3 frames of r0 came again under the same time or number; "
        "used after a doubt: 1 sighting of m1 showed that the marker had jumped"
    )


@pytest.mark.parametrize("reason", [*EncoderRejection, *(outcome for outcome in Outcome if outcome is not Outcome.TAKEN)])
def test_every_reason_of_the_estimators_has_words(reason: str) -> None:
    assert reason in REASONS or reason in DOUBTED


@pytest.mark.parametrize("reason", [*REASONS, *DOUBTED])
def test_every_reason_is_documented(reason: str) -> None:
    assert re.search(rf"^\|.*_{reason}`", HEALTH, re.MULTILINE)
