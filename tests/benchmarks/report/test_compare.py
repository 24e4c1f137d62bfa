"""Two runs of different days: regressions of mechc, not of the machine."""

from benchmarks.report import compare, page
from tests.support.benchmarks import canned_results
from tests.support.benchmarks.page import read


def times_of(mine, theirs):
    times = {"mechc": {"1e-08": mine}, "heyoka": {"1e-08": theirs}}
    return {"about": {}, "work_precision": {"problems": {"regular": {"times": times}}}}


def test_a_slower_run_is_a_regression_and_a_slower_machine_is_not():
    def verdicts(now, earlier):
        return [(row["verdict"], row["ratio"]) for row in compare.compare(now, earlier)]

    assert verdicts(times_of(2.0, 4.0), times_of(1.0, 2.0)) == [("same", 1.0)]
    assert verdicts(times_of(2.0, 2.0), times_of(1.0, 2.0)) == [("worse", 2.0)]
    assert verdicts(times_of(1.0, 4.0), times_of(1.0, 2.0)) == [("better", 0.5)]
    assert verdicts(times_of(1.2, 2.0), times_of(1.0, 2.0)) == [("same", 1.2)]
    assert verdicts(times_of(None, 2.0), times_of(1.0, 2.0)) == []


def test_counts_are_compared_exactly_or_nearly_and_promises_as_they_are():
    now, earlier = canned_results.results(), canned_results.results()
    assert {row["verdict"] for row in compare.compare(now, earlier)} == {"same"}
    now["costs"]["instructions"][0]["value"] *= 1.05
    now["costs"]["rows"][1]["value"] *= 1.05
    now["growth"]["rows"]["planar"][0]["operations"] -= 1
    now["stress"]["families"][0]["passed"] = False
    now["codes"]["growth"] = 1
    now["work_precision"]["problems"]["regular"]["rows"][3]["label"] = "wrong"
    changed = {row["what"]: row["verdict"] for row in compare.compare(now, earlier)
               if row["verdict"] != "same"}  # fmt: skip
    assert changed == {
        "costs: four_bar, rates (instructions)": "worse",
        "costs: wheel": "worse",
        "growth: planar, 1 links, operations": "better",
        "stress: units": "worse",
        "growth runs through": "worse",
        "regular: auto at 1e-09 is not wrong": "worse",
    }
    text = page.page(now, earlier)
    read(text)
    assert "5 worse, 1 better" in text
