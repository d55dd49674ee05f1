from twin.bench.plan import Matrices, Plan
from twin.structure.sparse import with_square
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
        for row, lost in zip(section.rows(matrices.structure), section.lost, strict=True):
            matrices.K0 = with_square(matrices.K0, lost, matrices.pad(row))

    plan.matrix_changes.append(weaken)
