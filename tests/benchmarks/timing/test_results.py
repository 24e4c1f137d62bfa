"""Figures as JSON has them."""

import json

import numpy as np

from benchmarks.timing import results


def test_json_of_rows_has_no_infinities():
    told = results.finite([{"a": np.float64("inf"), "b": np.int64(3), "c": [float("nan"), 1.0]}])
    assert json.dumps(told, allow_nan=False) == '[{"a": null, "b": 3, "c": [null, 1.0]}]'
