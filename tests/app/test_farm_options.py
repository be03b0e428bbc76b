"""The options of farms: wrong ones are refused in one line, before anything is drawn or written."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from raytracer.app.cli import main

WRONG = {
    "--workers=0": "--workers: expected a whole number in [1, 256], got 0",
    "--workers=257": "--workers: expected a whole number in [1, 256], got 257",
    "--workers=two": "expected a whole number that is not negative, got 'two'",
    "--mixed": "expected --workers or --scheduler with --mixed",
    "--workers=2 --scheduler=tcp://h:1": "expected --workers or --scheduler, got both",
    "--scheduler=http://h:1": "--scheduler: expected tcp://HOST:PORT or tls://HOST:PORT",
    "--scheduler=": "--scheduler: expected tcp://HOST:PORT or tls://HOST:PORT",
    "--scheduler=tcp://h:1 --device=0": "set RAYTRACER_BACKEND and RAYTRACER_DEVICE where a worker starts",
    "--scheduler=tcp://h:1 --backend=egl": "expected no --backend and --device with --scheduler",
    "--scheduler=tls://h:1": "tls:// needs the certificates of the farm",
}


def animate(folder: Path, *options: str) -> int:
    return main(["animate", "turntable", "-o", str(folder / "new" / "a.png"), "--size", "8x8", *options])


@pytest.mark.parametrize("options", WRONG)
def test_wrong_options_are_refused_in_one_line(
    options: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert animate(tmp_path, *options.split()) == 2
    error = capsys.readouterr().err
    assert WRONG[options] in error and error.count("\n") == 1
    assert not [*tmp_path.iterdir()]


def test_a_scheduler_that_does_not_exist_is_a_failure_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert animate(tmp_path, "--scheduler=tcp://no-such-host.invalid:8786") == 1
    error = capsys.readouterr().err
    assert "no scheduler at tcp://no-such-host.invalid:8786" in error and error.count("\n") == 1


def test_a_missing_extra_is_said_with_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert animate(tmp_path, "--workers=2") == 2
    error = capsys.readouterr().err
    assert "pip install -e '.[farm]'" in error and error.count("\n") == 1
