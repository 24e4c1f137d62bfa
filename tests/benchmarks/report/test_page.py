"""The page shows every part, escapes what it shows, and fetches nothing."""

from benchmarks.report.page import page as page_of
from tests.support.benchmarks import canned_results
from tests.support.benchmarks.page import read


def test_the_report_shows_every_part_and_fetches_nothing():
    results = canned_results.results()
    page = page_of(results)
    found = read(page)
    plots = page.count('class="plot"')
    assert plots == len(results["work_precision"]["problems"]) + 2, "two more of growth"
    text = " ".join(found.texts)
    for tool in canned_results.TOOLS:
        assert tool in text
    for part in ("exudyn: not installed", "2 of 2 families", "two cores over one",
                 "four_bar, rates", "heyoka 7.13.2", "abc1234", "avx2"):  # fmt: skip
        assert part in text, part


def test_names_and_texts_are_escaped():
    results = canned_results.results()
    hostile = "<script>alert(1)</script>\"'&"
    problem = results["work_precision"]["problems"].pop("regular")
    problem["rows"][0] |= {"tool": hostile, "method": hostile, "error": 1e-3}
    results["work_precision"]["problems"][hostile] = problem | {"title": hostile, "note": hostile}
    results["stress"]["families"][0]["note"] = hostile
    results["about"]["system"] = hostile
    results["scenes"] = [{hostile: hostile}]
    page = page_of(results)
    assert "<script>alert" not in page
    assert read(page).counts["script"] == 1


def test_parts_that_were_not_run_are_named():
    results = {"about": canned_results.about(), "codes": {}, "seconds": {}}
    page = page_of(results)
    read(page)
    assert page.count("not run") >= 9


def test_a_wrong_branch_is_crossed_and_a_status_is_told():
    page = page_of(canned_results.results())
    assert page.count("another motion than the exact one") == 2, "one of each problem"
    assert "too many steps" in page


def test_rows_of_families_stand_in_sections_of_their_own():
    results = canned_results.results()
    results["stress"]["rows"] = [
        {"family": "near misses", **canned_results.verdict("WRONG")},
        {"family": "exact motion", "case": "dop853, 1e-06, 20 s: error", "error": 1.25e-7},
    ]
    text = " ".join(read(page_of(results)).texts)
    assert "dop853, 1e-06, 20 s: error" in text
    assert "1.25e-07" in text
    assert "Energy and closure over many periods not run" in " ".join(text.split())
    results["stress"]["rows"] = [{"family": "near misses", **canned_results.verdict("right")}] * 7
    assert "gauss8 1e-08 7 7 0" in " ".join(" ".join(read(page_of(results)).texts).split())
