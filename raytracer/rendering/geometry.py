"""Geometry of a picture, drawn at the first access: depth, normal and material of each pixel's centre ray."""

from __future__ import annotations

import pickle
import subprocess
import sys
from contextlib import closing, nullcontext
from typing import Any

import msgspec
import numpy as np

from raytracer.compiler.compiled_scene import CompiledScene, compile
from raytracer.compiler.draws import sample_at
from raytracer.compiler.frame import make_frame
from raytracer.formats.image import Geometry, GeometrySource
from raytracer.gpu.device import Device, shared_device
from raytracer.gpu.turns import ContextError, has_turn, hold_lock, is_cut_off
from raytracer.rendering.programs import find_programs
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tiles import place, split, tile_size
from raytracer.scene.options import SamplingOptions


class GeometryRequest(msgspec.Struct, frozen=True, eq=False):
    """The inputs of a picture's geometry."""

    compiled: CompiledScene
    size: tuple[int, int]
    tile: int  # the side of the largest target in pixels


def draw_geometry(device: Device, request: GeometryRequest) -> Geometry:
    """Draw the geometry of `request`. The device's context must be current.

    Raises InputError if shaders are cut short because they do not terminate, ShaderError for a mistake in `shaders/`.
    """
    width, height = request.size
    # Without shadows and mirrors, no candidate lists of lights are made.
    scene, options = request.compiled.scene, request.compiled.options
    compiled = compile(scene, options.replace(shadows="off", bounces=0), request.compiled)
    frame = make_frame(compiled, request.size, device.limits, plane_only=False)
    geometry = Geometry(
        np.empty((height, width), np.float32),
        np.empty((height, width, 3), np.float32),
        np.empty((height, width), np.int32),
    )
    tile = tile_size(request.size, request.tile, is_drawn_once=True)
    with closing(TileRenderer(device, tile, geometry=True)) as renderer:
        renderer.load(find_programs(device, compiled, None), frame)
        whole = 0, 0, *request.size
        for rectangle in split(whole, tile):
            renderer.draw(rectangle, [sample_at(0, SamplingOptions())])  # at the centre of each pixel
            part = renderer.read_geometry(rectangle[2:])
            for array, values in zip(geometry, part, strict=True):
                array[place(rectangle, whole)] = values
    if frame.view.advance:  # added in float64, because it may be far larger than the distances
        geometry.depth[...] = geometry.depth.astype(np.float64) + frame.view.advance
    return geometry


class DrawnGeometry(GeometrySource):
    """The geometry of `request`, which `device` draws at the first access. Copies of an image share it."""

    def __init__(self, device: Device, request: GeometryRequest) -> None:
        self.shape = request.size[1], request.size[0]
        self._device = device
        self._request: GeometryRequest | None = request  # None once the geometry is drawn
        self._geometry: Geometry | None = None

    def geometry(self) -> Geometry:
        """Return the arrays. The first thread draws, and all other threads wait for it.

        Errors: see draw_geometry(). A forked process and a progress callback cannot use OpenGL: they start
        another process that draws, and raise ContextError if it fails.
        """
        if self._geometry is None:
            within_turn = has_turn()
            is_elsewhere = within_turn or is_cut_off()
            # The only lock is OpenGL's turn. With a lock of this object besides, there would be a deadlock: one thread
            # holds the lock and waits for its turn, while the thread that has the turn needs the same arrays in a
            # progress callback.
            with nullcontext() if within_turn else hold_lock() if is_elsewhere else self._device.turn():
                if self._request is not None:  # another thread may have drawn them meanwhile
                    request, device = self._request, self._device
                    drawn = _draw_in_process(device, request) if is_elsewhere else draw_geometry(device, request)
                    self._geometry, self._request = drawn, None
        assert self._geometry is not None
        return self._geometry


# The program of the other process. It sets sys.path before it unpickles objects, which imports their modules.
_DRAW = """
import os, pickle, sys
output = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # prints go to standard error, so that only the answer is on standard output
sys.path[:], task = pickle.load(sys.stdin.buffer)
from raytracer.rendering.geometry import answer_task
with output:
    answer_task(task, output)
"""


def _draw_in_process(device: Device, request: GeometryRequest) -> Geometry:
    """Draw the geometry of `request` in another process, on the same kind of device."""
    compiled = request.compiled
    task = pickle.dumps((device.backend, device.adapter, compiled.scene, compiled.options, request.size, request.tile))
    message = pickle.dumps((sys.path, task))
    done = subprocess.run([sys.executable, "-c", _DRAW], input=message, capture_output=True, check=False)
    if done.returncode:
        reason = "this process was forked after its parent used OpenGL" if is_cut_off() else "a picture is being drawn"
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        raise ContextError(
            f"{reason}, and the other process that was to draw depth, normal and material failed: "
            f"{lines[-1] if lines else f'exit status {done.returncode}'}"
        )
    result: Geometry | Exception = pickle.loads(done.stdout)
    if isinstance(result, Exception):
        raise result
    return result


def answer_task(task: bytes, output: Any) -> None:
    """Draw the geometry of a pickled task, and write it, or the error, as a pickle. The other process calls this."""
    backend, adapter, scene, options, size, tile = pickle.loads(task)
    result: Geometry | Exception
    try:
        device = shared_device(backend, adapter)
        with device.turn():
            result = draw_geometry(device, GeometryRequest(compile(scene, options), size, tile))
    except Exception as error:  # raised again in the process that started this one
        result = error
    output.write(pickle.dumps(result, pickle.HIGHEST_PROTOCOL))
