"""SCPI and IEEE 488.2: headers, parameters, registers, errors by their standard numbers, and rubbish."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scpi import Boolean, Choice, Deferred, Instrument, Integer, Interpreter, Number, command


class Oven(Instrument):
    """A small instrument with every kind of command."""

    identity = ("Maker", "Oven", "7", "2.0")

    def __init__(self) -> None:
        super().__init__()
        self.value = 1.0
        self.pending: Deferred | None = None
        self.line = Interpreter(self)

    @command("SOURce:FREQuency[:CW]", Number(minimum=1.0, maximum=1e6, unit="Hz"))
    def _set(self, value: float) -> None:
        """Frequency."""
        self.value = value

    @command("SOURce:FREQuency[:CW]?")
    def _get(self) -> float:
        """Frequency."""
        return self.value

    @command("SOURce:VOLTage", Number(minimum=0.0, maximum=10.0, unit="V"))
    def _set_volts(self, value: float) -> None:
        """Voltage."""
        self.value = value

    @command("OUTPut#:STATe", Boolean())
    def _switch(self, number: int, on: bool) -> None:
        """A switch."""
        self.value = number if on else -number

    @command("SHAPe", Choice(("SINusoid", "RANDom")))
    def _shape(self, name: str) -> None:
        """A word."""
        self.value = {"SIN": 1.0, "RAND": 2.0}[name]

    @command("COUNt", Integer(maximum=5), Integer(maximum=5), optional=1)
    def _count(self, a: int, b: int = 9) -> None:
        """One or two whole numbers."""
        self.value = 10 * a + b

    @command("SLOW?")
    def _slow(self) -> Deferred:
        """An answer that takes time."""
        self.pending = Deferred()
        return self.pending

    @command("DATA?")
    def _data(self) -> bytes:
        """A block."""
        return b"\n#;,"


@pytest.fixture
def oven() -> Oven:
    return Oven()


def ask(oven: Oven, text: str) -> bytes:
    oven.line.feed(text.encode("latin-1") + b"\n")
    return b"".join(oven.line.run())


@pytest.mark.parametrize("header", ["SOUR:FREQ", "source:frequency", ":Sour:Freq:CW", "SOURCE:FREQ:CW", "  sour:freq"])
def test_headers_in_long_and_short_form(oven, header):
    assert ask(oven, f"{header} 27.5;:SOUR:FREQ?") == b"27.5\n"


@pytest.mark.parametrize("header", ["SOURC:FREQ", "SOU:FREQ", "SOUR:FREQU", "FREQ", "SOUR", "SOUR:FREQ:CW:CW"])
def test_other_abbreviations_are_undefined(oven, header):
    ask(oven, f"{header} 1")
    assert ask(oven, "SYST:ERR?").startswith(b'-113,"Undefined header')


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.2 kHz", 1200.0), ("1.2KHZ", 1200.0), ("1e3", 1000.0), ("+.5E+1 HZ", 5.0), ("0.5 MHz", 500_000.0),
        ("2000 mahz", None), ("MIN", 1.0), ("MAXimum", 1e6), ("2000000 uHz", 2.0),
    ],
)  # fmt: skip
def test_numbers_with_suffixes(oven, text, value):
    ask(oven, f"SOUR:FREQ {text}")
    if value is None:
        assert oven.registers.errors.pop().number == -222
    else:
        assert oven.value == pytest.approx(value, rel=1e-12)


def test_millivolt_is_not_megavolt(oven):
    ask(oven, "SOUR:VOLT 300 mV")
    assert oven.value == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("SOUR:FREQ 0.5", -222), ("SOUR:FREQ 1 V", -131), ("COUN 1 V", -138), ("SOUR:FREQ abc", -104),
        ("SOUR:FREQ", -109), ("SOUR:FREQ 1,2", -108), ("SOUR:FREQ 1,", -102), ("SHAP SQU", -224), ("SHAP 1", -104),
        ("SOUR:FREQ? 1", -224), ("SOUR:FREQ? 1,2", -108), ("COUN 6", -222),
        ("1SOUR", -102), ("SOUR::FREQ 1", -102), ("SHAP 'SIN", -151),
        ("SOUR:FREQ 1e999", -222), ("\x01", -101), ("DATA", -113), ("é", -101), ("SOUR:FREQ NaN", -104),
    ],
)  # fmt: skip
def test_errors_have_their_standard_numbers(oven, text, number):
    before = oven.value
    assert ask(oven, text) == b""
    assert oven.registers.errors.pop().number == number
    assert oven.value == before


def test_compound_headers_stay_in_their_subsystem(oven):
    assert ask(oven, "SOUR:FREQ 5;VOLT 2;:SHAP RAND;*WAI;:SOUR:FREQ?;FREQ?;*IDN?") == b"2.0;2.0;Maker,Oven,7,2.0\n"


def test_numbers_in_headers_and_switches(oven):
    ask(oven, "OUTP3:STAT ON")
    assert oven.value == 3
    ask(oven, "OUTPUT:STATE 0")
    assert oven.value == -1


def test_optional_parameters(oven):
    ask(oven, "COUN 2")
    assert oven.value == 29
    ask(oven, "COUN 2.4, 3")
    assert oven.value == 23


def test_error_queue_overflows_into_350_and_is_read_oldest_first(oven):
    for _ in range(40):
        ask(oven, "NONSENSE")
    count = int(ask(oven, "SYST:ERR:COUN?"))
    errors = [ask(oven, "SYST:ERR?") for _ in range(count + 1)]
    assert errors[0].startswith(b"-113,")
    assert errors[-2] == b'-350,"Queue overflow"\n'
    assert errors[-1] == b'0,"No error"\n'


def test_status_registers(oven):
    assert ask(oven, "*ESR?") == b"128\n"  # power on
    ask(oven, "NONSENSE")
    ask(oven, "SOUR:FREQ 0")
    ask(oven, "*OPC")
    assert ask(oven, "*ESE 32;*ESE?;*SRE 32;*SRE?;*STB?") == b"32;32;116\n"  # errors, answers, event, service
    assert ask(oven, "*ESR?;*ESR?") == b"49;0\n"  # command error, execution error, operation complete
    assert ask(oven, "*CLS;*STB?;SYST:ERR?") == b'0;0,"No error"\n'
    assert ask(oven, "*OPC?;*TST?;SYST:VERS?") == b"1;0;1999.0\n"


def test_status_groups_keep_what_came_on_until_it_is_read(oven):
    assert ask(oven, "STAT:OPER:COND?;EVEN?;ENAB?") == b"0;0;0\n"
    oven.registers.operation.put(16, True)
    oven.registers.operation.put(16, False)
    assert ask(oven, "*STB?") == b"0\n"  # nothing of it is enabled
    assert ask(oven, "STAT:OPER:ENAB 16;:STAT:QUES:ENAB 512;*STB?;:STAT:OPER:COND?") == b"128;0\n"
    assert ask(oven, "STATUS:OPERATION:EVENT?;:STAT:OPER?;*STB?") == b"16;0;16\n"  # an answer waits
    oven.registers.questionable.put(512, True)
    assert ask(oven, "*SRE 8;*STB?") == b"72\n"
    assert ask(oven, "*CLS;*STB?;STAT:QUES?;QUES:COND?") == b"0;0;512\n"
    assert ask(oven, "STAT:PRES;OPER:ENAB?") == b"0\n"
    assert ask(oven, "SYST:ERR?") == b'0,"No error"\n'


def test_the_query_of_a_number_gives_its_limits(oven):
    assert ask(oven, "SOUR:FREQ? MIN;FREQ? maximum") == b"1.0;1000000.0\n"
    ask(oven, "SOUR:FREQ? 3")
    assert oven.registers.errors.pop().number == -224


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_a_line_ends_as_programs_and_terminals_end_it(oven, end):
    interpreter = Interpreter(oven)
    interpreter.feed(b"SOUR:FREQ 5" + end + b"SOUR:FREQ?" + end)
    assert interpreter.run() == [b"5.0\n"]


def test_blocks_have_definite_length(oven):
    assert ask(oven, "DATA?;*OPC?") == b"#14\n#;,;1\n"


def test_what_follows_a_slow_query_waits_for_it(oven):
    interpreter = Interpreter(oven)
    interpreter.feed(b"SLOW?;*IDN?\n*OPC?\n")
    assert interpreter.run() == []
    assert oven.pending is not None
    oven.pending.finish(42)
    assert interpreter.run() == [b"42;Maker,Oven,7,2.0\n", b"1\n"]


def test_an_overlong_line_is_an_error_and_the_next_one_works(oven):
    interpreter = Interpreter(oven)
    for _ in range(100):
        interpreter.feed(b"A" * 1000)
    interpreter.feed(b"\n*IDN?\n")
    assert interpreter.run() == [b"Maker,Oven,7,2.0\n"]
    assert oven.registers.errors.pop().number == -363


def test_the_table_prints_every_command(oven):
    block = ask(oven, "SYST:HELP:HEAD?").decode()
    for header in ("*IDN?", "SOURce:FREQuency[:CW]", "OUTPut#:STATe", "SYSTem:ERRor[:NEXT]?"):
        assert header in block
    assert "<1 to 1e+06 Hz>" in block


@given(st.lists(st.binary(max_size=300), max_size=8))
def test_rubbish_never_raises(chunks):
    oven = Oven()
    interpreter = Interpreter(oven)
    for chunk in chunks:
        interpreter.feed(chunk)
        interpreter.run()
    while oven.registers.errors:
        text = oven.registers.errors.pop().text
        assert text.isascii()
        assert "\n" not in text


@given(st.text(alphabet=":;*?,. SOURFEQ0123456789eE+-\"'kHzMV#", max_size=60))
def test_near_misses_never_raise(text):
    ask(Oven(), text)
