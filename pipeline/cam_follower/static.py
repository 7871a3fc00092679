"""Static models fitted to samples (sections 2.2 and 2.3): parameters of a motor, and feedforward networks."""

import warnings
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor
from threadpoolctl import threadpool_limits

from unmodelled.base.arrays import Array


def efficiency(current: Array, voltage: float, resistance: float, friction: float) -> Array:
    """Return the ratio of mechanical to electrical power.

    With E_a = V - R_a I, omega = E_a / K and T = K I, the mechanical power (T - B omega) omega is E_a (I - B'
    E_a) with B' = B / K^2, independent of the motor constant K.

    Takes current (n,) in A, voltage in V, resistance in Ohm, friction in A/V; gives (n,).
    """
    emf = voltage - resistance * current
    return np.asarray(emf * (current - friction * emf) / (voltage * current))


#: Where the search for the motor's parameters starts: Ohm, A/V.
START = (1.0, 0.001)
#: Iterations of L-BFGS at most; a network that memorises its samples never stops improving.
ITERATIONS = 3000


def fit_motor(current: Array, measured: Array, voltage: float) -> tuple[float, float]:
    """Identify R_a (ohm) and B' (A/V) from efficiencies at current (L,), A, by least squares, eq. 2.1."""

    def error(p: Array) -> Array:
        return efficiency(current, voltage, p[0], p[1]) - measured

    resistance, friction = least_squares(error, START, x_scale=START).x
    return float(resistance), float(friction)


def fit_network(u: Array, y: Array, hidden: int, penalty: float, seed: int) -> Callable[[Array], Array]:
    """Train a network with one layer of tanh neurons, eq. 2.2, by back-propagation and L-BFGS.

    Inputs and outputs are normalised with the statistics of the samples. The loss is eq. 2.6, which is eq.
    2.3 if the penalty is zero. (Eq. 2.5 as printed adds the gradient, and so would increase the loss.)

    Takes u (L,), y (L,); gives (n,).
    """
    u_mean, u_std, y_mean, y_std = u.mean(), u.std(), y.mean(), y.std()
    weights = 2 * hidden
    # scikit-learn minimises half of Eq. 2.6, with alpha / (2 L) before the sum of squared weights
    alpha = 0.5 * penalty * len(u) / weights
    network = MLPRegressor(
        hidden_layer_sizes=(hidden,),
        activation="tanh",
        solver="lbfgs",
        alpha=alpha,
        max_iter=ITERATIONS,
        max_fun=10 * ITERATIONS,
        tol=1e-10,
        random_state=seed,
    )
    # threads would only wait for each other on matrices so small
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(((u - u_mean) / u_std)[:, None], (y - y_mean) / y_std)

    def predict(at: Array) -> Array:
        return np.asarray(network.predict(((at - u_mean) / u_std)[:, None]) * y_std + y_mean)

    return predict
