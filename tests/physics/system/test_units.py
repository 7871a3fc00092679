"""Units, the consistency of expressions, and ports of mechanics and of balances."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.machines.folders import system_of
from tests.machines.known import refusals
from unmodelled import BadInput, System
from unmodelled.effects.library import effects
from unmodelled.systems.units import ONE, describe, parse_unit


@pytest.mark.parametrize("text", ["", "-", "1", "rad", " ", "m/m"])
def test_dimensionless(text: str) -> None:
    assert parse_unit(text).dimension == ONE


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("N", "kg m/s^2"),
        ("N m", "Nm"),
        ("N m s/rad", "Nms"),
        ("Ns", "kg m/s"),
        ("V s/rad", "Wb"),
        ("kg m²", "kg*m**2"),
        ("N·m", "J"),
        ("Ohm", "V/A"),
        ("Ω", "ohm"),
        ("1/s", "Hz"),
        ("m^-1", "1/m"),
        ("rad s-1", "1/s"),
        ("kg m2", "kg m^2"),
        ("W/(m2 K)", "kg/(s^3 K)"),
        ("J/(kg K)", "m^2/s^2/K"),
        ("m^0.5 m^0.5", "m"),
    ],
)
def test_equal_units(one: str, other: str) -> None:
    assert parse_unit(one).dimension == parse_unit(other).dimension


@pytest.mark.parametrize(
    "text", ["N", "N m", "W", "V", "m/s^2", "kg m^2/rad^2", "1/s", "kg/(m s K)", "N s/m", "Pa"]
)
def test_a_described_unit_is_that_unit(text: str) -> None:
    dimension = parse_unit(text).dimension
    assert parse_unit(describe(dimension)).dimension == dimension


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mm", "e.g. m instead of mm"),
        ("kN", "e.g. N instead of kN"),
        ("kNm", "e.g. N m instead of kNm"),
        ("deg", "e.g. rad instead of deg"),
        ("rpm", "e.g. rad/s instead of rpm"),
        ("kJ/K", "e.g. J/K instead of kJ/K: 1 kJ/K = 1000 J/K"),
        ("%", "must be in SI units"),
        ("g", "e.g. kg instead of g"),
        ("degC", "e.g. K instead of degC"),
        ("bar", "e.g. Pa instead of bar"),
        ("min", "e.g. s instead of min"),
        ("wug/s", "unknown unit 'wug' in 'wug/s'"),
        *((text, "is not a unit") for text in ("W/m2K", "1e3", "m^99", "m^9^9", "m**9**9**9", "(m)^9", "(m")),
        *((text, "is not a unit") for text in ("m /", "3 m", "m" * 100, "m; import os", "__class__")),
    ],
)
def test_refused(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
        parse_unit(text)
    assert words in str(caught.value)


@given(st.text(st.sampled_from(" mskgNVAKrad*/^()1-.²·%5µ"), max_size=20))
@settings(max_examples=300, deadline=500)
def test_random_units_are_read_or_refused(text: str) -> None:
    try:
        assert len(parse_unit(text).dimension) == len(ONE)
    except ValueError as error:
        assert "\n" not in str(error)


CONTACT = "max(kt*(zu - r), 0)"
TEXTBOOK = {
    "van der Pol, without units": """
states: {x: {unit: ''}, v: {unit: '-'}}
parameters: {mu: {value: 2, unit: 1}}
dynamics: {x: v, v: mu*(1 - x**2)*v - x + 0.5*sin(2*t)}
""",
    "Lorenz": """
states: {x: {unit: 1}, y: {unit: 1}, z: {unit: 1}}
dynamics: {x: 10*(y - x), y: x*(28 - z) - y, z: x*y - 8/3*z}
""",
    "oscillator in numbers": """
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {u: {unit: N}}
dynamics: {x: v, v: -4*x - 2*v - 0.3*x**3 + 100*u + sin(3*t) + exp(-t)}
""",
    "Duffing": """
states: {x: {unit: m}, v: {unit: m/s}}
parameters: {d: {value: 0.2, unit: 1/s}, a: {value: 1, unit: 1/s^2}, c: {value: 1, unit: 1/(m^2 s^2)},
  F: {value: 0.3, unit: m/s^2}, w: {value: 1, unit: rad/s}}
dynamics: {x: v, v: -d*v - a*x - c*x**3 + F*cos(w*t)}
""",
    "DC motor": """
