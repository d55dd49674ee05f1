from twin.bench.plan import Plan


def drive_position(plan: Plan, *, channel: str, offset_m: float) -> None:
    """Shift the force cell and the drive with it; another drive's cell matters to the runs of that drive alone."""
    cells = plan.rig.force_cells.values()
    if channel not in cells:
        raise ValueError(f"drive-position moves a force cell ({', '.join(cells)}), not {channel!r}")
    if channel == plan.rig.force_sensor.channel:
        plan.move_sensor(channel, offset_m)
