"""The shortest sweep of the steel rig that still is one."""

__all__ = ["TWO_STEPS"]

TWO_STEPS = """
procedure = "stepped-sine"
target_channel = "force"
control = "force"
amplitudes = [1.5]
sample_rate = 1024.0
[grid]
start = 40.0
stop = 41.0
step = 1.0
[settle]
tolerance = 0.01
maximum = 30.0
[measure]
seconds = 0.5
[limits]
voltage = 10.0
"""
