"""Systems drawn at random, over every function that a system file may use."""

from collections.abc import Iterator

import numpy as np

from unmodelled.engine.compiled.structure import Augmented, Network
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import Constant, Input, Parameter, Port, State, System, symbol
from unmodelled.systems.scope import Scope, Value
from unmodelled.systems.tables import Table


def _entries(text: str) -> tuple[str, ...]:
    return tuple(entry.strip() for entry in text.split(";"))


#: Names that generated code, or what it stands in, could have for itself.
NAMES = _entries(
    """
    w; p; i; np; math; evaluate; lam0; x0; q; LANES; step; sgn; absolute; lookup; torch; dx; pull; a; z;
    numba; table_0_0; select; minimum; p0; sqr; Piecewise; E; I
    """
)
#: Bounded or slowly growing, so that a free run stays where it starts; a, b and c are expressions.
SMOOTH = _entries(
    """
    sin({a}); cos({a}); tanh({a}); atan({a}); exp(-({a})**2); sqrt(1 + ({a})**2); {a}*sin({b});
    ({a})/(1 + ({b})**2); log(1 + ({a})**2); asin(0.9*sin({a})); acos(0.8*cos({a})); tan(0.5*sin({a}));
    sinh(tanh({a})); cosh(sin({a})); atan2(sin({a}), cos({b})); sin({a})**3; (1 + ({a})**2)**-1.5;
    (2 + sin({a}))**1.7; (2 + cos({a}))**sin({b}); (1 + ({a})**2)**0.25; 0.5*({a}) - 1.5*({b}); -({a});
    1/(1.5 + sin({a})); 2**tanh({a}); (3 + tanh({a}))**-2; smooth({a}); diff(sin({a})*{s}, {s})
    """
)
CORNERS = _entries(
    """
    abs({a}); sign({a})*({b}); min({a}, {b}, {c}); max({a}, {b}); floor({a}); mod({a}, 1.3);
    clip({a}, -0.7, {b}); heaviside({a}); where({a} > {b}, {c}, 0.1); ({a} >= {b}) - ({b} <= {c});
    ({a} != {b})*sin({c}); where({a} == {b}, 1, 2); ({a} < {b})*({c}); bent({a}); diff(bent({s}), {s});
    where({a} > 0, 0.1, 0.3); diff(smooth({a}*{s}), {s}); floor(3*sin({a}))**3
    """
)


class _Expressions:
    """Expressions as text."""

    def __init__(self, generator: np.random.Generator, states: list[str]) -> None:
        self.generator, self.states, self.texts = generator, states, [*SMOOTH, *CORNERS]
        generator.shuffle(self.texts)
        self.used = 0

    def draw(self, leaves: list[str], depth: int) -> str:
        """Templates go round, so that a few systems use them all."""
        if depth == 0:
            return str(self.generator.choice([*leaves, f"{self.generator.normal():.3f}"]))
        template = self.texts[self.used % len(self.texts)]
        self.used += 1
        needed = (key for key in "abc" if f"{{{key}}}" in template)
        deep = {key: self.draw(leaves, int(self.generator.integers(depth))) for key in needed}
        return template.format(**deep, s=self.generator.choice(self.states))


def random_structure(seed: int) -> Augmented:
    """One to four states, one to three parameters, up to two inputs, constants and ports, and networks."""
    generator = np.random.default_rng(seed)
    names: Iterator[str] = iter(generator.permutation(NAMES).tolist())
    states, parameters = _some(names, generator, 1, 4), _some(names, generator, 1, 3)
    inputs, constants, efforts = (_some(names, generator, 0, 2) for _ in range(3))
    expressions = _Expressions(generator, states)
    scope = {name: symbol(name) for name in (*states, *parameters, *inputs, *constants)}
    signals = {}
    for name in (next(names), next(names)):
        signals[name] = _parsed(expressions.draw([*scope, *signals, "t"], 2), scope | signals, states)
    known = scope | signals
    ports = []
    for number, effort in enumerate(efforts):
        law = _parsed(expressions.draw([*known], 1), known, states) if generator.random() < 0.5 else None
        ports.append(Port(f"port{number}", effort, "N", states[0], None, law))
    everything = known | {e: symbol(e) for e in efforts}
    dynamics = tuple(
        _parsed(" + ".join(expressions.draw([*everything, "t"], 3) for _ in range(2)), everything, states)
        for _ in states
    )
    values = generator.uniform(0.5, 1.5, len(parameters)) * generator.choice([-1, 1], len(parameters))
    system = System(
        "random",
        tuple(State(name, "") for name in states),
        tuple(Input(name, "", name) for name in inputs),
        (),
        tuple(Constant(name, "") for name in constants),
        tuple(Parameter(name, "", float(v)) for name, v in zip(parameters, values, strict=True)),
        tuple(ports),
        _tables(generator),
        signals,
        dynamics,
    )
    networks = []
    for port in [p for p in ports for _ in range(int(generator.integers(3)))]:
        texts = [expressions.draw([*known, "t"], 2) for _ in range(int(generator.integers(1, 4)))]
        hidden = int(generator.integers(1, 20))
        networks.append(Network(port.name, tuple(_parsed(text, known, states) for text in texts), hidden))
    return Augmented(system, tuple(networks), tuple(parameters[: int(generator.integers(4))][::-1]))


def _some(names: Iterator[str], generator: np.random.Generator, least: int, most: int) -> list[str]:
    return [next(names) for _ in range(int(generator.integers(least, most + 1)))]


def _parsed(text: str, known: dict, states: list[str]):  # type: ignore[no-untyped-def, type-arg]
    values = {name: Value(expression) for name, expression in known.items()}
    return parse(text, Scope(values, {"smooth": 0, "bent": 1}, states), text)


def _tables(generator: np.random.Generator) -> tuple[Table, ...]:
    kinds = {"smooth": "cubic", "bent": "linear"}
    tables = []
    for name, kind in kinds.items():
        x = np.sort(generator.uniform(-1.5, 1.5, 6)) + 0.1 * np.arange(6)
        tables.append(Table(name, tuple(x.tolist()), tuple(generator.normal(size=6).tolist()), kind))  # type: ignore[arg-type]
    return tuple(tables)
