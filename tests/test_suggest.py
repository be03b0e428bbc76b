"""Names that are not there: the near one is named."""

import pytest

from raytracer.models import MODELS
from raytracer.suggest import did_you_mean, nearest


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("phnog", "phong"),
        ("GGX", "ggx"),
        ("cook-torrance", "cook_torrance"),
        ("oren nayar", "oren_nayar"),
        ("wood", None),
        ("", None),
        ("p" * 1_000_000, None),
    ],
)
def test_a_misspelt_name_is_near_to_one_and_another_name_to_none(name: str, near: str | None) -> None:
    assert nearest(name, MODELS) == near
    assert did_you_mean(name, MODELS) == (f'; did you mean "{near}"?' if near else "")
