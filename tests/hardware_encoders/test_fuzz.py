"""A short run of the fuzzer; the long one is a command (see fuzz.py)."""

from collections.abc import Callable

import pytest

from tests.hardware_encoders.fuzz import Outcome, fuzz_binary, fuzz_can, fuzz_text


@pytest.mark.parametrize("fuzz", [fuzz_binary, fuzz_text, fuzz_can])
def test_mutated_input_neither_crashes_nor_passes_nor_piles_up(fuzz: Callable[[int, int], Outcome]) -> None:
    outcome = fuzz(5_000, 7)
    assert outcome.wrong == 0
    assert outcome.accepted > 1_000
    assert outcome.most_buffered_bytes <= outcome.allowed_bytes
