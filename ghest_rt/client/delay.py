"""How late samples come, without clocks that agree."""

import math

_BLOCK = 1024  # samples; 15 s, in which 50 ppm of clock drift come to 0.8 ms


class DelayMeter:
    """Measures delays against the quickest of the last one to two thousand samples.

    The difference between the receiver's and the sender's clock is unknown, but the same for all samples; the least one seen
    stands for no delay. A network that becomes slower for good is told as delay for half a minute at most.
    """

    def __init__(self) -> None:
        self._least_before_ns: int | None = None
        self._least_ns: int | None = None
        self._count = 0

    def measure(self, t_received_ns: int, t_publish_ns: int) -> int:
        """Return the delay of a sample, ns.

        Args:
            t_received_ns: Receiver's clock.
            t_publish_ns: Sender's clock.
        """
        difference_ns = t_received_ns - t_publish_ns
        if self._count == _BLOCK:
            self._least_before_ns, self._least_ns, self._count = self._least_ns, None, 0
        self._count += 1
        self._least_ns = difference_ns if self._least_ns is None else min(self._least_ns, difference_ns)
        return difference_ns - self._least()

    def delay_ms(self, t_received_ns: int, t_publish_ns: int) -> float:
        """Return the delay of a sample that took another way, ms; infinite as long as none has been measured."""
        return math.inf if self._least_ns is None else (t_received_ns - t_publish_ns - self._least()) * 1e-6

    def _least(self) -> int:
        return min(least_ns for least_ns in (self._least_ns, self._least_before_ns) if least_ns is not None)
