"""Statements of the paper put to the test: named, with a verdict, the figures behind it and why."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """One statement.

    Attributes:
        name: What is claimed, and where the paper claims it.
        holds: Whether it holds here; None where what was played is too short to say.
        evidence: The figures behind the verdict.
        explanation: Why it holds, or why not.
    """

    name: str
    holds: bool | None
    evidence: str
    explanation: str
