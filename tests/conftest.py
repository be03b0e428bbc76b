"""One OpenGL context for the whole session; every test leaves it without an error."""

from collections.abc import Iterator

import moderngl
import pytest

from raytracer.renderer import Renderer, shared_renderer


@pytest.fixture
def renderer() -> Iterator[Renderer]:
    """The session's renderer, on the backend that RAYTRACER_BACKEND names. No context is a failure."""
    shared = shared_renderer()
    assert shared.context.error == "GL_NO_ERROR"
    yield shared
    assert shared.context.error == "GL_NO_ERROR"


@pytest.fixture
def context(renderer: Renderer) -> moderngl.Context:
    return renderer.context
