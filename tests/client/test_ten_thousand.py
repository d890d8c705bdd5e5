"""Ten thousand samples, two processes, no number lost."""

import json

from tests.client.processes import answer, process, tell
from tests.endpoints import free_endpoint

SAMPLES = 10_000
PERIOD_S = 0.0003


def test_ten_thousand_samples_reach_another_process_without_a_lost_number() -> None:
    endpoint = free_endpoint()
    with (
        process("publish", endpoint, "direct", SAMPLES, PERIOD_S) as station,
        process("subscribe", endpoint, SAMPLES - 1) as subscriber,
    ):
        tell(station)
        heard = json.loads(answer(subscriber))
    assert heard["gaps"] == 0
    assert heard["seqs"] == list(range(heard["seqs"][0], SAMPLES))
    assert heard["seqs"][0] < SAMPLES // 5  # publishing did not wait for the connection
