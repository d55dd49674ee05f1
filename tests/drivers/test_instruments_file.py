"""The instruments file and its addresses: every mistake is one line that says where and what to do."""

from pathlib import Path

import pytest
from virtual_rig import PATIENCE_S, FilteredSine, served

from drivers.addresses import parse_address
from drivers.host import open_instruments
from drivers.instruments import Instruments, read_instruments
from recordings.errors import InputError


@pytest.mark.parametrize(
    ("text", "again"),
    [
        ("/dev/ttyUSB0", "serial:/dev/ttyUSB0"), ("COM3", "serial:COM3"), ("serial:/dev/pts/3", "serial:/dev/pts/3"),
        ("tcp:localhost:5025", "tcp:localhost:5025"), ("tcp:[::1]:5025", "tcp:::1:5025"),
        ("can:socketcan:can0", "can:socketcan:can0"), ("can:unixbus:/tmp/a:b", "can:unixbus:/tmp/a:b"),
    ],
)  # fmt: skip
def test_addresses(text, again):
    assert str(parse_address(text)) == again


@pytest.mark.parametrize(
    "text", ["", "ttyUSB0", "usb:1", "tcp:5025", "tcp:host:", "tcp:host:99999", "can:can0", "can:nonsense:0", "serial:"]
)
def test_addresses_that_make_no_sense(text):
    with pytest.raises(ValueError, match=r"not |no CAN"):
        parse_address(text)


DAQ = '[[device]]\nname = "daq"\naddress = "/dev/ttyUSB0"\ngenerator = true\n'


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("", "device", "required"),
        ('[[device]]\nname = "a"\naddress = "usb:3"\n', "device.0.address", "not an address"),
        (DAQ.replace("true", "false"), "", "generator"),
        (DAQ + DAQ, "", "exactly one"),
        (DAQ + '[[device]]\nname = "b"\naddress = "serial:/dev/ttyUSB0"\n', "", "two devices have the address"),
        (DAQ.replace("/dev/ttyUSB0", "can:virtual:0"), "", "no generator"),
        (DAQ + '[[device.channel]]\nsource = "ai0"\nsensitivity = 0\n', "sensitivity", "of 0"),
        (DAQ + '[[device]]\nname = "m"\naddress = "can:virtual:0"\nkind = "meter"\n', "device.1", "serial line or TCP"),
        (DAQ + "bauds = 9600\n", "bauds", "no such field"),
        (DAQ.replace("daq", "d q"), "name", "pattern"),
    ],
)
def test_mistakes_are_one_line_with_the_place(tmp_path, text, place, reason):
    path = tmp_path / "instruments.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_instruments(path)
    line = str(caught.value)
    assert str(path) in line
    assert place in line
    assert reason in line
    assert "\n" not in line


def test_a_port_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot be opened"):
        open_instruments(Instruments.model_validate({"device": [one(f"serial:{tmp_path}/none")]}))


def test_nothing_listens(unused_port):
    with pytest.raises(InputError, match="nothing listens there"):
        open_instruments(Instruments.model_validate({"device": [one(f"tcp:127.0.0.1:{unused_port}")]}))


def test_something_that_is_no_instrument(silent_server):
    with pytest.raises(InputError, match=r"no answer to .*IDN"):
        open_instruments(Instruments.model_validate({"device": [one(f"tcp:{silent_server}")], "timeout_s": 0.3}))


def test_a_bus_without_a_node(tmp_path):
    with served(FilteredSine(), tcp=True) as rig:
        devices = [{"name": "can", "address": "can:virtual:empty"}, one(f"tcp:{rig.tcp}")]
        with pytest.raises(InputError, match="is the node on"):
            open_instruments(Instruments.model_validate({"device": devices, "timeout_s": 0.4}))


def test_names_units_and_sensitivities_are_the_files(tmp_path):
    channels = [
        {"source": "acc1", "name": "tip", "sensitivity": 0.5, "position_m": 0.41, "direction": "-y"},
        {"source": "force"},
    ]
    with served(FilteredSine(), tcp=True) as rig:
        device = one(f"tcp:{rig.tcp}") | {"channel": channels}
        with open_instruments(Instruments.model_validate({"device": [device]})) as acquisition:
            acquisition.start()
            (block,) = acquisition.read(timeout_s=PATIENCE_S)
            tip, force = acquisition.channels
    assert (tip.name, tip.position_m, tip.direction, tip.range, tip.unit) == ("tip", 0.41, "-y", 980.0, "m/s^2")
    assert force.name == "force"
    assert (block.samples["tip"] == rig.source.everything[1, : len(block)] * 2).all()
    assert (block.samples["force"] == rig.source.everything[0, : len(block)]).all()


def test_a_channel_that_the_device_does_not_have():
    with served(FilteredSine(), tcp=True) as rig:
        device = one(f"tcp:{rig.tcp}") | {"channel": [{"source": "acc9"}]}
        with pytest.raises(InputError, match=r"no channel 'acc9'; it has force, acc1, acc2"):
            open_instruments(Instruments.model_validate({"device": [device]}))


def one(address: str) -> dict[str, object]:
    return {"name": "daq", "address": address, "generator": True}


@pytest.fixture
def unused_port():
    import socket

    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    return port


@pytest.fixture
def silent_server():
    import socket

    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"127.0.0.1:{server.getsockname()[1]}"


def test_the_example_in_the_documentation_is_valid(tmp_path: Path):
    import textwrap

    import drivers.instruments

    text = textwrap.dedent((drivers.instruments.__doc__ or "").split("::\n", 1)[1])
    path = tmp_path / "example.toml"
    path.write_text(text)
    assert [device.name for device in read_instruments(path).device] == ["daq", "can", "meter"]
