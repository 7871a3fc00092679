"""The Keras side of `lstm_training`, a program of its own that needs numpy, keras and tensorflow only.

Reads weights and a mini-batch from the folder given, writes the gradient by the LSTM's recurrent weights,
without dropout, there, prints its version, and then does one training step for every line on standard input.
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


def network(given: dict[str, Array]) -> keras.Model:
    """R of eq. 5.7 as a Keras user writes it, with the weights given."""
    steps, features = given["tau"].shape[1:]
    hidden, head = given["W_s"].shape[0], given["W_6"].shape[0]
    tau, q = keras.Input((steps, features)), keras.Input(given["q"].shape[1:])
    states = keras.layers.LSTM(hidden, return_sequences=True)(tau)
    joined = keras.layers.Concatenate()([states, keras.layers.RepeatVector(steps)(q)])
    units = keras.layers.Dropout(0.05)(keras.layers.Dense(head, activation="relu")(joined))
    model = keras.Model([tau, q], keras.layers.Dense(1)(units))
    model.set_weights([given[name] for name in ("W_tau", "W_s", "b", "W_5", "b_5", "W_6", "b_6")])
    return model


class Training:
    """The network, its optimiser and one mini-batch; `jit` compiles the step with XLA."""

    def __init__(self, given: dict[str, Array], jit: bool) -> None:
        model, optimiser = network(given), keras.optimizers.Adam(0.0)
        tau, q, target, share = (tf.constant(given[name]) for name in ("tau", "q", "target", "share"))
        optimiser.build(model.trainable_variables)

        @tf.function(jit_compile=jit)
        def step(training: bool) -> list[tf.Tensor]:
            with tf.GradientTape() as tape:
                error = model([tau, q], training=training)[..., 0] - target
                loss = tf.reduce_sum(share * error * error)
            found = tape.gradient(loss, [v.value for v in model.trainable_variables])
            optimiser.apply(found, model.trainable_variables)
            return found

        self.step = step


def main() -> None:
    """`python keras_lstm.py FOLDER plain|xla`."""
    folder, how = Path(sys.argv[1]), sys.argv[2]
    tf.config.threading.set_intra_op_parallelism_threads(1)
    tf.config.threading.set_inter_op_parallelism_threads(1)
    with np.load(folder / "given.npz") as stored:
        given = {name: stored[name] for name in stored.files}
    training = Training(given, jit=how == "xla")
    np.save(folder / "gradient.npy", training.step(False)[1].numpy())
    training.step(True)
    print(f"Keras {keras.__version__}, TensorFlow {tf.__version__}", flush=True)
    for _ in sys.stdin:
        training.step(True)[0].numpy()
        print("done", flush=True)


if __name__ == "__main__":
    main()
