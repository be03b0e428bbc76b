"""Bare draws, which the benchmarks compare users' calls with: they make the same picture."""

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
def test_draws_that_are_played_again_make_the_picture_of_render(renderer: Renderer, settings: rt.Settings) -> None:
    scene = scenes.assignment()
    wanted = renderer.render(scene, SIZE, settings).radiance
    with closing(BareDraws(renderer.device, scene, settings, SIZE)) as bare:
        for _ in range(2):
            bare.draw()
            assert np.array_equal(bare.picture(), wanted)


def test_all_draws_of_a_block_are_recorded_and_none_after_it(renderer: Renderer) -> None:
    play = DrawPlayer.play
    with recorded() as plays:
        renderer.render(scenes.assignment(), SIZE, rt.Settings(samples=2), geometry=False)
        assert len(plays) > 2 and not any(each.is_for_screen for each in plays)
    assert DrawPlayer.play is play
