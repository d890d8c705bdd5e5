"""For therapy software: the angles of one or several stations, with what is missing or old told apart (docs/subscribing.md)."""

from ghest_rt.client.client import GhestClient
from ghest_rt.client.limits import Limits
from ghest_rt.client.mailbox import Updates
from ghest_rt.client.updates import (
    ConnectionChanged,
    EventReport,
    Gap,
    GapCause,
    HealthReport,
    LinkCause,
    LinkChanged,
    LinkState,
    Refused,
    Restarted,
    Sample,
    Update,
)

__all__ = [
    "ConnectionChanged",
    "EventReport",
    "Gap",
    "GapCause",
    "GhestClient",
    "HealthReport",
    "Limits",
    "LinkCause",
    "LinkChanged",
    "LinkState",
    "Refused",
    "Restarted",
    "Sample",
    "Update",
    "Updates",
]
