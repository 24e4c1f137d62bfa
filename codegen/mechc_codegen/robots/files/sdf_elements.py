"""The elements of SDFormat where a file tells what moves: others are named, not passed over."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

_ANY_VERSION = {
    "world": "actor atmosphere audio frame gravity gui include joint light magnetic_field model "
    "model_state physics plugin population road scene spherical_coordinates state wind",
    "model": "allow_auto_disable enable_wind frame gripper include joint link model model_state "
    "plugin pose self_collide static",
    "link": "audio_sink audio_source battery collision enable_wind frame gravity inertial "
    "kinematic light must_be_base_link particle_emitter pose projector self_collide sensor "
    "velocity_decay visual",
    "inertial": "auto_inertia_params density fluid_added_mass frame inertia mass pose",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "joint": "axis axis2 child frame gearbox_ratio gearbox_reference_body gearbox_reference_link "
    "parent physics pose screw_thread_pitch sensor thread_pitch",
    "axis": "dynamics initial_position limit mimic use_parent_model_frame xyz xyz_expressed_in",
    "dynamics": "damping friction spring_reference spring_stiffness",
    "limit": "dissipation effort lower stiffness upper velocity",
}
_KNOWN = {tag: frozenset(names.split()) for tag, names in _ANY_VERSION.items()}
_KNOWN["axis2"] = _KNOWN["axis"]


def unknown_elements(outermost: Element) -> Iterator[str]:
    """Words for elements of no version; those of other programs, in namespaces, are theirs."""
    waiting = [(outermost, outermost.get("name", ""))]
    while waiting:
        element, name = waiting.pop()
        for child in element:
            own = child.get("name", name)
            if child.tag in _KNOWN:
                waiting.append((child, own))
            elif child.tag not in _KNOWN[element.tag] and ":" not in child.tag:
                yield f"<{child.tag[:60]}> in <{element.tag}> of {name}, which SDFormat has not"
