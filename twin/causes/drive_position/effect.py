from twin.bench.plan import Plan


def drive_position(plan: Plan, *, channel: str, offset_m: float) -> None:
    """Shift the force cell and the drive with it."""
    if channel != plan.rig.force_sensor.channel:
        raise ValueError(f"drive-position moves the force cell {plan.rig.force_sensor.channel!r}, not {channel!r}")
    plan.move_sensor(channel, offset_m)
