"""Files are written whole or not at all."""

import logging
from pathlib import Path
from threading import Event, Thread

import pytest

from vision_s2r.errors import UserError
from vision_s2r.files import held, whole, write


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


def test_a_held_folder_is_waited_for(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    order, waits = [], Event()
    caplog.handler.addFilter(lambda record: waits.set() or True)  # heard of as soon as it is said
    caplog.set_level(logging.INFO)

    def second() -> None:
        with held(tmp_path / "run"):
            order.append("second")

    thread = Thread(target=second)
    with held(tmp_path / "run"):
        thread.start()
        assert waits.wait(60) and "another process works here" in caplog.text
        order.append("first")
    thread.join(60)
    assert order == ["first", "second"]
