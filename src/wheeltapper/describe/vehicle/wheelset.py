"""A wheelset on its primary suspension: the rolling body of the core model (the paper, Fig. 1a)."""

from __future__ import annotations

from pydantic import Field, model_validator

from wheeltapper.describe.noun import (
    Acceleration,
    Damping,
    Force,
    Length,
    Mass,
    PositiveForce,
    PositiveLength,
    PositiveStiffness,
    SlidingForce,
    Stiffness,
)
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.kinks import Suspension, kinks_of
from wheeltapper.describe.vehicle.plane import PlaneVehicle, side_by_side
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import DAMPER_END, DAMPER_PLAY, Need

FASTEST = 1e6
"""Largest rate of a suspension, √(k/m) or c/m, and of a bush, k_b/c, 1/s.

A faster one is rigid for every measurement, and the march would need ever smaller steps.
"""


class Wheelset(Vehicle):
    """A wheelset of mass m under a load P, on a suspension k-c whose other end moves steadily.

    The equation of motion is m·ÿ = -P - m·g - k·y - c·ẏ + N (the paper, equation 2.3) with the displacement y upwards.
    On a stiff track and a deck, the spring is unstretched at y = 0, the height of first touch. On rails that bend, it
    is unstretched in the static state. All values are per wheelset.

    The damper's end may move: a point z without mass (docs/theory/motion.rst, section 1.3). With free play the wheel
    moves between two stops, |y - z| ≤ g. The damper acts, with -c·ẏ, only while the wheel is at a stop and moves
    outwards. Otherwise there is no force, and z rests. With a bush, F = k_b·(y - z) = c·ż: the damper acts only below
    the frequency k_b/c. With both, F = k_b·(y - z ∓ g) beyond the gap, and zero within it.

    The suspension may also have dry friction, bumpstops, a spring with corners and a damper that blows off
    (docs/theory/motion.rst, section 1.9). Their deflections count from the static state on level track.

    Parameters
    ----------
    mass
        m, kg.
    load
        P, N, without the weight of the wheelset.
    stiffness
        k of the primary suspension, N/m, at most m·1e12/s².
    damping
        c of the primary suspension, N·s/m, at most m·1e6/s.
    radius
        R of the wheel, m.
    wheels
        Number of wheels that share the contact force.
    gravity
        g, m/s².
    damper_play
        Half the gap g of the damper's free play, m; 0: none.
    damper_play_start
        Position of the end in its gap at the start, from -1 to 1: z = y + damper_play_start·g; 0 is the middle.
    bush_stiffness
        k_b of the bush between wheel and damper, N/m, at most c·1e6/s; None: rigid.
    friction
        Sliding force of dry friction in parallel with the spring, N; 0: none.
    friction_stiffness
        Stiffness in series with the dry friction, N/m, at most m·1e8/s². While the friction sticks, it is a spring of
        this stiffness about the place where it stuck. It is needed with friction.
    bumpstop_gap, rebound_gap
        Compression and extension from the static state at which a bumpstop is met, m; None: none in that direction.
    bumpstop_stiffness
        Stiffness of the bumpstops, N/m, at most m·1e8/s².
    spring_corners
        Where the stiffness of the spring changes: pairs of a compression from the static state, m, negative in
        extension, and of the stiffness beyond it, N/m; in rising order.
    blow_off_force
        Force of the damper, in either direction, at which it blows off, N; None: a linear damper.
    blow_off_damping
        Slope of the damper's force over the rate beyond `blow_off_force`, N·s/m, less than `damping`.
    """

    mass: Mass
    load: Force = 0.0
    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    radius: PositiveLength = 0.46
    wheels: int = Field(default=2, ge=1)
    gravity: Acceleration = 9.81
    damper_play: Length = Field(default=0.0, ge=0)
    damper_play_start: float = Field(default=0.0, ge=-1, le=1)
    bush_stiffness: PositiveStiffness | None = None
    friction: SlidingForce = 0.0
    friction_stiffness: PositiveStiffness | None = None
    bumpstop_gap: PositiveLength | None = None
    rebound_gap: PositiveLength | None = None
    bumpstop_stiffness: PositiveStiffness | None = None
    spring_corners: tuple[tuple[Length, Stiffness], ...] = ()
    blow_off_force: PositiveForce | None = None
    blow_off_damping: Damping = 0.0

    @model_validator(mode="after")
    def _pressed_on_the_rail(self) -> Wheelset:
        if self.weight <= 0.0:
            raise InputError(
                "", "", f"load + mass·gravity = {self.weight:g} N", "more than 0 N, to hold it on the rail"
            )
        return self

    @model_validator(mode="after")
    def _check_suspension(self) -> Wheelset:
        for name, held, most, unit in (
            ("stiffness", self.stiffness, FASTEST**2 * self.mass, "N/m"),
            ("damping", self.damping, FASTEST * self.mass, "N·s/m"),
        ):
            if held > most:
                raise InputError(
                    "", name, f"{held:g} {unit}", f"at most {most:g} {unit} for a mass of {self.mass:g} kg"
                )
        return self

    @model_validator(mode="after")
    def _end_of_a_damper(self) -> Wheelset:
        if self.damper_end and self.damping == 0.0:
            what = "damper_play" if self.damper_play > 0.0 else "bush_stiffness"
            raise InputError("", "", f"{what} without damping", "damping of more than 0 N·s/m, or none of both")
        if self.damper_play_start != 0.0 and self.damper_play == 0.0:
            raise InputError(
                "", "", f"damper_play_start = {self.damper_play_start:g} without damper_play", "both, or neither"
            )
        if self.bush_stiffness is not None and self.bush_stiffness > FASTEST * self.damping:
            times = f"{self.bush_stiffness / self.damping:.3g} times damping per second"
            raise InputError(
                "", "", f"bush_stiffness = {self.bush_stiffness:g} N/m, {times}",
                f"at most {FASTEST * self.damping:g} N/m, or none (a rigid one)",
            )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _kinks_of_a_suspension(self) -> Wheelset:
        kinks_of(self).check(self.mass, self.stiffness, self.damping)
        if self.blow_off_force is not None and self.damper_end:
            what = "damper_play" if self.damper_play > 0.0 else "bush_stiffness"
            raise InputError("", "blow_off_force", f"{self.blow_off_force:g} N with {what}", "one of both")
        return self

    @property
    def damper_end(self) -> bool:
        """Whether the damper has a movable end: play, or a bush."""
        return self.damper_play > 0.0 or self.bush_stiffness is not None

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: a damper's end that moves, and what is not linear."""
        has = {DAMPER_END: self.damper_end, DAMPER_PLAY: self.damper_play > 0.0}
        return kinks_of(self).needs.union(need for need, there in has.items() if there)

    @property
    def weight(self) -> float:
        """P + m·g in N."""
        return float(self.load + self.mass * self.gravity)

    @property
    def loads(self) -> dict[str, float]:
        """The load that it carries, N, by the path of the field that states it."""
        return {"load": float(self.load)}

    @property
    def suspensions(self) -> tuple[Suspension, ...]:
        """Its one suspension."""
        return (Suspension("suspension", self, "", float(self.stiffness), float(self.damping)),)

    @property
    def plane(self) -> PlaneVehicle:
        """The wheelset as matrices, for a track that deforms."""
        return side_by_side((self,), (0.0,))
