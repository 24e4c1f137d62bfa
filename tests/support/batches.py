"""Comparison of batches."""

import numpy as np


def have_the_same_arrays(a, b):
    """To the last bit."""
    assert set(a.arrays) == set(b.arrays)
    for name in a.arrays:
        assert np.array_equal(a[name], b[name], equal_nan=True), name
