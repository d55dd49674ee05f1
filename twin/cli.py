"""The command line: one command, `twin`, that joins physics, instruments and recordings.

Every subcommand is a module of :mod:`twin.commands` that offers ``command``, a click command; it is imported only
when called, so that ``twin --help`` is quick.
"""

import difflib
import importlib
import os
import shlex
import sys
from typing import NoReturn

for _library in ("OPENBLAS", "OMP", "MKL"):
    # The matrices are small: threads only wait for each other.  Read when numpy is first imported, so set before it.
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import click  # noqa: E402

from recordings.errors import InputError, printable, reason_of  # noqa: E402
from twin.commands.common.stopping import terminable  # noqa: E402

SUMMARIES = {
    "demo": "The main job from end to end: serve, acquire, identify, find a hidden effect, report.",
    "rig": "Show a rig, or make one from another program's matrices.",
    "rehearse": "Run a procedure on the twin, faster than real time.",
    "serve": "Serve the virtual instruments of a rig over serial, TCP and CAN.",
    "acquire": "Run a procedure against instruments, virtual or real, and record it.",
    "replay": "Serve a recorded run through the virtual instruments.",
    "faults": "Try every fault on virtual instruments; count what was noticed, lost, silently wrong.",
    "check": "Validate a recording against the contract; recover what a damaged file holds.",
    "import": "Make a recording of other programs' files: CSV, MAT, HDF5, WAV, TDMS, Parquet, UFF.",
    "convert": "Convert between MCAP and other formats, chosen by suffix.",
    "modes": "Natural frequencies and damping from a broadband recording, without a model.",
    "identify": "Identify E', G' and the joint's nonlinear law from recordings.",
    "friction": "Identify friction, stiffness and backlash from measured loops.",
    "predict": "Predict responses to given frequencies and forces.",
    "couple": "Couple a part known by its responses to models of the others; identify the joints.",
    "diagnose": "Show what the model gets wrong, name the cause, extend the model, measure the gain.",
    "campaign": "Hide causes in many virtual rigs, diagnose them blind, and count.",
    "reproduce": "The papers' tables side by side with this project's.",
    "cite": "What to cite for the methods that results used, as BibTeX or CFF.",
    "view": "Show a run, a rehearsal or a diagnosis in rerun.",
    "speed": "The benchmark ratios on this machine.",
}


class LazyGroup(click.Group):
    """A group whose commands are imported when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All command names, in the order of the work."""
        return list(SUMMARIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command."""
        if cmd_name not in SUMMARIES:
            return None
        from twin.commands.common.completion import named_types
        from twin.commands.common.examples import EXAMPLES

        command = importlib.import_module(f"twin.commands.{cmd_name}").command
        assert isinstance(command, click.Command)
        command.short_help = SUMMARIES[cmd_name]
        # Lines after \b keep their breaks.
        command.epilog = "\n".join(["\b", "Examples:", *(f"  {line}" for line in EXAMPLES[cmd_name])])
        named_types(command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does, with the names that are meant perhaps; nothing here means anything when it is empty."""
        if "" in args:
            ctx.fail(f"an empty word after '{' '.join(args[: args.index('')])[-60:]}'")
        if args and args[0] not in SUMMARIES and not args[0].startswith("-"):
            near = difflib.get_close_matches(args[0], SUMMARIES, n=2)
            meant = f", perhaps {' or '.join(near)}" if near else ""
            ctx.fail(f"no command {args[0][:60]!r}{meant}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(SUMMARIES.items()))


PACKAGES_THAT_MATTER = ("numpy", "scipy", "numba", "mcap", "pyserial", "python-can", "rerun-sdk")


def _print_version(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    import platform
    from importlib.metadata import version

    click.echo(f"twin {version('virtual-test-rig')}")
    click.echo(f"Python {platform.python_version()} on {platform.system()} {platform.machine()}")
    click.echo(", ".join(f"{name} {version(name)}" for name in PACKAGES_THAT_MATTER))
    context.exit()


def _print_completion(context: click.Context, _: click.Parameter, shell: str | None) -> None:
    if shell is None or context.resilient_parsing:
        return
    from twin.commands.common.completion import completion_script

    click.echo(completion_script(group, shell))
    context.exit()


COMPLETION_HELP = """\b
Completion in bash, for this and every later shell:
  eval "$(twin --completion bash)"
  twin --completion bash >> ~/.bashrc"""


@click.command(cls=LazyGroup, epilog=COMPLETION_HELP, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version,
    help="Versions of this and of what its results depend on.",
)  # fmt: skip
@click.option(
    "--completion", type=click.Choice(["bash", "zsh", "fish"]), is_eager=True, expose_value=False,
    callback=_print_completion, help="Print what a shell needs to complete commands, options, rigs and files.",
)  # fmt: skip
def group() -> None:
    """Digital twin of a stepped-sine test rig for bolted structures.

    Every command explains itself: twin COMMAND --help.  New here?  Begin with 'twin demo', which does the main job
    from end to end.
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; a user's mistake becomes one line and exit status 2."""
    from twin.commands.common.output import trace

    given = sys.argv[1:] if arguments is None else arguments
    try:
        with terminable():
            typed = shlex.join(["twin", *given])
            result = group.main(args=given or ["--help"], prog_name="twin", standalone_mode=False, obj=typed)
    except InputError as error:
        trace()
        _complain(f"twin: {error}")
        sys.exit(2)
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else "twin"
        _complain(f"{where}: {error.format_message().rstrip('.')}; see '{where} --help'")
        sys.exit(2)
    except click.ClickException as error:
        _complain(f"twin: {error.format_message()}")
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        _end_interrupted()
    except BrokenPipeError:
        sys.exit(141)
    except OSError as error:  # a full disk, a folder that may not be read: the machine's state, not a fault of ours
        trace()
        place = f"{error.filename}: " if error.filename else ""
        _complain(f"twin: {place}{reason_of(error)}")
        sys.exit(2)
    except MemoryError:
        trace()
        click.echo("twin: not enough memory; close other programs, or give shorter recordings", err=True)
        sys.exit(2)
    except (ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
        trace()
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        _complain(f"twin: no answer ({what}); this is a fault of the program, and --verbose shows where it is")
        sys.exit(2)
    except ImportError as error:
        # A compiled module interrupted while it loads says so by failing to load.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        _end_interrupted()
    sys.exit(result if isinstance(result, int) else 0)


def _complain(line: str) -> None:
    click.echo(printable(line), err=True)


def _end_interrupted() -> NoReturn:
    click.echo("twin: interrupted", err=True)
    sys.exit(130)
