"""The name of a pseudo-terminal: nobody else's link is removed, neither when it is made nor when it is given up."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.virtual import PtyPort
from drivers.virtual.assembly import open_serial
from recordings.errors import InputError


def test_a_link_to_something_else_is_refused_and_stays(tmp_path: Path) -> None:
    link, precious = tmp_path / "line", tmp_path / "precious"
    precious.write_text("mine")
    link.symlink_to(precious)
    with pytest.raises(InputError, match="no serial port"):
        open_serial(str(link), None, None)
    with pytest.raises(InputError, match="is a link to something else"):
        PtyPort(link)
    assert link.readlink() == precious


def test_a_second_server_does_not_steal_the_first_ones(tmp_path: Path) -> None:
    link = tmp_path / "line"
    first = PtyPort(link)
    with pytest.raises(InputError, match="in use"):
        open_serial(str(link), None, None)
    assert link.exists()
    first.close()
    assert not link.is_symlink()


def test_a_link_that_a_dead_server_left_is_replaced(tmp_path: Path) -> None:
    link = tmp_path / "line"
    link.symlink_to("/dev/pts/99999")
    open_serial(str(link), None, None).close()
    assert not link.is_symlink()


def test_on_leaving_a_link_that_is_anothers_by_now_stays(tmp_path: Path) -> None:
    link = tmp_path / "line"
    port = PtyPort(link)
    link.unlink()
    link.symlink_to("elsewhere")
    port.close()
    assert link.readlink() == Path("elsewhere")
