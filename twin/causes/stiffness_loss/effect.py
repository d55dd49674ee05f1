from twin.bench.plan import Matrices, Plan
from twin.structure.weakened import weakened_section


def stiffness_loss(plan: Plan, *, factor: float, position_m: float, part: str = "") -> None:
    """Multiply the stiffness of a beam by `factor` over a stretch centred at a place.

    The stretch is as long as an average element of the rig file's mesh, wherever it lies in the bench's.  Where beams
    overlap it lies in the first of the two.
    """
    if factor <= 0:
        raise ValueError(f"a stiffness factor must be positive, got {factor}")
    place = plan.place(position_m=position_m, part=part)

    def weaken(matrices: Matrices) -> None:
        section = weakened_section(plan.rig, matrices.structure, place=place, factor=factor)
        rows = section.rows(matrices.structure)
        n = rows.shape[1]
        matrices.K0[:n, :n] += (rows.T * section.lost) @ rows

    plan.matrix_changes.append(weaken)
