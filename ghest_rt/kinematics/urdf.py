"""The kinematic part of a URDF: links and joints as one tree."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, rot_x, rot_y, rot_z
from ghest_rt.kinematics.urdf_xml import Node, parse_xml


class JointKind(StrEnum):
    """URDF joint types. Poses are computed for the first four only."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"
    FLOATING = "floating"
    PLANAR = "planar"


@dataclass(frozen=True, slots=True)
class Mimic:
    """This joint's position = multiplier * position of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """One joint.

    Attributes:
        name: Its name.
        kind: Its type.
        parent: Parent link.
        child: Child link; the child's frame is the joint's.
        parent_from_joint: (4, 4) joint frame in the parent link's frame at position zero, metres.
        axis: (3,) unit axis in the joint frame.
        lower: Least position, rad or m; -inf where the URDF states none.
        upper: Greatest position, rad or m; inf where the URDF states none.
        mimic: The joint it follows, if any.
        where: "file:line: <joint name=...>", for messages.
        max_rate: Greatest speed, rad/s or m/s; inf where the URDF states none.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    parent_from_joint: Array
    axis: Array
    lower: float
    upper: float
    mimic: Mimic | None
    where: str
    max_rate: float = math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Urdf:
    """A tree of links.

    Attributes:
        source: Where it came from, for messages.
        root: The link without a parent.
        links: All link names, in the order of the file.
        joints: All joints by name, in the order of the file.
        joint_above: The joint above each link but the root.
    """

    source: str
    root: str
    links: tuple[str, ...]
    joints: dict[str, Joint]
    joint_above: dict[str, Joint]


def parse_urdf(text: str, source: str) -> Urdf:
    """Parse a URDF's links and joints; everything else in it is ignored.

    Raises:
        BadInputError: Not XML, not a URDF, a number or name is bad, or links and joints do not form one tree; names
            `source`, line, element and remedy.
    """
    robot = parse_xml(text, source)
    if robot.tag != "robot":
        raise BadInputError(
            f"{source}:{robot.line}: <{robot.tag}>: the root element of a URDF is <robot>; is it the right file?"
        )
    links: list[str] = []
    joints: dict[str, Joint] = {}
    for node in robot.children:
        if node.tag.startswith("xacro:"):
            raise BadInputError(f"{source}:{node.line}: <{node.tag}>: this is a xacro file; expand it with `xacro` first")
        if node.tag == "link":
            name = _attribute(node, "name", f"{source}:{node.line}: <link>")
            if name in links:
                raise BadInputError(f'{source}:{node.line}: <link name="{name}">: a second link of this name; rename one')
            links.append(name)
        elif node.tag == "joint":
            joint = _joint(node, source)
            if joint.name in joints:
                raise BadInputError(f"{joint.where}: a second joint of this name; rename one")
            joints[joint.name] = joint
    return _tree(source, links, joints)


def _tree(source: str, links: list[str], joints: dict[str, Joint]) -> Urdf:
    if not links:
        raise BadInputError(f"{source}: has no <link>; is it the right file?")
    known = set(links)
    above: dict[str, Joint] = {}
    for joint in joints.values():
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in known:
                raise BadInputError(f'{joint.where}: {role} link "{link}" is not in the file; add it or correct the name')
        if joint.child in above:
            other = above[joint.child].name
            raise BadInputError(f'{joint.where}: link "{joint.child}" is already the child of joint "{other}"; remove one')
        above[joint.child] = joint
        if joint.mimic and joint.mimic.joint not in joints:
            raise BadInputError(f'{joint.where}: mimics "{joint.mimic.joint}", which is not in the file; correct the name')
    for link in links:
        seen = {link}
        at = link
        while at in above:
            at = above[at].parent
            if at in seen:
                raise BadInputError(f'{above[at].where}: link "{at}" is its own ancestor; break the cycle')
            seen.add(at)
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        raise BadInputError(f"{source}: the links {', '.join(roots)} have no parent; connect all but one by joints")
    return Urdf(source, roots[0], tuple(links), joints, above)


