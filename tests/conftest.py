"""One OpenGL context for the whole session; every test leaves it without an error."""

from collections.abc import Iterator

import pytest

from raytracer.renderer import Renderer, _shared, shared_renderer


@pytest.fixture
def renderer() -> Renderer:
    """The session's renderer, on the backend that RAYTRACER_BACKEND names. No context is a failure."""
    return shared_renderer()


@pytest.fixture(autouse=True)
def no_opengl_error() -> Iterator[None]:
    yield
    for shared in _shared.values():
        assert shared.context.error == "GL_NO_ERROR"
