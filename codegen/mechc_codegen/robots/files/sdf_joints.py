"""The graph of frames and the joints of SDFormat: places in the world, and joints of two links.

Input: poses, each relative to another frame, and an element <joint>.  Output: places, and a joint
with its frame on both links.  Source: SDFormat's specification, "Pose frame semantics" (1.7).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import hypot, inf, radians
from xml.etree.ElementTree import Element

from mechc_codegen.description.joints.kinds import kinds_by
from mechc_codegen.description.placement import apply, cross, dot
from mechc_codegen.robots.files.elements import Part
from mechc_codegen.robots.geometry import Place, of_angles, of_quaternion, pose_of, transpose
from mechc_codegen.robots.robot import V3, Mimic, Number, RobotJoint

KINDS = kinds_by("sdf")
WORLD, MODEL = "world", "__model__"
UNBOUNDED = 1e16  # what SDFormat writes for a limit that is none
SQUARE = 1e-9  # the cosine of a right angle
_FELT = ("dynamics/damping", "dynamics/friction", "dynamics/spring_stiffness")
_OF_PHYSICS = ("physics/ode/max_force", "physics/ode/bounce")  # a motor, and rebounds at limits


@dataclass
class FrameGraph:
    """Places by the names of links, joints, frames and models, and the links that they go with.

    Names are those in the outermost model or world: ``inner::link``.  ``hint`` ends the words on a
    name that no frame has.
    """

    links: set[str] = field(default_factory=set)
    hint: str = ""
    _known: dict[str, Place] = field(default_factory=dict)
    _given: dict[str, tuple[Part, str, str]] = field(default_factory=dict)

    def add_link(self, name: str, place: Place) -> None:
        """Add a link with its place in the world."""
        self._known[name] = place
        self.links.add(name)

    def add(self, part: Part, name: str, base: str, carrier: str = "") -> None:
        """Add a frame, whose pose is that against ``base``.

        ``carrier``: the frame with whose link it goes; without one it is a link.
        """
        of_model = f"::{MODEL}"  # whose frame a reference to its bare name means
        names = (name, f"{name}{of_model}", name.removesuffix(of_model))
        if any(each in self._known or each in self._given for each in names):
            part.refuse("has the name of another link, joint, frame or model")
        if not carrier:
            self.links.add(name)
        self._given[name] = (part, base, carrier)

    def place(self, name: str) -> Place:
        """The place in the world; an error names what refers to nothing or back to itself."""
        way, key = dict[str, Part](), self._key(name)
        while key not in self._known:
            part, base, _ = self._given[key]
            self._follow(part, base, way)
            way[key], key = part, self._key(base)
        for each in reversed(way):
            self._known[each] = self._known[key].then(pose_in(way[each]))
            key = each
        return self._known[key]

    def place_of(self, part: Part, name: str) -> Place:
        """The place of a frame to which a part refers, which is refused where there is none."""
        self._follow(part, name, {})
        return self.place(name)

    def link(self, part: Part, name: str) -> str:
        """The link that a frame goes with, to which a part refers."""
        way, key = dict[str, Part](), self._key(name)
        self._follow(part, name, way)
        while key not in self.links:
            part, _, carrier = self._given[key]
            self._follow(part, carrier, way)
            way[key], key = part, self._key(carrier)
        return key

    def _follow(self, part: Part, name: str, way: Mapping[str, Part]) -> None:
        key = self._key(name)
        if key in way:
            part.refuse(f"refers to the frame {name!r}, which leads back to itself")
        if key not in self._known and key not in self._given:
            part.refuse(f"refers to {name!r}, which is no link or frame of the file{self.hint}")

    def _key(self, name: str) -> str:
        """The name; of a model that of its frame."""
        known = name in self._known or name in self._given
        return name if known else f"{name}::{MODEL}"


def pose_in(part: Part, tag: str = "pose") -> Place:
    """The place that an element <pose> gives."""
    element = part.child(tag)
    if element is None:
        return Place()
    form, words = element.get("rotation_format") or "euler_rpy", (element.text or "").split()
    if form not in ("euler_rpy", "quat_xyzw"):
        part.refuse(f"has the rotation_format {form[:60]!r}, neither euler_rpy nor quat_xyzw")
    quaternion = form == "quat_xyzw" and words
    x, y, z, *turn = part.numbers_of(tag, 7 if quaternion else 6) if words else [0] * 6
    if quaternion:
        size = hypot(*turn) or part.refuse("has a quaternion of length zero")
        qx, qy, qz, qw = (each / size for each in turn)
        return Place(of_quaternion(qw, qx, qy, qz), (x, y, z))
    if part.truth(element.get("degrees"), "degrees"):
        turn = [radians(angle) for angle in turn]
    return Place(of_angles(turn), (x, y, z))


def base_in(element: Element | None, scope: str, default: str) -> str:
    """The frame that a pose is relative to."""
    names = [] if element is None else [element.get("relative_to"), element.get("frame")]
    return next((name_within(scope, each) for each in names if each), default)


def name_within(scope: str, name: str) -> str:
    return name if name == WORLD else scope + name


def sdf_joint(
    part: Part, frames: FrameGraph, scope: str = "", in_model: bool = False
) -> tuple[RobotJoint, list[str]]:
    """A joint, whose frame ``frames`` have, and what of it is not taken.

    ``in_model``: axes are those of the model, as before SDFormat 1.5.

    Raises
    ------
    MechanismError
        If it is of another type, lacks something, or joins what is no link.
    """
    kind, name = part.element.get("type", ""), scope + part.name
    if kind not in KINDS:
        part.refuse(f"has the type {kind!r}; known are {', '.join(KINDS)}")
    row, place = KINDS[kind], frames.place(name)
    parent, child = (
        frames.link(part, name_within(scope, part.words_of(tag))) for tag in ("parent", "child")
    )
    axis: V3 = (1, 0, 0)
    if row.name == "universal":
        first, second = (_axis(part, tag, frames, scope, in_model) for tag in ("axis", "axis2"))
        if abs(dot(first, second)) > SQUARE:
            part.refuse("has axes that are not perpendicular")
        place = place.then(Place(transpose([first, second, cross(first, second)])))
    elif row.has_axis:
        axis = _axis(part, "axis", frames, scope, in_model)
    sides = [pose_of(frames.place(link).inverse().then(place)) for link in (parent, child)]
    joint = RobotJoint(name, row.name, parent, child, sides[0], axis, child_origin=sides[1])
    physics = [
        f"{tag.rpartition('/')[2]} of the joint {name}"
        for tag in _OF_PHYSICS
        if number_in(part, tag, 0)
    ]
    if not row.unit:
        return joint, [*_untaken(part, joint), *physics]
    joint, skipped = _with_values(part, joint, scope)
    return joint, [*skipped, *physics]


def _axis(part: Part, tag: str, frames: FrameGraph, scope: str, in_model: bool) -> V3:
    """The direction of an axis, in the joint's frame."""
    given = part.child(f"{tag}/xyz")
    x, y, z = part.numbers_of(f"{tag}/xyz", 3) if given is not None else (0, 0, 1)
    frame = "" if given is None else given.get("expressed_in", "")
    of_model = in_model or part.truth(
        _text(part, f"{tag}/use_parent_model_frame"), "use_parent_model_frame"
    )
    if not frame and not of_model:
        return part.direction((x, y, z))
    base = frames.place_of(part, name_within(scope, frame or MODEL))
    in_world = apply(base.rotation, (x, y, z))
    a, b, c = apply(transpose(frames.place(scope + part.name).rotation), in_world)
    return part.direction((a, b, c))


