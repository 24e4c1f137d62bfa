"""A cache of compiled scenes that belongs to the tests alone."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MECHC_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "compiled"))
        yield
