"""What the doctor says."""

from dataclasses import dataclass
from enum import StrEnum


class State(StrEnum):
    """How something stands."""

    OK = "ok"
    NOTE = "note"  # works, but could be better; or cannot be told from here
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at.

    Attributes:
        check: What was looked at.
        state: How it stands.
        detail: What was found.
        remedy: What to do about it, or "".
        exit_code: What the command shall end with because of it; 0 where nothing depends on it.
    """

    check: str
    state: State
    detail: str
    remedy: str = ""
    exit_code: int = 0


def ok(check: str, detail: str) -> Finding:
    """Return a finding that all is well."""
    return Finding(check, State.OK, detail)


def note(check: str, detail: str, remedy: str = "") -> Finding:
    """Return a finding that stops nothing."""
    return Finding(check, State.NOTE, detail, remedy)


def missing(check: str, detail: str, remedy: str, exit_code: int = 0) -> Finding:
    """Return a finding that something is missing; with an exit code, that it is needed."""
    return Finding(check, State.MISSING, detail, remedy, exit_code)


_SEVEREST_FIRST = (2, 3, 1)  # a bad station file makes all that follows from it doubtful


def exit_code(findings: list[Finding]) -> int:
    """Return what the command ends with."""
    codes = {finding.exit_code for finding in findings}
    return next((code for code in _SEVEREST_FIRST if code in codes), 0)
