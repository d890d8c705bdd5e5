"""Where messages go: Zenoh, the live display, a score. Called on the event loop: must be quick, must not raise."""

from typing import Protocol

from ghest_rt.messages.published import Event, GhAngles, Health
from ghest_rt.messages.results import GhEstimate


class Output(Protocol):
    """Receives every message of the service in order."""

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """One sample, as published and as estimated."""
        ...

    def health(self, message: Health) -> None:
        """The service's own state, once a second."""
        ...

    def event(self, message: Event) -> None:
        """Something happened."""
        ...
