"""Draw the README's picture of the Brake-Reuss beam: python docs/brake_reuss_picture.py."""

from __future__ import annotations

from pathlib import Path

import twin

HERE = Path(__file__).parent

if __name__ == "__main__":
    sweeps = HERE.parent / "tests" / "data" / "brake-reuss" / "response_control.csv"
    figure = twin.load_rig("brake-reuss").identify([sweeps]).plot_law()
    figure.savefig(HERE / "pictures" / "brake-reuss.png", dpi=90, facecolor="white")