def _joint(node: Node, source: str) -> Joint:
    name = _attribute(node, "name", f"{source}:{node.line}: <joint>")
    where = f'{source}:{node.line}: <joint name="{name}">'
    kind_text = _attribute(node, "type", where)
    try:
        kind = JointKind(kind_text)
    except ValueError as error:
        known = ", ".join(JointKind)
        raise BadInputError(f'{where}: unknown type "{kind_text}"; use one of {known}') from error
    origin = node.child("origin")
    axis = np.array([1.0, 0.0, 0.0])
    axis_node = node.child("axis")
    if axis_node is not None:
        axis = _vector(axis_node, "xyz", "1 0 0", where)
    length = float(np.linalg.norm(axis))
    if kind not in (JointKind.FIXED, JointKind.FLOATING) and length < 1e-9:
        raise BadInputError(f"{where} <axis>: the axis is zero; give a direction such as 0 0 1")
    lower, upper = _limits(node, kind, where)
    return Joint(
        name=name,
        kind=kind,
        parent=_link(node, "parent", where),
        child=_link(node, "child", where),
        parent_from_joint=np.eye(4) if origin is None else _origin(origin, where),
        axis=axis / length if length > 0.0 else axis,
        lower=lower,
        upper=upper,
        mimic=_mimic(node, where),
        where=where,
        max_rate=_max_rate(node, where),
    )


def _origin(node: Node, where: str) -> Array:
    roll, pitch, yaw = (float(v) for v in _vector(node, "rpy", "0 0 0", where))
    return transform(rot_z(yaw) @ rot_y(pitch) @ rot_x(roll), _vector(node, "xyz", "0 0 0", where))


def _limits(node: Node, kind: JointKind, where: str) -> tuple[float, float]:
    limit = node.child("limit")
    if limit is None or kind not in (JointKind.REVOLUTE, JointKind.PRISMATIC):
        return -math.inf, math.inf
    lower, upper = _number(limit, "lower", "0", where), _number(limit, "upper", "0", where)
    if lower > upper:
        raise BadInputError(f"{where} <limit>: lower {lower:g} is above upper {upper:g}; swap them")
    return lower, upper


def _max_rate(node: Node, where: str) -> float:
    limit = node.child("limit")
    rate = 0.0 if limit is None else _number(limit, "velocity", "0", where)
    return rate if rate > 0.0 else math.inf  # many files state 0 for "not known"


def _mimic(node: Node, where: str) -> Mimic | None:
    mimic = node.child("mimic")
    if mimic is None:
        return None
    return Mimic(
        _attribute(mimic, "joint", f"{where} <mimic>"),
        _number(mimic, "multiplier", "1", where),
        _number(mimic, "offset", "0", where),
    )


def _link(node: Node, role: str, where: str) -> str:
    child = node.child(role)
    if child is None:
        raise BadInputError(f'{where}: has no <{role}>; add <{role} link="..."/>')
    return _attribute(child, "link", f"{where} <{role}>")


def _attribute(node: Node, name: str, where: str) -> str:
    value = node.attributes.get(name, "")
    if not value:
        raise BadInputError(f'{where}: lacks the attribute {name}; add {name}="..."')
    return value


def _vector(node: Node, name: str, default: str, where: str) -> Array:
    text = node.attributes.get(name, default)
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError as error:
        raise BadInputError(f'{where} <{node.tag}>: {name}="{text}" is not three numbers; correct it') from error
    if values.shape != (3,) or not np.isfinite(values).all():
        raise BadInputError(f'{where} <{node.tag}>: {name}="{text}" is not three finite numbers; correct it')
    return values


def _number(node: Node, name: str, default: str, where: str) -> float:
    text = node.attributes.get(name, default)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInputError(f'{where} <{node.tag}>: {name}="{text}" is not a finite number; correct it')
    return value
