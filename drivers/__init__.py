"""Bytes on a serial line and frames on a CAN bus: virtual instruments and host drivers.  No physics."""
