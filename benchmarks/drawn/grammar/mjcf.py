"""Models as MJCF texts: hinges and slides with springs, dampers and armature."""

from __future__ import annotations

from .writer import Writer


def write(w: Writer) -> None:
    """A tree of one to three bodies."""
    count = int(w.rng.choice([1, 2, 3], p=[0.3, 0.4, 0.3]))
    w.note(f"coordinates: {count}")
    text, ends = "", ""
    for k in range(count):
        kind = w.one_of(["hinge", "hinge", "slide"])
        w.note(f"MJCF: {kind}")
        more = "".join(
            f' {key}="{round(w.between(*ends_), 3)}"'
            for key, ends_ in (("stiffness", (0.5, 5.0)), ("damping", (0.05, 0.5)),
                               ("armature", (0.02, 0.2)), ("springref", (-0.5, 0.5)))
            if w.chance(0.35)
        )  # fmt: skip
        if "springref" in more and "stiffness" not in more:
            more += ' stiffness="1.5"'
        axis = " ".join(str(w.one_of([0, 1, 2])) for _ in range(2)) + " 1"
        place, centre = (" ".join(repr(round(w.between(-0.5, 0.5), 2)) for _ in range(3))
                         for _ in range(2))  # fmt: skip
        inertia = " ".join(repr(round(w.between(0.3, 0.5), 3)) for _ in range(3))
        turned = f' euler="{w.whole(-90, 90)} {w.whole(-90, 90)} 0"' if w.chance(0.4) else ""
        text += (
            f'<body name="b{k}" pos="{place}"{turned}>'
            f'<joint name="j{k}" type="{kind}" axis="{axis}"{more}/>'
            f'<inertial pos="{centre}" mass="{round(w.between(0.5, 2.0), 2)}" '
            f'diaginertia="{inertia}"/>'
        )
        w.starts |= {f"q_j{k}": (-0.8, 0.8), f"u_j{k}": (-1.0, 1.0)}
        if w.chance(0.7):
            ends += "</body>"
        else:
            text += "</body>"
    gravity = w.one_of(["0 0 -9.81", "0 -9.8 0", "1 2 -9"])
    w.line("from pathlib import Path")
    w.line("from tempfile import TemporaryDirectory")
    w.line(f'mjcf = """<mujoco model="drawn"><option gravity="{gravity}"/><worldbody>')
    w.line(text + ends)
    w.line('</worldbody></mujoco>"""')
    w.line("with TemporaryDirectory() as folder:")
    w.line('    file = Path(folder, "drawn.xml")')
    w.line('    file.write_text(mjcf, encoding="utf-8")')
    w.line("    described = mechc.from_mjcf(file)")
