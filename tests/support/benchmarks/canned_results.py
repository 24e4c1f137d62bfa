"""A results.json as the suite writes it, with figures made up so that every part has its case."""

TOOLS = {
    "mechc": (("auto", 3e-4, 16), ("dop853", 2e-4, 8), ("gauss8", 2.5e-4, 16), ("dopri5", 2e-4, 5)),
    "mechc batch": (("dop853", 5e-5, 8),),
    "heyoka": (("taylor", 6e-4, 20),),
    "heyoka batch": (("taylor", 2e-4, 20),),
    "SciPy, cse": (("DOP853", 5e-2, 8), ("LSODA", 4e-2, 6), ("Radau", 2e-1, 5)),
    "CasADi": (("cvodes", 2e-2, 5), ("idas", 5e-2, 5)),
    "MuJoCo": (("rk4", 3e-3, 4),),
}
TARGETS = ("1e-04", "1e-06", "1e-08", "1e-10", "1e-12")


def results():
    """All scripts have run, and all went well but one run of a peer and one of a method."""
    return {
        "about": about(),
        "size": "quick",
        "codes": {"work_precision": 0, "stress": 0, "growth": 0, "costs": 0},
        "seconds": {"work_precision": 101.0, "stress": 30.0, "growth": 20.5, "costs": 12.0},
        "work_precision": {
            "about": about(),
            "problems": {"regular": problem(1.0), "heavy_top": problem(0.3)},
        },
        "stress": {"about": about(), "families": [family("units", 0.4), family("dead points", 0.9)],
                   "rows": []},
        "failure_rate": [verdict("right"), verdict("right"), verdict("undecided")],
        "near_misses": [verdict("right"), verdict("flagged"), verdict("WRONG")],
        "growth": growth(),
        "batch": [{"what": "trajectories per second", "value": 1e5, "limit": "", "kept": None},
                  {"what": "two cores over one", "value": 1.9, "limit": ">= 1.8", "kept": True}],
        "costs": costs(),
        "first_value": {"forms": [{"form": "by hand", "cold": {"derive": 0.3, "load": 1e-3},
                                   "cached": {"load": 1e-3}}]},
        "essentials": [{"import mechc (s)": 0.14}],
    }  # fmt: skip


def about():
    return {
        "date": "2026-01-02 03:04:05", "commit": "abc1234", "processor": "A & B <processor>",
        "flags": ["avx2", "fma"], "instruction_set": "avx2", "cores": 2, "memory_GiB": 15.5,
        "load": 0.12, "system": "Linux", "python": "3.12.1", "compiler": "cc 12.2.0",
        "versions": {"mechc": "0.1.0", "numpy": "2.4", "heyoka": "7.13.2", "pydy": None},
    }  # fmt: skip


def problem(scale):
    """Curves t ~ error^(-1/order); the last tool ends on another branch at its first tolerance."""
    rows = [
        row(tool, method, 10.0**-k, least * 10 ** (k / order), scale)
        for tool, several in TOOLS.items()
        for method, least, order in several
        for k in range(3, 14, 2)
    ]
    rows[-1] |= {"label": "wrong", "error": 2.0}
    rows[0] |= {"label": "flagged", "error": None, "status": "too many steps"}
    times = {tool: {target: at(tool, target, rows) for target in TARGETS} for tool in TOOLS}
    return {
        "title": "Four-bar <regular>", "note": "Nothing hard.", "t_end": 20.0,
        "quantities": ["theta_0", "theta_1"], "rows": rows,
        "setup": {"mechc": {"derive": 0.5, "compile": 1.0}},
        "skipped": {"exudyn": "not installed"}, "times": times,
    }  # fmt: skip


def row(tool, method, tol, seconds, scale):
    mine = scale if tool.startswith("mechc") else 1.0
    return {
        "tool": tool, "method": method, "tol": tol, "label": "right", "error": 3 * tol,
        "status": "finished", "seconds": seconds / mine, "median": 1.1 * seconds / mine,
        "spread": 0.08, "repeats": 5, "first": 2 * seconds,
    }  # fmt: skip


def at(tool, target, rows):
    """The least time of a tool at an error, as it is between the points above and below."""
    met = [r for r in rows if r["tool"] == tool and r["label"] == "right"]
    return min((r["seconds"] for r in met if r["error"] <= float(target)), default=None)


def family(name, worst):
    return {
        "family": name, "promise": "right, or a status", "runs": 40, "right": 30, "refused": 4,
        "flagged": 5, "unjudged": 1, "wrong": 0, "worst": worst, "worst_case": "1e-9 m, auto",
        "unit": "of the limit", "passed": worst <= 1, "note": "",
    }  # fmt: skip


def verdict(word):
    return {"method": "gauss8", "rtol": 1e-8, "word": word, "error": 1e-9}


def growth():
    def links(n):
        return {"n": n, "links": n, "derive_s": 0.1 * n, "emit_s": 0.2 * n, "first_s": 0.3,
                "whole_s": 1.0 + 0.1 * n, "kilobytes": 3.0 * n, "operations": 100 * n,
                "rhs_us": 0.2 * n, "lane_us": 0.05 * n}  # fmt: skip

    rows = {"planar": [links(n) for n in (1, 2, 5, 10)], "spatial": [links(n) for n in (1, 2, 5)]}
    return {"about": about(), "rows": rows, "exponents": {"planar": {"derive_s": 1.0}},
            "follow": []}  # fmt: skip


def costs():
    return {
        "about": about(),
        "install": {"wheel, bytes": 900_000, "seconds": 30.0},
        "rows": [
            {"what": "import", "value": 0.14, "unit": "s", "limit": 0.5, "kept": True},
            {"what": "wheel", "value": 900_000, "unit": "bytes", "limit": None, "kept": None},
        ],
        "instructions": [{"what": "four_bar, rates", "value": 1200, "unit": "instructions"}],
    }
