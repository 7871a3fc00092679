"""The Keras side of `keras_rnn`, a program of its own that needs numpy, keras and tensorflow only.

Reads the windows from the folder given, writes the gradient of the first step there, prints its version, and
then does one training step for every line on standard input.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.update(KERAS_BACKEND="tensorflow", TF_CPP_MIN_LOG_LEVEL="2", CUDA_VISIBLE_DEVICES="-1")

import keras
import numpy as np
import tensorflow as tf

Array = np.ndarray


class SliderCrank(keras.layers.Layer):
    """One Euler step of the slider-crank of systems/slider_crank.yaml with F = eta(d, v) at the slider."""

    def __init__(self, given: dict[str, Array]) -> None:
        super().__init__()
        self.given = given
        self.state_size = self.output_size = 2

    def build(self, shape: object) -> None:
        """Trained: the weights and the scaled parameters m3, J1, B_m."""
        for name in ("W_h", "b_h", "W_o", "b_o", "xi"):
            start = keras.initializers.Constant(self.given[name])
            setattr(self, name, self.add_weight(shape=self.given[name].shape, initializer=start, name=name))
        self.built = True

    def network(self, d: tf.Tensor, v: tf.Tensor) -> tf.Tensor:
        """F, N, of d (windows,) in m and v (windows,) in m/s."""
        q = tf.stack([d, v], -1) * self.given["scale"]
        hidden = tf.nn.relu(q @ self.W_h + self.b_h)
        return float(self.given["gain"]) * ((hidden @ self.W_o)[:, 0] + self.b_o)

    def call(self, inputs: tf.Tensor, states: list[tf.Tensor]) -> tuple[tf.Tensor, list[tf.Tensor]]:
        """inputs (windows, 1) torque; states: one, (windows, 2)."""
        m1, m2, l1, l2, g, period = (float(self.given[n]) for n in ("m1", "m2", "l1", "l2", "g", "period"))
        m3, J1, B_m = tf.unstack(self.xi * self.given["unit"])
        theta, omega = states[0][:, 0], states[0][:, 1]
        along, across = l1 * tf.cos(theta), l1 * tf.sin(theta)
        s = across / l2
        q = tf.sqrt(1.0 - s * s)
        k_phi = along / (l2 * q)
        dk_phi = (k_phi * k_phi - 1.0) * s / q
        k_x, dk_x = -across - 0.5 * l2 * s * k_phi, -along - 0.5 * (along * k_phi + l2 * s * dk_phi)
        k, dk = -across - l2 * s * k_phi, -along - (along * k_phi + l2 * s * dk_phi)
        k_y, dk_y = 0.5 * along, -0.5 * across
        J = J1 + m2 * (k_x * k_x + k_y * k_y + l2 * l2 / 12.0 * k_phi * k_phi) + m3 * k * k
        half_dJ = m2 * (k_x * dk_x + k_y * dk_y + l2 * l2 / 12.0 * k_phi * dk_phi) + m3 * k * dk
        F = self.network(along + l2 * q - (l2 - l1), k * omega)
        weight = 0.5 * g * (m1 + m2) * along
        torque = inputs[:, 0] - B_m * omega - weight - k * F - half_dJ * omega * omega
        state = states[0] + period * tf.stack([omega, torque / J], -1)
        return state, [state]


class Training:
    """The RNN, its optimiser and one mini-batch; `jit` compiles the step with XLA."""

    def __init__(self, given: dict[str, Array], jit: bool) -> None:
        self.cell = SliderCrank(given)
        rnn = keras.layers.RNN(self.cell, return_sequences=True)
        optimiser = keras.optimizers.Adam(3e-3)
        u, x0, C_x = (tf.constant(given[n]) for n in ("u", "x0", "C_x"))
        measured = tf.constant(given["x"])
        self.cell.build(None)
        optimiser.build(self.cell.trainable_variables)

        @tf.function(jit_compile=jit)
        def step() -> list[tf.Tensor]:
            with tf.GradientTape() as tape:
                error = rnn(u, initial_state=[x0]) - measured
                loss = tf.reduce_mean(tf.reduce_sum(C_x * error * error, -1))
            found = tape.gradient(loss, [v.value for v in self.cell.trainable_variables])
            optimiser.apply(found, self.cell.trainable_variables)
            return found

        self.step = step


def main() -> None:
    """`python keras_rnn.py FOLDER plain|xla`."""
    folder, how = Path(sys.argv[1]), sys.argv[2]
    tf.config.threading.set_intra_op_parallelism_threads(1)
    tf.config.threading.set_inter_op_parallelism_threads(1)
    with np.load(folder / "given.npz") as stored:
        given = {name: stored[name].astype(np.float32) for name in stored.files}
    training = Training(given, jit=how == "xla")
    gradient = np.concatenate([np.ravel(g) for g in training.step()])
    np.save(folder / "gradient.npy", gradient.astype(np.float64))
    print(f"Keras {keras.__version__}, TensorFlow {tf.__version__}", flush=True)
    for _ in sys.stdin:
        training.step()[0].numpy()
        print("done", flush=True)


if __name__ == "__main__":
    main()