states: {i: {unit: A}, w: {unit: rad/s}}
inputs: {U: {unit: V}}
parameters: {R: {value: 1, unit: ohm}, L: {value: 0.001, unit: H}, k: {value: 0.1, unit: N m/A},
  J: {value: 1e-4, unit: kg m^2}, Tc: {value: 0.01, unit: N m}}
dynamics: {i: (U - R*i - k*w)/L, w: (k*i - Tc*tanh(100*w))/J}
""",
    "Stribeck friction": """
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {F: {unit: N}}
parameters: {m: {value: 1, unit: kg}, Fc: {value: 1, unit: N}, Fs: {value: 2, unit: N},
  vs: {value: 0.01, unit: m/s}, n: {value: 2, unit: 1}}
signals: {f: 'Fc + (Fs - Fc)*exp(-abs(v/vs)**n)', fr: 'f*tanh(v/0.001) + where(abs(v) > 0.5, 0.1*v, 0)'}
dynamics: {x: v, v: (F - fr)/m}
""",
    "LuGre": """
states: {z: {unit: m}, v: {unit: m/s}}
parameters: {s0: {value: 1e5, unit: N/m}, s1: {value: 300, unit: N s/m}, m: {value: 1, unit: kg},
  Fc: {value: 1, unit: N}}
dynamics: {z: v - s0*abs(v)/Fc*z, v: -(s0*z + s1*(v - s0*abs(v)/Fc*z))/m}
""",
    "quarter car": """
states: {zs: {unit: m}, zu: {unit: m}, vs: {unit: m/s}, vu: {unit: m/s}}
inputs: {r: {unit: m}}
parameters: {ms: {value: 250, unit: kg}, mu: {value: 40, unit: kg}, k: {value: 1e4, unit: N/m},
  kt: {value: 2e5, unit: N/m}, c: {value: 1e3, unit: N s/m}}
signals: {F: 'k*(zs - zu) + c*(vs - vu) + 1e5*(zs - zu)**3', bump: 'max(0, zs - zu - 0.05)'}
dynamics: {zs: vs, zu: vu, vs: -F/ms - 9.81 - 1e5*bump/ms, vu: 'F/mu - max(kt*(zu - r), 0)/mu'}
""",
    "tank": """
states: {h: {unit: m}}
inputs: {q: {unit: m^3/s}}
parameters: {A: {value: 1, unit: m^2}, a: {value: 0.01, unit: m^2}, g: {value: 9.81, unit: m/s^2}}
dynamics: {h: '(q - a*sqrt(2*g*max(h, 0)))/A'}
""",
    "drag": """
states: {v: {unit: m/s}}
parameters: {rho: {value: 1.2, unit: kg/m^3}, A: {value: 2, unit: m^2}, cd: {value: 0.3, unit: 1},
  m: {value: 1e3, unit: kg}}
dynamics: {v: -0.5*rho*A*cd*v*abs(v)/m - 0.015*9.81*sign(v)}
""",
    "heat": """
states: {T: {unit: K}}
inputs: {P: {unit: W}}
parameters: {C: {value: 100, unit: J/K}, h: {value: 2, unit: W/K}}
dynamics: {T: (P - h*(T - 293.15))/C}
""",
    "pendulum with wrapped angle": """
states: {q: {unit: rad}, w: {unit: rad/s}}
parameters: {l: {value: 1, unit: m}, g: {value: 9.81, unit: m/s^2}, f: {value: 2, unit: Hz},
  A: {value: 1, unit: 1/s^2}}
signals: {wrapped: 'mod(q + pi, 2*pi) - pi', lag: 'atan2(sin(q), cos(q))'}
dynamics: {q: w, w: -g/l*sin(wrapped) - 0.1*w - 0.1*lag + A*sin(2*pi*f*t)}
""",
    "Coulomb hysteresis": """
