"""XML of a URDF as plain nodes with line numbers. No DTD, no entities: a URDF needs none, and they are what XML attacks use."""

from dataclasses import dataclass, field
from xml.parsers import expat

from ghest_rt.errors import BadInputError

# A hundred times what a large robot has: a file beyond it keeps us busy, and is none.
_MAX_BYTES = 1_000_000
_MAX_ELEMENTS = 10_000
_MAX_DEPTH = 32


@dataclass(slots=True)
class Node:
    """One XML element.

    Attributes:
        tag: Element name.
        attributes: As written.
        line: Line of the opening tag, from 1.
        children: Child elements in order.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    children: list["Node"] = field(default_factory=list)

    def child(self, tag: str) -> "Node | None":
        """Return the first child element of that name."""
        return next((node for node in self.children if node.tag == tag), None)


def parse_xml(text: str, source: str) -> Node:
    """Parse XML text into its root node.

    Raises:
        BadInputError: Not well-formed XML, too large, too deep, or it has a DOCTYPE; names `source` and the line.
    """
    if len(text) > _MAX_BYTES:
        raise BadInputError(f"{source}: longer than {_MAX_BYTES} characters; is it the right file?")
    document = Node("", {}, 0)
    open_nodes = [document]
    elements = 0
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal elements
        elements += 1
        if elements > _MAX_ELEMENTS or len(open_nodes) > _MAX_DEPTH:
            raise BadInputError(
                f"{source}:{parser.CurrentLineNumber}: more than {_MAX_ELEMENTS} elements, or {_MAX_DEPTH} within each other; "
                "is it a URDF?"
            )
        node = Node(tag, attributes, parser.CurrentLineNumber)
        open_nodes[-1].children.append(node)
        open_nodes.append(node)

    def end(_tag: str) -> None:
        open_nodes.pop()

    # Entities can only be declared inside a DOCTYPE: refusing it leaves nothing to expand.
    def doctype(*_: object) -> None:
        raise BadInputError(
            f"{source}:{parser.CurrentLineNumber}: <!DOCTYPE>: a URDF may not declare a document type or entities; remove it"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        message = expat.ErrorString(error.code)
        raise BadInputError(f"{source}:{error.lineno}: not well-formed XML ({message}); correct the file") from error
    except ValueError as error:  # a lone surrogate or a NUL
        raise BadInputError(f"{source}: not XML text ({error}); is it the right file?") from error
    return document.children[0]
