"""Linear spring."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site

# two springs beside each other; `springref` is where the one of the file is at rest
_SAID = {"stiffness": "stiffness + k", "springref": "stiffness*springref/(stiffness + k)"}


class LinearSpring(PortEffect):
    """Spring without force at position zero; a negative stiffness pushes away from there, like a magnet."""

    kind = "elasticity"
    family = "linear_spring"
    says = "stiffness of {k}"
    says_negative = "negative stiffness of {k}"
    needs = ("position",)
    power = "stored"

    def law(self, at: Site) -> Law:
        return Law("k*x", {"k": signed("x", at.effort / at["x"].rms)}, robot=_SAID)


class PreloadedSpring(LinearSpring):
    """Spring with a force F_0 at position zero."""

    variant = "preloaded"
    says = "stiffness of {k} with a preload of {F_0}"
    says_negative = "negative stiffness of {k} with a preload of {F_0}"

    def law(self, at: Site) -> Law:
        amplitudes = {"k": signed("x", at.effort / at["x"].rms), "F_0": signed("1", at.effort)}
        return Law("k*x + F_0", amplitudes, robot=_SAID)
