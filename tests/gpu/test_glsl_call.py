"""Calls of GLSL functions over arrays return the functions' values."""

import numpy as np
import pytest

from raytracer import glsl
from raytracer.compiler.glsl.preprocessor import ShaderError
from raytracer.rendering.renderer import Renderer

pytestmark = pytest.mark.gl


def test_scalars_vectors_and_booleans_are_passed_and_returned(renderer: Renderer) -> None:
    spans = np.array([(0, 1), (2, 3), (-1, 0.5)], np.float32)
    np.testing.assert_array_equal(glsl.call("isInside", spans, 0.5, device=renderer.device), [True, False, False])
    np.testing.assert_array_equal(glsl.call("isBefore", spans, 0.5, device=renderer.device), [True, False, True])
    result = glsl.call("holds", spans, 0.5, device=renderer.device)
    assert result.dtype == np.float32
    np.testing.assert_array_equal(result, np.array([1, -2, -1e30], np.float32))


def test_a_hundred_thousand_elements_keep_their_order_and_bits(renderer: Renderer) -> None:
    x = np.random.default_rng(0).uniform(0, 1, 100_003).astype(np.float32)
    span = np.stack([x, x + 1], axis=1)
    np.testing.assert_array_equal(glsl.call("holds", span, -1.0, device=renderer.device), -x)


def test_empty_arrays_return_empty_arrays_and_large_arrays_are_split(renderer: Renderer) -> None:
    assert glsl.call("holds", np.zeros((0, 2)), 0.0, device=renderer.device).shape == (0,)
    # Each element takes three words: a texture of llvmpipe holds 5.6 million elements.
    x = np.linspace(0, 1, 6_000_000, dtype=np.float32)
    np.testing.assert_array_equal(glsl.call("holds", np.stack([x, x], axis=1), -1.0, device=renderer.device), -x)


def test_nested_structs_are_structured_arrays(renderer: Renderer) -> None:
    dtype = glsl.dtype("Roth", {"MAX_HITS": 4})
    assert dtype["hit"].shape == (4,) and dtype["hit"].base.names == ("t", "normal", "mat")
    a = np.zeros(3, dtype)
    a["n"], a["hit"]["t"][:, :2], a["hit"]["mat"][:, :2] = 2, (1, 2), (5, 6)
    b = glsl.call("complementCSG", a, defines={"MAX_HITS": 4}, device=renderer.device)
    np.testing.assert_array_equal(b["n"], [4, 4, 4])
    np.testing.assert_array_equal(b["hit"]["mat"][:, 1:3], [(5, 6)] * 3)


def test_inout_parameters_are_returned(renderer: Renderer) -> None:
    roth, hit = glsl.dtype("Roth"), glsl.dtype("Hit")
    r = np.zeros(2, roth)
    r["n"], r["hit"]["t"][:, :2] = 2, [(-1, 3), (1, 4)]
    nearest = np.zeros(1, hit)
    nearest["t"] = 2
    result = glsl.call("firstHit", r, nearest, device=renderer.device)
    np.testing.assert_array_equal(result["t"], [2, 1])


def test_errors_about_wrong_calls_state_the_expected_arguments(renderer: Renderer) -> None:
    with pytest.raises(TypeError, match=r"holds\(real2 span, real t\) takes 2 arguments, got 1"):
        glsl.call("holds", 1, device=renderer.device)
    with pytest.raises(ValueError, match=r"span: expected an array of shape \(N, 2\)"):
        glsl.call("isInside", np.zeros((4, 3)), 0.0, device=renderer.device)
    with pytest.raises(ValueError, match=r"or of length 1, got lengths \[3, 4\]"):
        glsl.call("isInside", np.zeros((4, 2)), np.zeros(3), device=renderer.device)
    with pytest.raises(ShaderError, match="no function or struct nothing in exactly one file"):
        glsl.call("nothing", device=renderer.device)


def test_phong_and_blinn_lobes_equal_the_formulas_of_the_lecture(renderer: Renderer) -> None:
    rng = np.random.default_rng(5)
    N, L, V = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(3, 2000, 3)))
    L *= np.sign(np.sum(N * L, axis=1, keepdims=True))
    R = 2 * np.sum(N * L, axis=1, keepdims=True) * N - L
    H = (L + V) / np.linalg.norm(L + V, axis=1, keepdims=True)
    for h in (0.0, 1.0, 32.0):
        phong, blinn = (glsl.call(model, N, L, V, h, device=renderer.device) for model in ("mirrorLobe", "halfwayLobe"))
        np.testing.assert_allclose(phong, np.maximum(np.sum(R * V, axis=1), 0) ** h, atol=2e-5)
        np.testing.assert_allclose(blinn, np.maximum(np.sum(N * H, axis=1), 0) ** h, atol=2e-5)
