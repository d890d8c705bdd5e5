"""The object dictionary of a CiA 406 encoder, as far as it is used here."""

from typing import Any

POSITION_VALUE = 0x6004
TPDO_COB_IDS = {1: 0x180, 2: 0x280, 3: 0x380, 4: 0x480}
EVENT_DRIVEN = 254
_TPDO_PARAMETERS = 0x1800
_TPDO_MAPPING = 0x1A00


def object_dictionary(node_id: int, tpdo: int) -> Any:
    """Return the part of CiA 406's object dictionary that is used: the position value and the PDO that carries it."""
    from canopen import objectdictionary as od  # noqa: PLC0415 - only where this backend is chosen

    make_dictionary: Any = od.ObjectDictionary
    dictionary = make_dictionary()
    dictionary.node_id = node_id
    position = od.ODVariable("Position value", POSITION_VALUE)
    position.data_type = od.datatypes.UNSIGNED32
    position.access_type = "ro"
    position.pdo_mappable = True
    dictionary.add_object(position)
    dictionary.add_object(
        _record(
            "TPDO communication parameter",
            _TPDO_PARAMETERS + tpdo - 1,
            (
                ("Highest sub-index supported", 0, od.datatypes.UNSIGNED8, 5),
                ("COB-ID", 1, od.datatypes.UNSIGNED32, TPDO_COB_IDS[tpdo] + node_id),
                ("Transmission type", 2, od.datatypes.UNSIGNED8, EVENT_DRIVEN),
                ("Inhibit time", 3, od.datatypes.UNSIGNED16, 0),
                ("Event timer", 5, od.datatypes.UNSIGNED16, 10),
            ),
        )
    )
    dictionary.add_object(
        _record(
            "TPDO mapping parameter",
            _TPDO_MAPPING + tpdo - 1,
            (
                ("Number of mapped objects", 0, od.datatypes.UNSIGNED8, 1),
                ("Mapped object 1", 1, od.datatypes.UNSIGNED32, POSITION_VALUE << 16 | 32),
                *((f"Mapped object {number}", number, od.datatypes.UNSIGNED32, 0) for number in range(2, 9)),
            ),
        )
    )
    return dictionary


def _record(name: str, index: int, entries: tuple[tuple[str, int, int, int], ...]) -> Any:
    from canopen import objectdictionary as od  # noqa: PLC0415 - only where this backend is chosen

    record = od.ODRecord(name, index)
    for entry_name, subindex, data_type, default in entries:
        variable = od.ODVariable(entry_name, index, subindex)
        variable.data_type = data_type
        variable.access_type = "rw"
        variable.default = default
        record.add_member(variable)
    return record


def add_mapped_objects(dictionary: Any, map_array: Any) -> None:
    """Make known to `dictionary` whatever else a node has mapped into the PDO, so that the bits after it are found.

    `map_array` is the node's TPDO mapping parameter; reads it by SDO.
    """
    from canopen import objectdictionary as od  # noqa: PLC0415 - only where this backend is chosen

    types = {8: od.datatypes.UNSIGNED8, 16: od.datatypes.UNSIGNED16, 32: od.datatypes.UNSIGNED32, 64: od.datatypes.UNSIGNED64}
    for number in range(1, map_array[0].raw + 1):
        entry = map_array[number].raw
        index, bits = entry >> 16, entry & 0xFF
        if index and index not in dictionary:
            variable = od.ODVariable(f"Object {index:04X}h", index)
            variable.data_type = types.get(bits, od.datatypes.UNSIGNED32)
            dictionary.add_object(variable)
