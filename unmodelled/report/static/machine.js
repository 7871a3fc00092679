// Run a program of the register machine in a browser: the twin of interpreter.py and loops.py, one run at a time.
"use strict";

const machine = (() => {
  // numbers of opcodes.py
  const ADD = 0, SUB = 1, MUL = 2, DIV = 3, MULADD = 4, MULSUB = 5, NEGMULADD = 6, NEG = 7, SQRT = 8, SIN = 9, COS = 10,
    EXP = 11, TANH = 12, ABS = 13, SGN = 14, STEP = 15, MIN = 16, MAX = 17, FLOOR = 18, GREATER = 19, AT_LEAST = 20,
    EQUAL = 21, SELECT = 22, LOOKUP = 23, POW = 24, LOG = 25, ASIN = 26, ACOS = 27, ATAN = 28, ATAN2 = 29, SINH = 30,
    COSH = 31;

  // numbers of double precision, as as_text() of javascript.py writes them
  function numbers(text) {
    return new Float64Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  }

  // the content of as_data() of javascript.py, with arrays for what it writes as text
  function loaded(data) {
    const { knots, pieces, spans, ends } = data.curves;
    return {
      ...data,
      code: Int32Array.from(data.code),
      numbers: numbers(data.numbers),
      curves: { knots: numbers(knots), pieces: numbers(pieces), spans, ends: numbers(ends) },
    };
  }

  function lookedUp(x, k, { knots, pieces, spans, ends }) {
    let first = spans[2 * k], last = spans[2 * k + 1];
    if (!(x > knots[first])) return x <= knots[first] ? ends[2 * k] : x;
    if (x >= knots[last]) return ends[2 * k + 1];
    while (last - first > 1) {
      const middle = (first + last) >> 1;
      if (knots[middle] <= x) first = middle; else last = middle;
    }
    const d = x - knots[first], c = 4 * first;
    return ((pieces[c] * d + pieces[c + 1]) * d + pieces[c + 2]) * d + pieces[c + 3];
  }

  // instructions `first` to `last` on the registers w
  function execute(w, code, first, last, curves) {
    for (let i = 6 * first; i < 6 * last; i += 6) {
      const d = code[i + 1], a = w[code[i + 2]], b = w[code[i + 3]], c = w[code[i + 4]];
      switch (code[i]) {
        case ADD: w[d] = a + b; break;
        case SUB: w[d] = a - b; break;
        case MUL: w[d] = a * b; break;
        case DIV: w[d] = a / b; break;
        case MULADD: w[d] = a * b + c; break;
        case MULSUB: w[d] = a * b - c; break;
        case NEGMULADD: w[d] = c - a * b; break;
        case NEG: w[d] = -a; break;
        case SQRT: w[d] = Math.sqrt(a); break;
        case SIN: w[d] = Math.sin(a); break;
        case COS: w[d] = Math.cos(a); break;
        case EXP: w[d] = Math.exp(a); break;
        case TANH: w[d] = Math.tanh(a); break;
        case ABS: w[d] = Math.abs(a); break;
        case SGN: w[d] = a > 0 ? 1 : a < 0 ? -1 : 0; break;
        case STEP: w[d] = a > 0 ? 1 : a < 0 ? 0 : 0.5; break;
        case MIN: w[d] = a < b || a !== a ? a : b; break;
        case MAX: w[d] = a > b || a !== a ? a : b; break;
        case FLOOR: w[d] = Math.floor(a); break;
        case GREATER: w[d] = a > b ? 1 : 0; break;
        case AT_LEAST: w[d] = a >= b ? 1 : 0; break;
        case EQUAL: w[d] = a === b ? 1 : 0; break;
        case SELECT: w[d] = a !== 0 ? b : c; break;
        case LOOKUP: w[d] = lookedUp(a, code[i + 5], curves); break;
        case POW: w[d] = a === 1 || b === 0 ? 1 : a ** b; break; // as in C: 1 to the power of nan is 1
        case LOG: w[d] = Math.log(a); break;
        case ASIN: w[d] = Math.asin(a); break;
        case ACOS: w[d] = Math.acos(a); break;
        case ATAN: w[d] = Math.atan(a); break;
        case ATAN2: w[d] = Math.atan2(a, b); break;
        case SINH: w[d] = Math.sinh(a); break;
        case COSH: w[d] = Math.cosh(a); break;
        default: throw new Error(`no instruction ${code[i]}`);
      }
    }
  }

  // registers of a lane with its constants
  function registers({ at, code, numbers, curves }, p, c, step = 0) {
    const w = new Float64Array(at.rows);
    w.set(numbers, at.numbers);
    w.set(p, at.p);
    w.set(c, at.c);
    w[at.step] = step;
    execute(w, code, at.prologue, at.driven, curves);
    return w;
  }

  /* Observed values, one array for each, at the samples `start` to `start + steps`: integrated by the Runge-Kutta
     method of order four. u: one array of samples for every input; t: times, s; p, c, x0: as in free_run.py;
     how: period (s), substeps, hold (one number for every input). */
  function simulate(program, { u, t, start, steps }, p, c, x0, { period, substeps, hold }) {
    const { at, code, curves, rates, shown } = program;
    const h = period / substeps, w = registers(program, p, c, h), n = rates.length;
    const last = Float64Array.from(x0), total = new Float64Array(n), k1 = new Float64Array(n);
    const now = new Float64Array(u.length), slope = new Float64Array(u.length);
    const found = shown.map(() => new Float64Array(steps + 1));
    w.set(x0, 0);
    let clock = 0;
    const atShare = (share) => {
      for (let j = 0; j < now.length; j++) w[at.u + j] = now[j] + share * slope[j];
      w[at.t] = clock + share * period;
      execute(w, code, at.driven, at.observed, curves);
    };
    for (let k = 0; k <= steps; k++) {
      clock = t[start + k];
      for (let j = 0; j < now.length; j++) {
        now[j] = u[j][start + k];
        slope[j] = hold[j] * (u[j][start + Math.min(k + 1, steps)] - now[j]);
      }
      atShare(0);
      execute(w, code, at.observed, at.rates, curves);
      for (let j = 0; j < found.length; j++) found[j][k] = w[shown[j]];
      if (k === steps) break;
      for (let sub = 0; sub < substeps; sub++) {
        for (let stage = 0; stage < 4; stage++) {
          if (stage === 1 || stage === 3) atShare((sub + (stage === 1 ? 0.5 : 1)) / substeps);
          execute(w, code, at.rates, at.end, curves);
          // the rate of one state may be the register of another, which is about to change
          for (let j = 0; j < n; j++) k1[j] = w[rates[j]];
          const weight = stage === 1 || stage === 2 ? h / 3 : h / 6, part = stage === 2 ? h : 0.5 * h;
          for (let j = 0; j < n; j++) {
            total[j] = (stage === 0 ? last[j] : total[j]) + weight * k1[j];
            w[j] = stage === 3 ? total[j] : last[j] + part * k1[j];
            if (stage === 3) last[j] = total[j];
          }
        }
      }
    }
    return found;
  }

  // observed values at one time (s), state and input, without integration
  function evaluate(program, t, x, u, p, c) {
    const { at, code, curves, shown } = program;
    const w = registers(program, p, c);
    w.set(x, 0);
    w.set(u, at.u);
    w[at.t] = t;
    execute(w, code, at.driven, at.rates, curves);
    return shown.map((row) => w[row]);
  }

  return { numbers, loaded, simulate, evaluate };
})();
