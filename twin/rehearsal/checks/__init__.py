"""What a rehearsal warns of: each check takes a rehearsal and gives cautions."""

from collections.abc import Callable, Iterator

from twin.rehearsal.checks.coarse_grid import check_grid
from twin.rehearsal.checks.drop_out import check_drop_out
from twin.rehearsal.checks.dwell import check_dwell
from twin.rehearsal.checks.internal_resonance import check_internal_resonance
from twin.rehearsal.checks.jump import check_early_ends, check_jumps
from twin.rehearsal.checks.limits import check_drive, check_limits, check_overload
from twin.rehearsal.checks.rig_file import check_rig_file
from twin.rehearsal.checks.small_signals import check_noise, check_quantisation
from twin.rehearsal.checks.too_short import check_length, check_sweep_rate
from twin.rehearsal.rehearsal import Caution, Rehearsal

CHECKS: tuple[Callable[[Rehearsal], Iterator[Caution]], ...] = (
    check_rig_file,
    check_noise,
    check_quantisation,
    check_jumps,
    check_internal_resonance,
    check_grid,
    check_dwell,
    check_length,
    check_sweep_rate,
    check_drop_out,
    check_overload,
    check_drive,
    check_limits,
    check_early_ends,
)
"""All checks; where two would change the same field, a later one has the last word."""
