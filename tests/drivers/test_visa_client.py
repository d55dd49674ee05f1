"""The acquisition instrument as PyVISA-py sees it, which knows nothing of this project."""

import numpy as np
import pytest
import pyvisa
from virtual_rig import VISA_OPTIONS, FilteredSine, served, wait_until


@pytest.fixture(params=["serial", "tcp"])
def visa(request):
    with served(FilteredSine(), **{request.param: True}) as rig:
        manager = pyvisa.ResourceManager("@py")
        name = f"ASRL{rig.serial}::INSTR" if rig.serial else "TCPIP::{}::{}::SOCKET".format(*rig.tcp.split(":"))
        instrument = manager.open_resource(name, **VISA_OPTIONS)
        yield instrument, rig
        instrument.close()
        manager.close()


def test_identity_settings_and_error_queue(visa):
    instrument, _ = visa
    assert instrument.query("*IDN?") == "Virtual Test Rig,DAQ-GEN,simulated,1.0"
    instrument.write("*CLS")
    instrument.write("SOURCE:FREQUENCY 0.027 kHz; VOLTAGE 300 mV")
    assert float(instrument.query("SOUR:FREQ?")) == pytest.approx(27.0)
    assert float(instrument.query("SOUR:VOLT?")) == pytest.approx(0.3)
    instrument.write("SOUR:VOLT 11")
    instrument.write("BREAKFAST")
    assert instrument.query("SYST:ERR?").startswith('-222,"Data out of range')
    assert instrument.query("SYST:ERR?").startswith('-113,"Undefined header')
    assert instrument.query("SYST:ERR?") == '0,"No error"'
    instrument.write("FREQ 25.3 HZ;VOLT 500 MV")  # SOURce may be left out
    assert instrument.query("FREQ?;VOLT?;FREQ? MIN") == "25.3;0.5;0.001"
    instrument.write("SOUR:NOIS:BAND 20,10")
    assert instrument.query("*ESR?") == str(32 + 16)
    assert instrument.query("*OPC?") == "1"


def test_channel_catalogue(visa):
    instrument, _ = visa
    assert instrument.query("CHAN:CAT?") == '"force","acc1","acc2"'
    assert instrument.query("CHAN3:DESC?") == '"acc2","acceleration","m/s^2",0.42,"+y",490.0'
    instrument.write("CHAN4:DESC?")
    assert instrument.query("SYST:ERR?").startswith("-114,")


def test_a_block_holds_the_next_samples_bit_for_bit(visa):
    instrument, rig = visa
    instrument.write("ACQ:RATE 5120;:SOUR:FREQ 100;VOLT 1;:OUTP ON")
    assert float(instrument.query("ACQ:RATE?")) == 5120.0
    first = instrument.query_binary_values("READ? 1000", datatype="f", container=np.array).reshape(3, -1)
    again = instrument.query_binary_values("READ? 500", datatype="f", container=np.array).reshape(3, -1)
    sent = rig.source.everything
    assert np.array_equal(first, sent[:, :1000])
    start = next(i for i in range(1000, sent.shape[1]) if sent[0, i] == again[0, 0])
    assert np.array_equal(again, sent[:, start : start + 500])
    spectrum = np.abs(np.fft.rfft(first[0] * np.hanning(1000)))
    assert np.argmax(spectrum) * 5.12 == pytest.approx(100.0, abs=3)


def test_the_status_byte_tells_that_it_has_measured(visa):
    instrument, _ = visa
    instrument.write("*CLS;:STAT:PRES;:STAT:OPER:ENAB 16;*SRE 128")
    assert instrument.query("*STB?;STAT:OPER:COND?") == "0;0"
    instrument.query_binary_values("READ? 100", datatype="f")
    assert instrument.query("*STB?;STAT:OPER:COND?") == "192;0"
    assert instrument.query("STAT:OPER?;*STB?") == "16;16"  # the answer before it waits


def test_fetch_gives_the_latest(visa):
    instrument, rig = visa
    instrument.write("FETC? 10")
    assert instrument.query("SYST:ERR?").startswith("-221,")
    instrument.query_binary_values("READ? 300", datatype="f")
    latest = instrument.query_binary_values("FETC? 10", datatype="f", container=np.array).reshape(3, -1)
    assert np.array_equal(latest, rig.source.everything[:, -10:])


def test_the_command_table_is_printed(visa):
    instrument, _ = visa
    table = bytes(instrument.query_binary_values("SYST:HELP:HEAD?", datatype="B")).decode()
    assert "ACQuire:STARt" in table
    assert "[SOURce:]FREQuency[:CW]" in table


def test_a_client_may_leave_and_another_come(visa):
    instrument, rig = visa
    instrument.write("SOUR:FREQ 55;FREQ?")  # leaves without taking the answer
    if rig.serial:  # a line that does not tell whose answer is still on its way
        wait_until(lambda: instrument.bytes_in_buffer)
    instrument.close()
    manager = pyvisa.ResourceManager("@py")
    name = f"ASRL{rig.serial}::INSTR" if rig.serial else "TCPIP::{}::{}::SOCKET".format(*rig.tcp.split(":"))
    with manager.open_resource(name, **VISA_OPTIONS) as second:
        assert second.query("*IDN?").startswith("Virtual Test Rig,")
        assert float(second.query("SOUR:FREQ?")) == 55.0
    manager.close()
