"""What presses in all contacts of a vehicle in a state: indentations, normal forces, and their rates."""

from __future__ import annotations

from wheeltapper.march.common.kernel import kernel, shared_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.contact_laws import is_lossy
from wheeltapper.march.wagon.rail_motion import free_rails, gather_lags, press_rails
from wheeltapper.march.wagon.wheel_rows import AWAKE
from wheeltapper.march.wagon.wheels import paths_and_forces


@kernel
def contact_forces(t: float, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray) -> None:
    """Compute indentations and normal forces of all contacts that are awake, and their rates."""
    press_contacts(t, True, data, plan, w, wheels)


@shared_kernel
def press_contacts(
    t: float, rated: bool, data: FloatArray, plan: IntArray, w: FloatArray, wheels: FloatArray
) -> None:  # fmt: skip
    """Do as `contact_forces`; on rails that give way leave out what only the rates need, unless these are asked for."""
    if plan[asm.AT_RAILS] > 0:
        free_rails(t, data, plan, w, wheels)
        if is_lossy(data):
            gather_lags(data, plan, w, wheels)
    for o in range(wheels.shape[0]):
        L = wheels[o]
        if L[AWAKE] != 0.0:
            paths_and_forces(t, data, plan, plan[plan[asm.AT_KINDS] + o], w, L)
    if plan[asm.AT_RAILS] > 0:
        press_rails(rated, data, plan, wheels)
