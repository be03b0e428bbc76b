"""Rows of the ledger on single rays: grazing and tangent."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.rounding_bounds import UNIT, moment_error
from raytracer.gpu import glsl_call
from raytracer.rendering.renderer import Renderer

_U = UNIT[32]


def tangents(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Rays that pass a sphere's centre at a distance of r (1 -+ 2^-k), along an axis and in random directions."""
    row = "grazing and tangent"
    rng = np.random.default_rng(7)
    for k in (4, 12, 20, 23) if short else range(1, 24):
        # Along an axis all numbers are exact, and so the answer must be exact.
        rays = np.zeros(3, glsl_call.dtype("Ray"))
        rays["ro"] = [(1.0 - 2.0**-k, 0, 5), (1.0 + 2.0**-k, 0, 5), (1.0, 0, 5)]
        rays["rd"] = (0, 0, -1)
        entry, exit = _span(renderer, rays, (0, 0, 0, 1))
        wrong = int(np.sum((entry < exit) != [True, False, False]))
        yield Finding(
            row, f"1 -+ 2^-{k} and 1, along an axis", 32, "wrong hit decisions", wrong, 0, "3 rays; a tangent misses"
        )

        count = 1000
        rays = np.zeros(count, glsl_call.dtype("Ray"))
        rd, across = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in _perpendicular(rng, count))
        radius = np.float32(10.0) ** rng.uniform(-3, 3, count).astype(np.float32)
        sign = rng.choice((-1.0, 1.0), (count, 1))
        offset = across * (1.0 - sign * 2.0**-k)
        rays["ro"] = (offset - rd * rng.uniform(1.5, 9.0, (count, 1))) * radius[:, None]
        rays["rd"] = rd
        spheres = np.zeros((count, 4))
        spheres[:, 3] = radius
        entry, exit = _span(renderer, rays, spheres)
        # The exact answer for the rounded numbers. Rounding makes the length of rd differ from 1.
        ro, rd = rays["ro"].astype(float), rays["rd"].astype(float)
        rd /= np.linalg.norm(rd, axis=1, keepdims=True)
        p = np.linalg.norm(np.cross(ro, rd), axis=1)
        p_error = moment_error(ro, rd, _U)
        sure = np.abs(p - radius) > p_error
        wrong = int(np.sum(((entry < exit) != (p < radius)) & sure))
        at = f"1 -+ 2^-{k}, any direction"
        yield Finding(row, at, 32, "wrong hit decisions", wrong, 0, f"{count} rays, {np.sum(~sure)} doubtful")
        hit = sure & (p < radius) & (entry < exit)
        if hit.any():
            along = -np.sum(ro * rd, axis=1)[hit]
            half = np.sqrt(np.square(radius[hit].astype(float)) - p[hit] ** 2)
            off = np.maximum(np.abs(entry[hit] - (along - half)), np.abs(exit[hit] - (along + half)))
            # The error of p, passed on by the square root, to second order, and the rounding of the sum.
            least = np.square(radius[hit].astype(float)) - (p[hit] + p_error[hit]) ** 2
            by_p = half - np.sqrt(np.maximum(least, 0.0))
            bound = by_p + 8.0 * _U * (np.linalg.norm(ro[hit], axis=1) + half)
            note = f"at most {(off / radius[hit]).max():.1e} radii"
            yield Finding(row, at, 32, "depth error, share of its bound", float((off / bound).max()), 1, note)


def _perpendicular(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    rd = rng.normal(size=(count, 3))
    return rd, np.cross(rd, rng.normal(size=(count, 3)))


def _span(renderer: Renderer, rays: np.ndarray, spheres: object) -> tuple[np.ndarray, np.ndarray]:
    """Compute both roots of each ray on the GPU, and convert them to float64."""
    terms = glsl_call.call("sphereTermsOf", rays, spheres, device=renderer.device)  # pyright: ignore[reportArgumentType]
    span = glsl_call.call("sphereSpan", rays, spheres, terms, device=renderer.device)  # pyright: ignore[reportArgumentType]
    return span[:, 0].astype(float), span[:, 1].astype(float)
