"""A URDF that cannot be used is refused with file, line, element and remedy."""

from pathlib import Path

import pytest

from ghest_rt.errors import BadInputError
from ghest_rt.kinematics.forward import ForwardKinematics
from ghest_rt.kinematics.urdf import parse_urdf

NINE = (Path(__file__).parent / "nine_joints.urdf").read_text()


def robot(*joints: str, links: str = "base a b") -> str:
    return "\n".join(["<robot>", *(f'<link name="{link}"/>' for link in links.split()), *joints, "</robot>"])


def joint(name: str, parent: str, child: str, kind: str = "revolute", extra: str = '<axis xyz="0 0 1"/>') -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{extra}</joint>'


GOOD = robot(joint("j0", "base", "a"), joint("j1", "a", "b"))
LIMIT = '<axis xyz="0 0 1"/><limit lower="-1" upper="1"/>'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["x.urdf:1", "well-formed"]),
        ("<robot>", ["x.urdf:1", "well-formed"]),
        ("not xml", ["x.urdf:1", "well-formed"]),
        ("<robot>\x00</robot>", ["x.urdf"]),
        ("<robot>\ud800</robot>", ["x.urdf"]),
        ('<!DOCTYPE r [<!ENTITY a "b">]>\n<robot/>', ["x.urdf:1", "DOCTYPE", "remove"]),
        ('<!DOCTYPE r SYSTEM "file:///etc/passwd">\n<robot/>', ["x.urdf:1", "DOCTYPE", "remove"]),
        ("<robot>" + "<a>" * 100_000, ["x.urdf:1", "within each other"]),
        ("<robot>" + '<link name="a"/>\n' * 30_000, ["x.urdf:10000", "more than 10000 elements"]),
        ("<robot>" + " " * 2_000_000, ["x.urdf", "longer than 1000000"]),
        ("<sdf/>", ["<sdf>", "<robot>"]),
        ("<robot/>", ["no <link>"]),
        ('<robot><xacro:macro name="m"/></robot>', ["xacro", "expand"]),
        ("<robot><link/></robot>", ["<link>", "name"]),
        (robot(links="base base"), ['"base"', "second"]),
        (robot(links="base a"), ["base, a", "no parent"]),
        (robot(joint("j", "base", "a"), joint("j", "a", "b")), ['"j"', "second"]),
        (robot(joint("j", "nowhere", "a")), ['x.urdf:5: <joint name="j">', '"nowhere"', "not in the file"]),
        (robot(joint("j", "base", "nowhere")), ['"nowhere"']),
        (robot(joint("j", "base", "b"), joint("k", "a", "b")), ['"k"', "already the child", '"j"']),
        (robot(joint("j", "a", "b"), joint("k", "b", "a")), ["own ancestor", "cycle"]),
        (robot(joint("j", "base", "a", kind="screw")), ['"screw"', "revolute"]),
        (robot(joint("j", "base", "a", extra='<axis xyz="0 0 0"/>')), ["<axis>", "zero"]),
        (robot(joint("j", "base", "a", extra='<axis xyz="0 0"/>')), ["<axis>", "three"]),
        (robot(joint("j", "base", "a", extra='<origin xyz="0 0 nan"/>')), ["<origin>", "finite"]),
        (robot(joint("j", "base", "a", extra='<origin rpy="a b c"/>')), ["<origin>", "three numbers"]),
        (robot(joint("j", "base", "a", extra='<limit lower="2" upper="1"/>')), ["<limit>", "swap"]),
        (robot(joint("j", "base", "a", extra='<limit lower="x"/>')), ["<limit>", "lower", "finite"]),
        (robot(joint("j", "base", "a", extra='<mimic joint="ghost"/>')), ['"ghost"', "mimics"]),
        (robot('<joint name="j" type="fixed"><child link="a"/></joint>'), ["<parent>", "add"]),
        (robot('<joint name="j" type="fixed"><parent/><child link="a"/></joint>'), ["<parent>", "link"]),
    ],
)
def test_a_bad_file_is_refused_by_name(text: str, words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        parse_urdf(text, "x.urdf")
    for word in words:
        assert word in str(caught.value)


def fk(
    text: str,
    link: str = "b",
    settings: dict[str, float] | None = None,
    measured: tuple[str, ...] = ("j0", "j1"),
    base: str = "base",
) -> ForwardKinematics:
    return ForwardKinematics(text, "x.urdf", base_link=base, links=[link], settings_m=settings or {}, measured_joints=measured)


CIRCLE = robot(joint("j0", "base", "a", extra='<mimic joint="j1"/>'), joint("j1", "a", "b", extra='<mimic joint="j0"/>'))
SLIDER = robot(joint("j0", "base", "a"), joint("j1", "a", "b", kind="prismatic", extra=LIMIT))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: fk(GOOD, link="l8"), ['no link "l8"', "base, a, b"]),
        (lambda: fk(GOOD, link="base", base="a"), ["not below", '"a"']),
        (lambda: fk(GOOD, measured=("j0",)), ['"j1"', "encoders.joints", "fixed"]),
        (lambda: fk(GOOD, measured=("j0", "j1", "grip")), ['"grip"', "encoders.joints", "j0, j1"]),
        (lambda: fk(GOOD, measured=("j0", "j1", "j0")), ["twice"]),
        (lambda: fk(GOOD, settings={"length": 0.1}), ['"length"', "settings_m"]),
        (lambda: fk(GOOD, settings={"j1": 0.1}), ["settings_m.j1", "revolute", "prismatic"]),
        (lambda: fk(SLIDER, measured=("j0",)), ['"j1"', "settings_m.j1"]),
        (lambda: fk(SLIDER, settings={"j1": 0.1}), ["settings_m.j1", "also in encoders.joints"]),
        (lambda: fk(SLIDER, settings={"j1": 250.0}, measured=("j0",)), ["250 m", "-1 to 1", "millimetres"]),
        (lambda: fk(SLIDER, settings={"j1": float("nan")}, measured=("j0",)), ["settings_m.j1"]),
        (lambda: fk(CIRCLE, measured=()), ["circle"]),
        (lambda: fk(robot(joint("j0", "base", "a"), joint("j1", "a", "b", kind="planar"))), ["planar", "encoders.joints"]),
        (
            lambda: fk(robot(joint("j0", "base", "a"), joint("f", "a", "b", "floating")), measured=("j0",)),
            ["floating", "split"],
        ),
        (
            lambda: fk(NINE, link="branch", settings={"aside": 0.1}, measured=("j0",)),
            ["mimics", '"length"'],
        ),
    ],
)
def test_an_open_or_misnamed_joint_is_refused_by_name(build, words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        build()
    for word in words:
        assert word in str(caught.value)


def test_joints_off_the_path_may_stay_open() -> None:
    text = robot(joint("j0", "base", "a"), joint("spare", "base", "b"))
    assert fk(text, link="a", measured=("j0",)).moves("a")


def test_what_is_not_kinematics_is_ignored() -> None:
    text = GOOD.replace("<robot>", '<robot name="r"><material name="grey"/><gazebo/><!-- <!DOCTYPE in a comment -->')
    assert parse_urdf(text, "x.urdf").root == "base"
