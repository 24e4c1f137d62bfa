"""
A pump as C and as an FMU
=========================

The same mechanism in three programs: simulated here; as C99 that needs no library, for a
controller; and as a functional mock-up unit, for other simulators.  All end in the same state.
"""

import csv
import importlib.util
import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import sympy.physics.mechanics as me

import mechc

frame = me.RigidBody("frame")
crank, plunger = me.RigidBody("crank", mass=2.0), me.RigidBody("plunger", mass=1.5)
crank.central_inertia = me.inertia(crank.frame, 0, 0, 0.02)
shaft = me.PinJoint("shaft", frame, crank, joint_axis=frame.z)
bore = me.PrismaticJoint("bore", frame, plunger, joint_axis=frame.x)
rod = mechc.Cut.rod("rod", crank, plunger, "200 mm", parent_point=0.05 * crank.x)
pump = mechc.from_joints(
    "pump",
    [shaft, bore, rod],
    gravity=-9.81 * frame.y,
    loads=[me.Force(plunger, -40 * bore.speeds[0] * frame.x)],
    motors=[mechc.Motor(shaft, torque=2 - 0.05 * shaft.speeds[0])],
)
model = mechc.compile(pump)
start = model.assemble({"q_shaft": 0.3}, {"u_shaft": 5.0}, guess={"q_bore": 0.24})
sol = model.simulate(2.0, start, rtol=1e-12)
names = [*model.coordinates, *model.speeds]


def compared(program, end):
    apart = max(abs(end[name] - value) for name, value in zip(names, sol.y[-1], strict=True))
    print(f"{program}: the end of the motion differs by {apart:.0e}")
    return apart


# %%
# The exported program takes 20,000 steps of 0.1 ms by Kutta's method and prints a table.

folder = TemporaryDirectory()
path = Path(folder.name)
mechc.export_c(model, path, y0=start)
build = f"{os.environ.get('CC', 'cc')} -std=c99 -O2 -o run pump.c main.c -lm"
subprocess.run(build.split(), cwd=path, check=True)
printed = subprocess.run([path / "run", "2", "1e-4"], capture_output=True, text=True, check=True)
*_, last = csv.DictReader(printed.stdout.splitlines())
assert compared("C", {name: float(last[name]) for name in names}) < 1e-10

# %%
# In an FMU mechc's own integrator goes along.  FMPy, where it is installed, is the simulator.

unit = mechc.export_fmu(model, path / "pump.fmu", y0=start, rtol=1e-12, derivatives=False)
if importlib.util.find_spec("fmpy"):
    import fmpy

    table = fmpy.simulate_fmu(
        str(unit), fmi_type="CoSimulation", stop_time=2.0, output_interval=0.01, output=names
    )
    assert compared("FMU", {name: table[name][-1] for name in names}) < 1e-10
folder.cleanup()
sol.animate()
