"""An amplifier that limits before the converter does, so that no overload is counted."""
