"""What a prediction is asked for, as a table."""

import pytest

from recordings.errors import InputError
from twin.identify.backbones.drive_table import read_drive


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", "rows"), ("frequency_Hz,force_N\n", "rows"), ("frequency_Hz\n80\n", "line 1"),
        ("frequency_Hz,force_N\n80,x\n", "line 2"), ("frequency_Hz,force_N\n80,-1\n", "line 2"),
        ("frequency_Hz,force_N\n80\n", "line 2"), ("frequency_Hz,force_N\nnan,1\n", "line 2"),
    ],
)  # fmt: skip
def test_rubbish_drives_are_refused(tmp_path, text, place):
    path = tmp_path / "drive.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=place):
        read_drive(path)
