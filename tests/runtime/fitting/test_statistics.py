"""The covariance of a fit against formulas of textbooks."""

import numpy as np
import pytest

from mechc.fitting.losses import loss_of
from mechc.fitting.statistics import statistics_of


def test_the_variance_of_a_location_by_hubers_loss():
    """Huber & Ronchetti (2009), 7.6: psi(r) is r cut to -k ... k, and psi' is 1 where it is not."""
    k, n = 1.2, 40
    r = np.random.default_rng(4).standard_t(2, size=n)
    psi, inside = np.clip(r, -k, k), (np.abs(r) < k).mean()
    assert 0.5 < inside < 0.95
    factor = 1.0 + (1.0 - inside) / (n * inside)
    variance = factor**2 * (psi**2).sum() / (n - 1) / inside**2 / n
    found = statistics_of(
        np.ones((n, 1)), r, loss_of("huber", k), absolute=False, sizes=np.ones(1),
        active=np.zeros(1, dtype=bool), labels=["m"], rounding=0.0,
    )  # fmt: skip
    assert found.covariance[0, 0] == pytest.approx(variance, rel=1e-12)
