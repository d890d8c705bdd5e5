"""What the estimators count as not used, or not plainly, in words (the table in docs/health.md)."""

from collections.abc import Mapping

# Of one sample, and of several.
_SUBJECTS = {
    "encoders": ("encoder row", "encoder rows"),
    "r0": ("frame of r0", "frames of r0"),
    "r1": ("frame of r1", "frames of r1"),
    "m0": ("sighting of m0", "sightings of m0"),
    "m1": ("sighting of m1", "sightings of m1"),
    "frames": ("frame", "frames"),
}
REASONS = {
    "duplicate": "came again under the same time or number",
    "repeated": "came twice",
    "stepped_back": "had a time long before the newest",
    "from_the_future": "had a time after the arrival",
    "wrong_size": "had another number of angles",
    "not_finite": "held no number",
    "beyond_limits": "went beyond the joints' limits",
    "without_encoders": "had no encoder row at the time",
    "without_joints": "had no joint angles at the time",
    "too_late": "came too late",
    "outlier": "did not fit what was foretold",
    "mistaken": "showed that the start was wrong",
}
"""Of what was not used."""
DOUBTED = {
    "jump": "showed that the marker had jumped",
    "regained": "ended a row of misfits",
}
"""Of what was used after a doubt."""


def unused_in_words(unused: Mapping[str, int]) -> str:
    """Say which samples were not used and how many; "" if all were.

    Args:
        unused: Number by the estimator's reason: what it is about, `_`, and the reason.
    """
    left_out: list[str] = []
    doubted: list[str] = []
    for key in sorted(unused):
        about, _, reason = key.partition("_")
        (doubted if reason in DOUBTED else left_out).append(_in_words(about, reason, unused[key]))
    told = (("samples not used: ", left_out), ("used after a doubt: ", doubted))
    return "; ".join(head + ", ".join(parts) for head, parts in told if parts)


def _in_words(about: str, reason: str, count: int) -> str:
    singular, plural = _SUBJECTS.get(about, (about, about))
    what = REASONS.get(reason) or DOUBTED.get(reason) or reason.replace("_", " ")
    return f"{count} {singular if count == 1 else plural} {what}"
