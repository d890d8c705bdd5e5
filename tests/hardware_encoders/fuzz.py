"""Mutated input for the decoders: no crash, nothing accepted that was not sent, nothing kept for ever.

A million and more: `python -m tests.hardware_encoders.fuzz --inputs 1000000 --seed 1`.
"""

import argparse
import json
import random
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from ghest_drivers.hardware.encoders.binary_frame import BinaryFrameDecoder, documented_format
from ghest_drivers.hardware.encoders.can_layout import CanDecoder
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats
from ghest_drivers.hardware.encoders.text_line import TextFormat, TextLineDecoder
from tests.hardware_encoders.can_senders import ARMEO_CHANNELS, ARMEO_LAYOUT, armeo_frames

BINARY = documented_format(3)
TEXT = TextFormat(("seq", "time", "a0", "a1", "a2", "status"), delimiter=",", prefix="$ENC,", checksum="crc32")
SOURCES = ("a0", "a1", "a2")
_POOL = 256


@dataclass
class Outcome:
    """What a run of the fuzzer saw.

    Attributes:
        inputs: Mutated inputs fed.
        accepted: Readings that came out.
        wrong: Of those, readings that nobody sent.
        most_buffered_bytes: The most that a decoder kept between calls.
        allowed_bytes: The most that it may.
        seconds: Duration.
    """

    inputs: int
    accepted: int = 0
    wrong: int = 0
    most_buffered_bytes: int = 0
    allowed_bytes: int = 0
    seconds: float = 0.0


def mutate(data: bytes, rng: random.Random) -> bytes:
    """Return `data` with one to four faults: flipped bits, changed, lost, added or repeated bytes, swapped blocks."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(changed) + 1)
        kind = rng.randrange(7)
        if kind == 0 and at < len(changed):
            changed[at] ^= 1 << rng.randrange(8)
        elif kind == 1 and at < len(changed):
            changed[at] = rng.randrange(256)
        elif kind == 2:
            del changed[at : at + rng.randrange(1, 12)]
        elif kind == 3:
            changed[at:at] = rng.randbytes(rng.randrange(1, 12))
        elif kind == 4:
            changed[at:at] = changed[at : at + rng.randrange(1, 60)]
        elif kind == 5:
            start = rng.randrange(len(changed) + 1)
            changed[at:at] = changed[start : start + 20]
        else:
            del changed[at:]
    return bytes(changed)


def _readings(rng: random.Random) -> list[RawReading]:
    return [
        RawReading(
            tuple(rng.randint(-(2**31), 2**31 - 1) for _ in SOURCES),
            rng.randrange(1 << 16),
            rng.randrange(1 << 32),
            rng.randrange(256),
        )
        for _ in range(_POOL)
    ]


def _values(reading: RawReading) -> dict[str, float]:
    angles = dict(zip(SOURCES, reading.counts, strict=True))
    return {"seq": reading.seq or 0, "time": reading.ticks or 0, "status": reading.status, **angles}


def _fuzz_stream(
    decoder: BinaryFrameDecoder | TextLineDecoder,
    encode: Callable[[dict[str, float]], bytes],
    allowed_bytes: int,
    inputs: int,
    rng: random.Random,
) -> Outcome:
    sent = _readings(rng)
    frames = [encode(_values(reading)) for reading in sent]
    known = set(sent)
    outcome = Outcome(inputs, allowed_bytes=allowed_bytes)
    start = time.perf_counter()
    for _ in range(inputs):
        data = b"".join(rng.choices(frames, k=rng.choice((1, 2, 3))))
        for reading in decoder.feed(mutate(data, rng)):
            outcome.accepted += 1
            outcome.wrong += reading not in known
        outcome.most_buffered_bytes = max(outcome.most_buffered_bytes, decoder.buffered_bytes)
    outcome.seconds = time.perf_counter() - start
    return outcome


def fuzz_binary(inputs: int, seed: int) -> Outcome:
    """Feed mutated binary frames."""
    decoder = BinaryFrameDecoder(BINARY, SOURCES, LinkStats())
    return _fuzz_stream(decoder, BINARY.encode, BINARY.size_bytes - 1, inputs, random.Random(seed))


def fuzz_text(inputs: int, seed: int) -> Outcome:
    """Feed mutated text lines."""
    decoder = TextLineDecoder(TEXT, SOURCES, LinkStats())
    return _fuzz_stream(decoder, TEXT.encode, TEXT.max_line_bytes, inputs, random.Random(seed))


def fuzz_can(inputs: int, seed: int) -> Outcome:
    """Feed CAN frames lost, repeated, out of order, of wrong length and with up to two flipped bits each.

    More faults in one frame the eight-bit checksum cannot promise to see; the bus itself has 15 bits more.
    """
    rng = random.Random(seed)
    decoder = CanDecoder(ARMEO_LAYOUT, ARMEO_CHANNELS, LinkStats())
    samples = [(k, [round(rng.uniform(-300, 300), 2) for _ in range(7)]) for k in range(_POOL)]
    frames = [[(f.arbitration_id, bytes(f.data)) for f in armeo_frames(k, k * 15_000_000, angles)] for k, angles in samples]
    outcome = Outcome(inputs)
    start = time.perf_counter()
    for k in range(inputs):
        sample = list(frames[k % _POOL])
        for _ in range(rng.choice((1, 1, 2))):
            at = rng.randrange(len(sample)) if sample else 0
            kind = rng.randrange(5)
            if sample and kind == 0:
                del sample[at]
            elif sample and kind == 1:
                sample.insert(rng.randrange(len(sample) + 1), sample[at])
            elif kind == 2:
                rng.shuffle(sample)
            elif sample and kind == 3 and len(sample[at][1]) == 8:
                frame_id, data = sample[at]
                whole = int.from_bytes(data, "big") ^ (1 << rng.randrange(64))
                sample[at] = (frame_id, whole.to_bytes(8, "big"))
            else:
                sample.insert(at, (rng.choice((384, 385, 386, rng.randrange(2048))), rng.randbytes(rng.randrange(8))))
        for part, (frame_id, data) in enumerate(sample):
            t_ns = k * 15_000_000 + part * 200_000
            whole_reading = decoder.feed(frame_id, data, t_ns, t_ns)
            if whole_reading is not None:
                reading = whole_reading[0]
                outcome.accepted += 1
                wanted = samples[k % _POOL]
                close = all(abs(a - b) < 1e-9 for a, b in zip(reading.counts, wanted[1], strict=True))
                outcome.wrong += not (close and reading.seq == wanted[0] % 256)
    outcome.seconds = time.perf_counter() - start
    return outcome


def main() -> None:
    """Run all three and print what they saw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    runs = {"binary": fuzz_binary, "text": fuzz_text, "can": fuzz_can}
    outcomes = {name: asdict(run(arguments.inputs, arguments.seed)) for name, run in runs.items()}
    sys.stdout.write(json.dumps(outcomes, indent=2) + "\n")


if __name__ == "__main__":
    main()
