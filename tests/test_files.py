"""Files are written whole or not at all."""

from pathlib import Path

import pytest

from vision_s2r.errors import UserError
from vision_s2r.files import whole, write


def test_a_file_and_the_folders_above_it_are_written(tmp_path: Path) -> None:
    path = write(tmp_path / "a" / "b.txt", "0.1 N·m")
    assert path.read_text(encoding="utf-8") == "0.1 N·m"
    assert write(path, b"\x00").read_bytes() == b"\x00"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_what_breaks_leaves_what_was_there(tmp_path: Path, error: BaseException) -> None:
    path = write(tmp_path / "a.txt", "before")
    with pytest.raises(UserError if isinstance(error, OSError) else KeyboardInterrupt), whole(path) as temporary:
        temporary.write_text("half")
        raise error
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_for_a_folder_is_one_clear_line(tmp_path: Path) -> None:
    write(tmp_path / "a", "")
    with pytest.raises(UserError, match="a/b: cannot be written"):
        write(tmp_path / "a" / "b", "")