states: {x: {unit: m}, z: {unit: N}}
inputs: {v: {unit: m/s}}
parameters: {k: {value: 1, unit: N/m}, F: {value: 1, unit: N}}
dynamics: {x: v, z: k*v*(1 - sign(v)*z/F)}
""",
}


def textbook(folder: Path, body: str) -> System:
    """The system whose only output is its first state."""
    first = body.split("{", 2)[1].split(":")[0]
    unit = body.split("unit:", 1)[1].split("}")[0]
    shown = f"outputs: {{out: {{unit: {unit}, expression: {first}}}}}"
    return system_of(f"schema: system/1\nname: textbook\n{shown}{body}", folder)


@pytest.mark.parametrize("name", TEXTBOOK)
def test_textbook_systems_raise_no_false_alarm(tmp_path: Path, name: str) -> None:
    assert textbook(tmp_path, TEXTBOOK[name]).name == "textbook"


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("Duffing", "cos(w*t)", "cos(w)", "dynamics.v: 'cos(w)': the argument must be without unit, got 1/s"),
        ("Duffing", "-d*v - a*x", "-d*v - d*x", "units differ: '-d*v' is in m/s^2, 'd*x' in m/s"),
        ("DC motor", "(k*i -", "(k*w -", "units differ"),
        ("Stribeck friction", "abs(v/vs)**n", "abs(v*vs)", "the argument must be without unit"),
        ("Stribeck friction", "abs(v/vs)**n", "abs(v/vs)**vs", "an exponent must be without unit"),
        ("tank", "sqrt(2*g*max(h, 0))", "2*g*max(h, 0)", "units differ: 'q' is in m^3/s"),
        ("drag", "v*abs(v)/m", "v/m", "dynamics.v: unit must be m/s^2, got 1/s"),
        ("heat", "h*(T - 293.15)", "h*T*T", "units differ: 'P' is in W, 'h*T*T' in"),
        ("quarter car", CONTACT, "max(kt*(zu - r), zu)", "units differ"),
        ("quarter car", CONTACT, "where(zu > vu, kt*r, 0)", "units differ: 'zu' is in m, 'vu' in m/s"),
        ("quarter car", CONTACT, "where(zu > r, kt*r, r)", "'kt*r' is in N, 'r' in m"),
    ],
)
def test_inconsistent_units_are_found(tmp_path: Path, name: str, old: str, new: str, words: str) -> None:
    assert TEXTBOOK[name].count(old) == 1
    found = refusals(lambda: textbook(tmp_path, TEXTBOOK[name].replace(old, new)))
    assert words in found[0]


TEXT = """
schema: system/1
name: vessel
states: {{h: {{unit: {level}}}, w: {{unit: {level}/s}}}}
inputs: {{u: {{unit: 1/s}}}}
outputs: {{h: {{unit: {level}}}}}
parameters: {{k: {{value: 0.5, unit: 1/s^2}}, c: {{value: 1.0, unit: {gain}}}}}
ports: {{place: {{effort: q, unit: {effort}, {rest}}}}}
dynamics: {{h: w, w: -k*h - q/c}}
"""


def vessel(folder: Path, effort: str, gain: str, rest: str, level: str = "m") -> System:
    return system_of(TEXT.format(level=level, effort=effort, gain=gain, rest=rest), folder)


def tried(system: System) -> set[str]:
    """Families of the effects at ports of the system."""
    return {e.family for e in effects() if any(p.kind == "port" for p in e.places(system))}


@pytest.mark.parametrize(
    ("effort", "gain", "rest", "domain"),
    [
        ("N", "kg", "position: h", "power"),
        ("N", "kg", "position: h, velocity: w", "power"),
        ("N", "kg", "position: h, kind: balance", "balance"),
        ("m^3/s", "m^2 s", "position: h", "balance"),
        ("m^3/s", "m^2 s", "position: h, kind: power", "power"),
        ("m^3/s", "m^2 s", "position: h, velocity: w", "power"),
    ],
)
def test_a_port_is_a_balance_unless_it_is_mechanical(
    effort: str, gain: str, rest: str, domain: str, tmp_path: Path
) -> None:
    system = vessel(tmp_path, effort, gain, rest)
    assert system.port("place").domain == domain
    families = tried(system)
    assert ("overflow" in families) == (domain == "balance")
    assert ("linear_spring" in families) == (domain == "power")
    assert "constant_load" in families


def test_an_effort_without_power_is_a_note_and_a_force_without_power_is_refused(tmp_path: Path) -> None:
    volts = vessel(tmp_path, "V", "s^2", "position: h, velocity: w", level="V")
    (note,) = volts.notes
    assert "ports.place" in note and "V^2/s" in note
    assert vessel(tmp_path, "N", "kg", "position: h, velocity: w").notes == ()
    with pytest.raises(BadInput, match="must be a power, in W"):
        vessel(tmp_path, "N", "kg", "velocity: h")


def test_laws_of_heat_are_tried_where_the_level_is_a_temperature(tmp_path: Path) -> None:
    hot = tried(vessel(tmp_path, "W", "J s/K", "position: h", level="K"))
    wet = tried(vessel(tmp_path, "m^3/s", "m^2 s", "position: h"))
    assert hot - wet == {"radiation"} and wet - hot == {"overflow", "root_outflow"}