def _with_values(part: Part, joint: RobotJoint, scope: str) -> tuple[RobotJoint, list[str]]:
    """The joint with one coordinate, with what its axis says besides."""
    limits, skipped = dict[str, Number](), list[str]()
    lower, upper = (_bound(part, f"axis/limit/{end}") for end in ("lower", "upper"))
    bounded = [abs(lower) < UNBOUNDED, abs(upper) < UNBOUNDED]
    if all(bounded) and joint.kind != "continuous":
        limits |= {"lower": lower, "upper": upper}
        if lower > upper:
            part.refuse(f"has the lower limit {lower} above its upper one, {upper}")
    elif any(bounded) and joint.kind != "continuous":
        skipped.append(f"the limits of the joint {joint.name}, of which one is infinite")
    for what in ("velocity", "effort"):
        bound = _bound(part, f"axis/limit/{what}")
        if 0 <= bound < UNBOUNDED:
            limits[what] = bound
    damping, friction, stiffness = (number_in(part, f"axis/{what}", 0) for what in _FELT)
    if min(damping, friction, stiffness) < 0:
        part.refuse("has damping, friction or stiffness that is negative")
    turns = joint.kind == "revolute" and "lower" not in limits
    return replace(
        joint, kind="continuous" if turns else joint.kind, limits=limits, damping=damping,
        friction=friction, stiffness=stiffness, mimic=_mimic(part, scope),
        rest=number_in(part, "axis/dynamics/spring_reference", 0),
    ), skipped  # fmt: skip


def _mimic(part: Part, scope: str) -> Mimic | None:
    given = part.child("axis/mimic")
    if given is None:
        return None
    multiplier, offset, reference = (
        number_in(part, f"axis/mimic/{each}", default)
        for each, default in (("multiplier", 1), ("offset", 0), ("reference", 0))
    )
    followed = scope + (given.get("joint") or part.refuse("mimics no joint"))
    if (of := given.get("axis", "axis")) != "axis":
        part.refuse(f"mimics the {of[:60]!r} of {followed!r}; a joint with one axis has none")
    return Mimic(followed, multiplier, offset - multiplier * reference)


def _untaken(part: Part, joint: RobotJoint) -> list[str]:
    """Values on the axes of a joint that has several coordinates, or none."""
    axes = ("axis", "axis2")
    found = [
        what.rpartition("/")[2]
        for axis in axes
        for what in (*_FELT, "limit/lower", "limit/upper")
        if 0 != abs(_bound(part, f"{axis}/{what}")) < UNBOUNDED
    ]
    found += ["mimic" for axis in axes if part.child(f"{axis}/mimic") is not None]
    return [f"{what} of the {joint.kind} joint {joint.name}" for what in found]


def number_in(part: Part, tag: str, default: Number) -> Number:
    """The number within an element, the default where there is none."""
    return default if part.child(tag) is None else part.numbers_of(tag, 1)[0]


def _bound(part: Part, tag: str) -> Number:
    return inf if _text(part, tag).lstrip("+-") in ("", "inf") else number_in(part, tag, inf)


def _text(part: Part, tag: str) -> str:
    element = part.child(tag)
    return "" if element is None else (element.text or "").strip().lower()
