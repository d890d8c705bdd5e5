"""Why a track has nothing to say about an instant."""

from enum import StrEnum


class Miss(StrEnum):
    """Why there is no value at the instant asked for."""

    EMPTY = "empty"  # nothing has come yet
    TOO_EARLY = "too_early"  # before the first sample held
    NOT_YET = "not_yet"  # after the newest sample
    GAP = "gap"  # between samples that lie too far apart
