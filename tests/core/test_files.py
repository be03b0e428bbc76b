"""Reading files."""

from pathlib import Path
from typing import Any

import pytest

from raytracer.core import files


def test_an_interrupt_while_a_file_is_opened_stays_an_interrupt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.txt"
    path.write_text("text")

    def interrupted(*arguments: Any, **options: Any) -> None:
        open(*arguments, **options).close()  # Python, too, closes the file of an interrupted call
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "open", interrupted, raising=False)
    with pytest.raises(KeyboardInterrupt):
        files.read_packaged(path)
