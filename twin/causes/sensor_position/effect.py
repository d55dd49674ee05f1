from twin.bench.plan import Plan


def sensor_position(plan: Plan, *, channel: str, offset_m: float) -> None:
    """Shift a sensor with its mass; beyond the structure's end it stays at the end."""
    if channel == plan.rig.force_sensor.channel:
        raise ValueError(f"the force cell {channel!r} is moved by drive-position")
    plan.move_sensor(channel, offset_m)
