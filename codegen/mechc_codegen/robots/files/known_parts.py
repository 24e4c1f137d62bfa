"""The parts that files of robots may contain, and words on all others, by one rule.

A table per format lists elements with their attributes and children.  Named are an element, an
attribute and a text that are not listed, and a second element where there is one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import NamedTuple
from xml.etree.ElementTree import Element

_SHOWN = 60  # letters of a tag or a text
FALSE, TRUE, ZERO = ("", "false", "0"), ("", "true", "1"), ("", "0")


class Schema(NamedTuple):
    """The parts that an element may have; tags of children that may repeat end in ``*``.

    ``read``: children that are looked into, by their own entries; one without an entry has a text
    alone.  ``closed``: children that are not looked into, and attributes without effect, as ``@x``.
    ``neutral``: children that are named where their text, or number, is none of these.
    """

    attributes: str = ""
    read: str = ""
    closed: str = ""
    text: bool = False
    neutral: Mapping[str, tuple[str, ...]] = {}


_POSE, _LINK, _AXIS, _VALUE = Schema("xyz rpy"), Schema("link"), Schema("xyz"), Schema("value")
_TEXT = Schema(text=True)

URDF: Mapping[str, Schema] = {
    "robot": Schema(
        "name",
        "link* joint* constraint* loop_joint* loop* coupling* drake:ball_constraint* gazebo*",
        # pictures; sensors; controllers, with the gears that they reckon with
        "@version material* sensor* transmission* ros2_control*",
    ),
    "link": Schema("name", "inertial", "visual* collision* contact* @type"),  # pictures, contacts
    "inertial": Schema("", "origin mass inertia"),
    "mass": _VALUE,
    "inertia": Schema("ixx ixy ixz iyy iyz izz"),
    "joint": Schema(
        "name type",
        "parent child origin axis dynamics limit mimic",
        # of sensors; of controllers; that links keep their names where the joint is fixed
        # a choice of coordinates
        "calibration safety_controller @dont_collapse @independent",
    ),
    "origin": _POSE,
    "parent": _LINK,
    "child": _LINK,
    "axis": _AXIS,
    "dynamics": Schema("damping friction"),
    "limit": Schema("lower upper velocity effort", closed="@acceleration @deceleration @jerk"),
    "mimic": Schema("joint multiplier offset"),
    "constraint": Schema(
        "name type", "parent child parent_origin child_origin parent_axis child_axis"
    ),
    "parent_origin": _POSE,
    "child_origin": _POSE,
    "parent_axis": _AXIS,
    "child_axis": _AXIS,
    "loop_joint": Schema("name type", "link1 link2 axis"),
    "loop": Schema("name type", "predecessor successor axis"),
    "coupling": Schema("", "predecessor successor ratio", "@name @type"),  # all are alike
    "predecessor": Schema("link", "origin"),
    "successor": Schema("link", "origin"),
    "ratio": _VALUE,
    "link1": Schema("link xyz rpy"),
    "link2": Schema("link xyz rpy"),
    "drake:ball_constraint": Schema(
        "name",
        "drake:ball_constraint_body_A drake:ball_constraint_body_B "
        "drake:ball_constraint_p_AP drake:ball_constraint_p_BQ",
    ),
    "drake:ball_constraint_body_A": Schema("name"),
    "drake:ball_constraint_body_B": Schema("name"),
    "drake:ball_constraint_p_AP": _VALUE,
    "drake:ball_constraint_p_BQ": _VALUE,
    "gazebo": Schema(
        closed="@reference joint* "  # its joints are those of SDFormat
        "plugin* "  # programs
        "material* visual* light* projector* sensor* laserRetro provideFeedback "
        "collision* mu mu1 mu2 fdir1 kp kd maxVel minDepth maxContacts slip1 slip2 "  # contacts
        "selfCollide self_collide "
        "implicitSpringDamper cfmDamping fudgeFactor stopCfm stopErp stopKp stopKd "  # its solver
        # which links Gazebo makes one body of
        "canonicalBody preserveFixedJoint disableFixedJointLumping disableJointLumping",
        neutral={
            "turnGravityOff": FALSE, "gravity": TRUE, "static": FALSE, "kinematic": FALSE,
            "enable_wind": FALSE, "dampingFactor": ZERO, "springStiffness": ZERO,
            "springReference": ZERO,
        },
    ),
}  # fmt: skip

_SDF_AXIS = Schema(
    read="xyz dynamics limit mimic use_parent_model_frame", neutral={"initial_position": ZERO}
)
SDF: Mapping[str, Schema] = {
    "sdf": Schema("version", "world* model*", "light*"),  # of several, the reader refuses the file
    "world": Schema(
        "name",
        "frame* gravity joint* model*",
        # named by the reader; solvers; pictures, sounds and where on earth the world is
        "actor* include* plugin* population* state* wind physics* "
        "atmosphere audio gui light* magnetic_field road* scene spherical_coordinates",
    ),
    "model": Schema(
        "name canonical_link placement_frame",
        "frame* joint* link* model* pose static",
        # named by the reader; names for other programs; contacts; what the world's wind acts on
        "gripper* include* model_state* plugin* @namespace allow_auto_disable self_collide "
        "enable_wind",
    ),
    "link": Schema(
        "name",
        "gravity inertial kinematic pose velocity_decay",
        # pictures, sounds and sensors; contacts and wind; in 1.5 and 1.6, frames of poses, which
        # are refused; with which link Simbody's tree begins
        "visual* light* projector* particle_emitter* audio_sink* audio_source* battery* sensor* "
        "collision* self_collide enable_wind frame* must_be_base_link",
    ),
    "inertial": Schema(
        "auto",
        "inertia mass pose",
        "fluid_added_mass auto_inertia_params density frame*",  # named, or refused with auto
    ),
    "inertia": Schema(read="ixx ixy ixz iyy iyz izz"),
    "velocity_decay": Schema(read="linear angular"),
    "joint": Schema(
        "name type",
        "axis axis2 child parent pose",
        # sensors; settings of solvers, others are named; of gearboxes, named, and screws, refused
        "sensor* physics frame* gearbox_ratio gearbox_reference_body gearbox_reference_link "
        "screw_thread_pitch thread_pitch",
    ),
    "axis": _SDF_AXIS,
    "axis2": _SDF_AXIS,
    "dynamics": Schema(read="damping friction spring_reference spring_stiffness"),
    # closed: how a solver softens the stops
    "limit": Schema(read="effort lower upper velocity", closed="cfm dissipation erp stiffness"),
    "mimic": Schema("joint axis", "multiplier offset reference"),
    "frame": Schema("name attached_to", "pose"),
    "pose": Schema("relative_to frame rotation_format degrees", text=True),
    "xyz": Schema("expressed_in", text=True),
}


def unknown_parts(*roots: Element, table: Mapping[str, Schema]) -> list[str]:
    """Words on what the table does not list in these elements; what is alike has one line."""
    found: dict[str, dict[str, None]] = {}
    waiting = [(root, "the file") for root in roots]
    for element, name in waiting:  # which grows
        known = table.get(element.tag, _TEXT)
        name = element.get("name") or element.get("reference") or name
        for words in _unknown_in(element, known):
            found.setdefault(words, {})[name] = None
        waiting += [(child, name) for child in element if child.tag in _tags(known.read)]
    return sorted(
        f"{words} of {', '.join(names)}, which is not read" for words, names in found.items()
    )


def texts_in(element: Element) -> Iterator[str]:
    """The texts directly in an element, before and after its children."""
    for text in (element.text, *(child.tail for child in element)):
        if text and text.strip():
            yield " ".join(text.strip()[: 2 * _SHOWN].split())[:_SHOWN]


def _unknown_in(element: Element, known: Schema) -> Iterator[str]:
    within, seen = f"in <{_short(element.tag)}>", set[str]()
    listed = _tags(known.read) | _tags(known.closed)
    attributes = known.attributes.split()
    for attribute in element.attrib:
        is_listed = attribute in attributes or f"@{attribute}" in listed
        if not is_listed and attribute.partition(":")[0] != "xmlns":  # which declares a namespace
            yield f"{_short(attribute)}=... {within}"
    for child in element:
        if child.tag in known.neutral:
            if _plain(child.get("value") or child.text or "") not in known.neutral[child.tag]:
                yield f"<{child.tag}> {within}"
        elif child.tag not in listed:
            yield f"<{_short(child.tag)}> {within}"
        elif child.tag in seen and not listed[child.tag]:
            yield f"a second <{child.tag}> {within}"
        seen.add(child.tag)
    if not known.text:
        yield from (f"the text {text!r} {within}" for text in texts_in(element))


def _plain(text: str) -> str:
    """A text in one form: a zero is 0 however many digits it has."""
    try:
        return f"{float(text) + 0.0:g}"
    except ValueError:
        return text.strip().lower()


@cache
def _tags(text: str) -> dict[str, bool]:
    """Tags, and whether each may repeat."""
    return {tag.removesuffix("*"): tag.endswith("*") for tag in text.split()}


def _short(tag: str) -> str:
    return tag[:_SHOWN]
