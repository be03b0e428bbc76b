"""The pause of Python's garbage collector."""

import gc

import pytest

from raytracer.core.collector import collector_paused


def test_the_collector_is_off_inside_the_block_and_restored_after_it() -> None:
    assert gc.isenabled()
    with collector_paused():
        assert not gc.isenabled()
        with collector_paused():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(KeyError), collector_paused():
        raise KeyError
    assert gc.isenabled()
