"""Bare draws, the floor of users' calls in the benchmarks, make the same pictures as render()."""

from contextlib import closing

import numpy as np
import pytest

import raytracer as rt
from benchmarks.bare import BareDraws, recorded
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.rendering.renderer import Renderer
from tests import scenes

pytestmark = pytest.mark.gl
SIZE = (160, 90)


@pytest.mark.parametrize("settings", [rt.Settings(), rt.Settings(samples=5), rt.Settings(samples=16, adaptive=0.05)])
def test_replayed_draws_make_the_picture_of_render(renderer: Renderer, settings: rt.Settings) -> None:
    scene = scenes.assignment()
    wanted = renderer.render(scene, SIZE, settings)
    with closing(BareDraws(renderer.device, scene, settings, SIZE)) as bare:
        assert np.array_equal(bare.image.radiance, wanted.radiance)
        bare.draw()
        assert bare.is_same() and bare.is_same()
        if settings == rt.Settings():
            (sums,) = bare.draw_and_read()
            assert np.array_equal(sums, wanted.radiance)


def test_only_calls_within_the_block_are_recorded(renderer: Renderer) -> None:
    play = DrawPlayer.play
    with recorded() as calls:
        renderer.render(scenes.assignment(), SIZE, rt.Settings(samples=2), geometry=False)
    assert len([call for call in calls if call.values is None]) > 2
    assert calls[-1].values is not None, "the sums are read last"
    assert not any(call.is_for_screen for call in calls)
    assert DrawPlayer.play is play
