"""A first look at recordings, before any fit: units, channels, time base, and what belongs together."""

from twin.checks.finding import Finding
from twin.checks.first_look import FirstLook, first_look
