"""URDFs in short, and those that describe no usable arm: what is to be said of them."""

from __future__ import annotations

BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
LIMIT = '<limit lower="-2" upper="1.5" effort="1" velocity="1"/>'


def link(name: str, inside: str = BALL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(
    name: str, parent: str, child: str, type: str = "revolute", inside: str = LIMIT, axis: str = ""
) -> str:
    turned = f'<axis xyz="{axis}"/>' if axis else ""
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{type}">{ends}{turned}{inside}</joint>'


def robot(*elements: str) -> str:
    return '<?xml version="1.0"?><robot name="arm">' + "\n".join(elements) + "</robot>"


def collision(shape: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{shape}</geometry></collision>"


def with_shape(shape: str) -> str:
    return robot(link("a"), link("b", collision(shape)), joint("j", "a", "b"))


A, B, C = link("a"), link("b"), link("c")
AB, BC = joint("ab", "a", "b"), joint("bc", "b", "c")


def limited(limit: str, type: str = "revolute") -> str:
    return robot(A, B, joint("j", "a", "b", type, limit))


def placed(origin: str) -> str:
    return robot(A, B, joint("j", "a", "b", inside=origin + LIMIT))


BAD_URDFS = {
    "empty": ("", "not well-formed XML"),
    "no XML": ("hello", "not well-formed XML"),
    "cut off": (robot(A, B, AB)[:-9], "not well-formed XML"),
    "encoding": ("<?xml version='1.0' encoding='utf-99'?><robot name='a'/>", "encoding"),
    "not a robot": ("<sdf/>", "no <robot> but <sdf>"),
    "xacro": (
        '<robot name="a" xmlns:xacro="http://ros.org/xacro"><xacro:arm/></robot>',
        "expand them first",
    ),
    "xacro of another prefix": (
        '<robot name="a" xmlns:x="http://ros.org/xacro"><x:arm/></robot>',
        "expand them first",
    ),
    "undeclared xacro": ('<robot name="a"><xacro:arm/></robot>', "expand them first"),
    "no name": ("<robot/>", "has no name"),
    "nothing": (robot(), "no joints"),
    "no joints": (robot(A), "no joints"),
    "no moving joint": (robot(A, B, joint("j", "a", "b", "fixed", "")), "none of its joints moves"),
    "no type": (robot(A, B, AB.replace(' type="revolute"', "")), "has no type"),
    "floating": (
        robot(A, B, joint("j", "a", "b", "floating", "")),
        "joint 'j/trans_x' has no limits; say between which corners it moves, volume=",
    ),
    "other type": (robot(A, B, joint("j", "a", "b", "spherical")), "'spherical', which is not"),
    "planar": (robot(A, B, joint("j", "a", "b", "planar", "")), "joint 'j/x' has no limits"),
    "planar with the name of another": (
        robot(A, B, C, joint("j", "a", "b", "planar"), joint("j/y", "b", "c")),
        "two joints called 'j/y'",
    ),
    "misspelt type": (robot(A, B, joint("j", "a", "b", "revolut")), "choose from: revolute"),
    "mimic": (
        robot(A, B, joint("j", "a", "b", inside=LIMIT + '<mimic joint="k"/>')),
        "joint 'j' mimics 'k', which is no joint; choose from: j",
    ),
    "mimic of itself": (
        robot(A, B, joint("j", "a", "b", inside=LIMIT + '<mimic joint="j"/>')),
        "joints 'j' mimic each other",
    ),
    "mimics in a circle": (
        robot(
            *(A, B, C, joint("ab", "a", "b", inside=LIMIT + '<mimic joint="bc"/>')),
            joint("bc", "b", "c", inside=LIMIT + '<mimic joint="ab"/>'),
        ),
        "joints 'ab', 'bc' mimic each other",
    ),
    "mimic of nothing": (
        robot(A, B, joint("j", "a", "b", inside=LIMIT + "<mimic/>")),
        "<mimic> has no joint",
    ),
    "mimic by words": (
        robot(A, B, C, AB, joint("j", "b", "c", inside='<mimic joint="ab" multiplier="x"/>')),
        "multiplier='x' must hold 1 finite",
    ),
    "undefined entity": ("<!DOCTYPE robot SYSTEM 'x'><robot>&x;</robot>", "undefined entity"),
    "unknown parent": (robot(A, B, joint("j", "aa", "b")), "parent 'aa' is no link; did you mean"),
    "unknown child": (robot(A, B, joint("j", "a", "x")), "child 'x' is no link"),
    "no parent": (robot(A, B, AB.replace('<parent link="a"/>', "")), "has no <parent>"),
    "no child": (robot(A, B, AB.replace('<child link="b"/>', "")), "has no <child>"),
    "parent of none": (
        robot(A, B, AB.replace('parent link="a"', "parent")),
        "<parent> has no link",
    ),
    "two roots": (robot(A, B, C, AB), "no joint carries 'a', 'c'"),
    "two parents": (robot(A, B, C, AB, BC, joint("ac", "a", "c")), "child of two joints"),
    "cycle": (robot(A, B, AB, joint("ba", "b", "a")), "cycle among 'a', 'b'"),
    "loop": (robot(A, B, joint("j", "b", "b")), "cycle among 'b'"),
    "cycle beside": (
        robot(A, B, C, link("d"), AB, joint("cd", "c", "d"), joint("dc", "d", "c")),
        "cycle among 'c', 'd'",
    ),
    "two links alike": (robot(A, A, AB), "two links called 'a'"),
    "two joints alike": (robot(A, B, C, AB, joint("ab", "b", "c")), "two joints called 'ab'"),
    "nameless link": (robot(A, "<link/>", AB), "<link> without a name"),
    "nameless joint": (robot(A, B, AB.replace(' name="ab"', "")), "<joint> without a name"),
    "no limit": (limited(""), "has no limits"),
    "no limits of a slide": (limited("", "prismatic"), "has no limits"),
    "hollow limit": (limited('<limit effort="1" velocity="1"/>'), "has no limits"),
    "reversed limits": (limited('<limit lower="1" upper="-1"/>'), "must be below"),
    "reversed slide": (limited('<limit lower="1" upper="-1"/>', "prismatic"), "must be below"),
    "equal limits": (limited('<limit lower="0" upper="0"/>'), "must be below"),
    "NaN limit": (limited('<limit lower="nan" upper="1"/>'), "finite"),
    "infinite limit": (limited('<limit lower="-inf" upper="1"/>'), "finite"),
    "word as limit": (limited('<limit lower="${x}" upper="1"/>'), "finite"),
    "word as effort": (limited('<limit lower="0" upper="1" effort="much"/>'), "not valid URDF"),
    "zero axis": (robot(A, B, joint("j", "a", "b", axis="0 0 0")), "no usable length"),
    "NaN soft limit": (
        limited(LIMIT + '<safety_controller soft_lower_limit="nan"/>'),
        "finite",
    ),
    "NaN axis": (robot(A, B, joint("j", "a", "b", axis="0 0 nan")), "finite"),
    "huge axis": (
        robot(A, B, joint("j", "a", "b", axis="1.5e308 1.5e308 1.5e308")),
        "at most 1e+06",
    ),
    "short axis": (robot(A, B, joint("j", "a", "b", axis="0 1")), "3 finite"),
    "NaN origin": (placed('<origin xyz="0 nan 0"/>'), "finite"),
    "infinite turn": (placed('<origin rpy="0 inf 0"/>'), "finite"),
    "long origin": (placed('<origin xyz="0 0 0 1"/>'), "3 finite"),
    "short turn": (placed('<origin rpy="0 0"/>'), "3 finite"),
    "word in origin": (placed('<origin xyz="0 0 x"/>'), "3 finite"),
    "no collision geometry": (robot(A, link("b", ""), AB), "no link that moves"),
    "no geometry": (robot(A, link("b", "<collision/>"), AB), "needs one <geometry>"),
    "no shape": (with_shape(""), "needs one <geometry>"),
    "capsule of another's": (
        with_shape('<drake:capsule radius="1"/>'),
        "; did you mean 'capsule'?",
    ),
    "misspelt shape": (with_shape('<cylindre radius="1"/>'), "; did you mean 'cylinder'?"),
    "other shape": (
        with_shape("<ellipsoid/>"),
        "link 'b': a <ellipsoid> is not read (a mesh can stand for any); choose from: box, cap",
    ),
    "short capsule": (with_shape('<capsule radius="1" length="0"/>'), "length must be positive"),
    "capsule without length": (with_shape('<capsule radius="1"/>'), "<capsule> has no length"),
    "turned by quaternion": (
        robot(A, link("b", collision('<box size="1 1 1"/>', '<origin quat_xyzw="0 0 1 0"/>')), AB),
        "link 'b': its <origin> has quat_xyzw, which is not read",
    ),
    "NaN place": (
        robot(A, link("b", collision('<box size="1 1 1"/>', '<origin xyz="0 nan 0"/>')), AB),
        "link 'b': xyz='0 nan 0' must hold 3 finite numbers",
    ),
    "visual only": (
        robot(A, link("b", BALL.replace("collision", "visual")), AB),
        "no link that moves has collision geometry; add <collision> elements, or take those it has:"
        " geometry=visual",
    ),
    "quaternion": (placed('<origin quat_xyzw="0 0 1 0"/>'), "has quat_xyzw, which is not read"),
    "no size": (with_shape("<box/>"), "<box> has no size"),
    "flat box": (with_shape('<box size="1 0 1"/>'), "must be positive"),
    "short box": (with_shape('<box size="1 1"/>'), "3 finite"),
    "NaN box": (with_shape('<box size="1 nan 1"/>'), "finite"),
    "no length": (with_shape('<cylinder radius="1"/>'), "<cylinder> has no length"),
    "thin cylinder": (with_shape('<cylinder radius="0" length="1"/>'), "positive"),
    "short cylinder": (with_shape('<cylinder radius="1" length="-1"/>'), "positive"),
    "NaN cylinder": (with_shape('<cylinder radius="1" length="nan"/>'), "finite"),
    "no radius": (with_shape("<sphere/>"), "<sphere> has no radius"),
    "zero sphere": (with_shape('<sphere radius="0"/>'), "must be positive"),
    "negative sphere": (with_shape('<sphere radius="-1"/>'), "must be positive"),
    "NaN sphere": (with_shape('<sphere radius="nan"/>'), "finite"),
    "no file": (with_shape("<mesh/>"), "<mesh> has no filename"),
    "missing mesh": (with_shape('<mesh filename="none.stl"/>'), "no such mesh: none.stl"),
    "missing package": (with_shape('<mesh filename="package://none/none.stl"/>'), "no such mesh"),
    "folder as mesh": (with_shape('<mesh filename="package://none"/>'), "no such mesh"),
    "zero scale": (with_shape('<mesh filename="cube.stl" scale="1 0 1"/>'), "must not be 0"),
    "NaN scale": (with_shape('<mesh filename="cube.stl" scale="nan"/>'), "finite"),
    "two scales": (with_shape('<mesh filename="cube.stl" scale="1 2"/>'), "1 or 3 finite"),
    "format": (with_shape('<mesh filename="arm.urdf"/>'), "meshes are read from"),
}
