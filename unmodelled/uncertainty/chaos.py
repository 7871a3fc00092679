"""Generalised polynomial chaos: outputs as polynomials in standard variables, and their moments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import product

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.families.orthogonal import Germ

Germs = tuple[Germ, ...]

#: Below this share of the mean a standard deviation is rounding.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Chaos:
    """Polynomial chaos expansion of outputs of n independent parameters (section 3.2.4)."""

    families: tuple[Family, ...]
    degree: int  # largest total degree of the polynomials
    order: int  # collocation points per parameter; must exceed the degree (section 3.2.8)

    def __post_init__(self) -> None:
        if not self.families:
            raise BadInput(
                "polynomial chaos needs at least one uncertain parameter: mark one with identify: true"
            )
        if self.degree < 0:
            raise BadInput(f"the degree must not be negative, got {self.degree}")
        if self.order <= self.degree:
            raise BadInput(f"the quadrature order must exceed the degree {self.degree}, got {self.order}")

    def nodes(self, alpha: Array) -> Array:
        """Return the collocation points (order^n, n) of the parameters for a distribution (n, 2)."""
        self._check(alpha)
        phi = _rule(self._germs(alpha), self.degree, self.order).points
        columns = [f.to_theta(p, a) for f, p, a in zip(self.families, phi.T, alpha, strict=True)]
        return np.stack(columns, axis=1)

    def expand(self, alpha: Array, values: Array) -> Expansion:
        """Compute the coefficients of all outputs from values (order^n, L) at the nodes, by eq. (3.11)."""
        self._check(alpha)
        values, rows = np.asarray(values), self.order ** len(self.families)
        if values.ndim != 2 or len(values) != rows:
            raise ValueError(f"expected values of shape ({rows}, L), got {values.shape}")
        if not np.all(np.isfinite(values)):
            node, output = np.argwhere(~np.isfinite(values))[0]
            raise ValueError(f"output {output} is {values[node, output]} at node {node}")
        germs = self._germs(alpha)
        rule = _rule(germs, self.degree, self.order)
        return Expansion(germs, self.degree, rule.projection @ values)

    def _germs(self, alpha: Array) -> Germs:
        return tuple(f.germ(a) for f, a in zip(self.families, alpha, strict=True))

    def _check(self, alpha: Array) -> None:
        wanted = (len(self.families), 2)
        if np.shape(alpha) != wanted:
            raise BadInput(
                f"alpha needs two numbers for every parameter, shape {wanted}: got {np.shape(alpha)}"
            )
        for k, (family, two) in enumerate(zip(self.families, alpha, strict=True)):
            try:
                family.check(two)
            except BadInput as error:
                raise BadInput(f"parameter {k + 1}: {error}") from None


@dataclass(frozen=True, eq=False)
class Expansion:
    """Sums of r orthonormal polynomials for L outputs (eq. 3.5)."""

    germs: Germs
    degree: int  # largest total degree of the polynomials
    coefficients: Array  # (r, L), in the order of `multi_indices`; the first row is the constant

    def __call__(self, phi: Array) -> Array:
        """Return outputs (S, L) at standard variables (S, n): the cheap response surface of section 3.2.7."""
        return _basis(self.germs, self.degree, phi).T @ self.coefficients

    @property
    def mean(self) -> Array:
        """Means of the outputs, shape (L,)."""
        return np.asarray(self.coefficients[0])

    @property
    def variance(self) -> Array:
        """Variances of the outputs, shape (L,): the sum below eq. (3.9) without the constant."""
        return np.asarray(np.sum(self.coefficients[1:] ** 2, axis=0))

    def moments(self, count: int) -> Array:
        """Compute raw moments (count, L) of the outputs by eq. (3.9).

        The expectation of a power of a polynomial is computed by an exact quadrature rule, which gives the
        same number as the sum over all products of m coefficients (r^m terms).
        """
        return self._moments(self.coefficients, count)

    def standardised(self, count: int) -> Array:
        """Compute moments (count, L) of (Y - mean) / standard deviation: 0, 1, skewness, kurtosis, ..."""
        deviation = np.sqrt(self.variance)
        constant = deviation <= ROUNDING * np.abs(self.mean)
        if np.any(constant):
            raise ValueError(f"output {np.argmax(constant)} does not vary: it has no standardised moments")
        scaled = self.coefficients / deviation
        scaled[0] = 0.0
        return self._moments(scaled, count)

    def _moments(self, coefficients: Array, count: int) -> Array:
        rule = _rule(self.germs, self.degree, (count * self.degree) // 2 + 1)
        y = rule.basis.T @ coefficients
        power, moments = np.ones_like(y), np.empty((count, y.shape[1]))
        for m in range(count):
            power *= y
            moments[m] = rule.weights @ power
        return moments


@lru_cache
def multi_indices(parameters: int, degree: int) -> Indices:
    """Return the degrees (r, n) of the univariate factors of every polynomial (eq. 3.6)."""
    every = [i for i in product(range(degree + 1), repeat=parameters) if sum(i) <= degree]
    indices = np.array(sorted(every, key=lambda i: (sum(i), [-k for k in i])))
    indices.flags.writeable = False  # shared by all who ask
    return indices


@dataclass(frozen=True, eq=False)
class _Rule:
    """Tensor quadrature rule of Q points with the basis at its points."""

    points: Array  # (Q, n)
    weights: Array  # (Q,)
    basis: Array  # (r, Q)
    projection: Array  # (r, Q) basis times weights


@lru_cache(maxsize=64)
def _rule(germs: Germs, degree: int, order: int) -> _Rule:
    """Return a quadrature rule; equal germs share one."""
    nodes, weights = zip(*(germ.quadrature(order) for germ in germs), strict=True)
    points = np.stack([axis.ravel() for axis in np.meshgrid(*nodes, indexing="ij")], axis=1)
    products = reduce(np.multiply.outer, weights).ravel()
    basis = _basis(germs, degree, points)
    return _Rule(points, products, basis, basis * products)


def _basis(germs: Germs, degree: int, phi: Array) -> Array:
    """Return the polynomials of eq. (3.6), shape (r, S), at standard variables (S, n)."""
    univariate = [germ.polynomials(x, degree) for germ, x in zip(germs, phi.T, strict=True)]
    indices = multi_indices(len(germs), degree)
    return reduce(np.multiply, (h[i] for h, i in zip(univariate, indices.T, strict=True)))
