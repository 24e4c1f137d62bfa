"""States at 20 s of the library's mechanisms by each method, to the last bit.

python tools/states.py --out before.json
python tools/states.py --against before.json      # exit status 1 where a bit differs
"""

import argparse
import json
import sys

import mechc

T_END = 20.0
SIZES = {"pendulum": {"links": 3}, "windows": {"count": 2}}
METHODS = ("dopri5", "dop853", "gauss8", "radau5", "auto")


def final_states(names):
    """{"mechanism method": how it ended, its steps and its last state in hexadecimal}."""
    states = {}
    for name in names:
        model = mechc.load(name, **SIZES.get(name, {}))
        start = model.assemble()
        for method in METHODS:
            sol = model.simulate(T_END, start, method=method, rtol=1e-8, max_steps=20_000)
            numbers = [sol.t[-1], *sol.y[-1]]
            states[f"{name} {method}"] = [
                sol.status.code,
                sol.stats["steps"],
                *(float(x).hex() for x in numbers),
            ]
            print(name, method, sol.status.code, sol.stats["steps"], flush=True)
    return states


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", help="write the states to this file")
    parser.add_argument("--against", help="compare with the states in this file")
    parser.add_argument("names", nargs="*", help="mechanisms; all by default")
    options = parser.parse_args()
    states = final_states(options.names or mechc.mechanisms())
    if options.out:
        with open(options.out, "w", encoding="utf-8") as file:
            json.dump(states, file, indent=1)
    if options.against:
        with open(options.against, encoding="utf-8") as file:
            before = json.load(file)
        differing = [key for key in states if states[key] != before.get(key)]
        print(f"{len(states) - len(differing)} equal, {len(differing)} differ: {differing}")
        sys.exit(bool(differing))


if __name__ == "__main__":
    main()
