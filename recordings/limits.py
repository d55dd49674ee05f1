"""How much of a stranger's file is believed before it is refused."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Bounds on what reading one file may cost; the defaults hold a run of an hour with four channels at 25.6 kHz."""

    values: int = 1 << 29
    """Samples of a file, all channels together (NaN in the place of lost ones included)."""
    held_samples: int = 1 << 20
    """Of a channel, that are kept in memory with those of the other channels beside them: half a minute of the four
    channels, more than a window has."""
    messages: int = 2_000_000
    """Messages of all topics."""
    fields: int = 20_000_000
    """Series of all sample blocks together: decoding one costs time even if it is empty."""
    record_bytes: int = 128 << 20
    """One MCAP record, and one chunk after decompression."""
    text_bytes: int = 64 << 20
    """Steps, events and indicators together, as encoded."""
    attachment_bytes: int = 64 << 20
    """All attachments together."""
    records: int = 4096
    """Metadata records, attachments, schemas and channels, each."""
    gap_fill: int = 1 << 20
    """Longest stretch of lost samples that is filled with NaN in full; a longer one is shortened to this."""
