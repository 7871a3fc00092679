// Numbers and units as text, as numbers.py writes them.
"use strict";

const format = (() => {
  const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

  // thin spaces between thousands, from five digits on
  const grouped = (text) => (/^-?\d{5,}$/.test(text) ? text.replace(/\B(?=(\d{3})+$)/g, "\u202f") : text);

  function shown(value, digits = 4) {
    const size = Math.abs(value);
    if (size < 1e7 && (size === 0 || size >= 1e-4)) return grouped(String(Number(value.toPrecision(digits)))).replace("-", "−");
    const [mantissa, exponent] = value.toExponential(Math.min(digits, 3) - 1).split("e");
    return `${Number(mantissa)}×10${[...String(Number(exponent))].map((c) => RAISED[c]).join("")}`.replace("-", "−");
  }

  const unitText = (unit) => (["", "1", "-"].includes(unit) ? "" : unit.replace(/\^(-?\d+)/g, (_, n) => [...n].map((c) => RAISED[c]).join("")));
  const withUnit = (value, unit, digits) => `${shown(value, digits)} ${unitText(unit)}`.trim();
  const named = ({ name, unit }) => (unitText(unit) ? `${name} (${unitText(unit)})` : name);

  // an interval with as many digits as tell its ends apart
  function range(low, high) {
    let digits = 4;
    while (digits < 9 && low !== high && shown(low, digits) === shown(high, digits)) digits += 1;
    return `${shown(low, digits)} to ${shown(high, digits)}`;
  }

  // the unit in which a time of so many seconds reads best, and its size in s
  const LONG = [[86400, "d"], [3600, "h"], [60, "min"]];
  function clock(seconds) {
    const [size, unit] = LONG.find(([own]) => seconds >= 2 * own) ?? [1, "s"];
    return { size, unit };
  }

  return { shown, range, withUnit, named, clock };
})();
