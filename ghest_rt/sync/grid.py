"""The absolute output grid: t_k = t_0 + round(k * 1e9 / rate), in integers, so that nothing drifts."""

from fractions import Fraction

from ghest_rt.errors import BadInputError


class Grid:
    """Instants at a fixed rate from an anchor on, exact to half a nanosecond for ever."""

    def __init__(self, t_0_ns: int, rate_hz: float) -> None:
        """Anchor the grid.

        Args:
            t_0_ns: The instant of k = 0, host time.
            rate_hz: Instants per second, taken as the decimal number it is written as (66.6 is 333/5).

        Raises:
            BadInputError: The rate is not a positive number.
        """
        if not 0.0 < rate_hz < 1e9:
            raise BadInputError(f"rate_hz = {rate_hz}: must be more than 0; correct it")
        period_ns = 1_000_000_000 / Fraction(repr(float(rate_hz)))
        self._t_0_ns = t_0_ns
        self._numerator = period_ns.numerator
        self._denominator = period_ns.denominator

    def at(self, k: int) -> int:
        """Return t_k, nanoseconds (halves are rounded up)."""
        return self._t_0_ns + (2 * k * self._numerator + self._denominator) // (2 * self._denominator)

    def index_from(self, t_ns: int) -> int:
        """Return the least k with t_k not earlier than `t_ns`."""
        k = (t_ns - self._t_0_ns) * self._denominator // self._numerator
        while self.at(k) >= t_ns:
            k -= 1
        while self.at(k) < t_ns:
            k += 1
        return k
