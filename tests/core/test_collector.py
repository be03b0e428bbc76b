"""The pause of Python's garbage collector."""

import gc

import pytest

from raytracer.core.collector import pause_collector


def test_the_collector_is_off_inside_the_block_and_restored_after_it() -> None:
    assert gc.isenabled()
    with pause_collector():
        assert not gc.isenabled()
        with pause_collector():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(KeyError), pause_collector():
        raise KeyError
    assert gc.isenabled()
