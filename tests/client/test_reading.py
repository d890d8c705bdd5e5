"""What later versions of the service publish."""

import json

import pytest

from ghest_rt.client.reading import RefusedError, read_message, read_page
from ghest_rt.messages.published import GhAngles
from tests.client.fakes import message


def document(**changes: object) -> bytes:
    return json.dumps(json.loads(message(3).model_dump_json()) | changes).encode()


def test_fields_that_were_added_are_passed_over() -> None:
    assert read_message(GhAngles, document(scapula_deg={"tilt": 3.0})) == message(3)
    page = b'{"run_id":"a","samples":[' + document(scapula_deg=1) + b"]}"
    assert read_page(page) == [message(3)]


def test_a_later_schema_version_says_so_and_what_to_do() -> None:
    with pytest.raises(RefusedError, match=r"schema version 2.*knows 1.*update"):
        read_message(GhAngles, document(schema_version=2))


@pytest.mark.parametrize("payload", [b"", b"\xff", b"[]", b"{}", b'{"samples": 3}', b'{"samples": [{}]}'])
def test_what_is_no_message_is_named(payload: bytes) -> None:
    with pytest.raises(RefusedError, match="GhAngles"):
        read_message(GhAngles, payload)
    with pytest.raises(RefusedError, match="missing samples"):
        read_page(payload)


def test_a_wrong_value_is_named_with_its_place() -> None:
    with pytest.raises(RefusedError, match="seq"):
        read_message(GhAngles, document(seq="many"))
