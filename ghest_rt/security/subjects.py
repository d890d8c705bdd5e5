"""Pseudonyms of patients: a recording may say which pseudonym it is of, never who that is."""

import re

from ghest_rt.errors import BadInputError

_SUBJECT = re.compile(r"[A-Z]{1,3}-?[0-9]{2,5}")


def check_subject(text: str) -> str:
    """Return a pseudonym that cannot be a name, a date of birth or a hospital's number.

    One to three capital letters and two to five digits: too few letters for a name, too few digits for a date with its year
    or a record number.

    Raises:
        BadInputError: It is no such pseudonym. The text is not repeated, since it may be a name.
    """
    if not _SUBJECT.fullmatch(text):
        raise BadInputError(
            "--subject: not a pseudonym; write one to three capital letters and two to five digits, like P-0042. "
            "No names, initials with dates of birth, or record numbers: the list that says who P-0042 is belongs elsewhere"
        )
    return text
