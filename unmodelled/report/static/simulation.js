// Free runs over a measured experiment in a browser: the twin of diagnosis/fitting/simulation.py and of what it reads.
"use strict";

const simulation = (() => {
  const WHOLE = 1e-6; // of a sample: closer to a whole number is that number
  const OBSERVER_SUBSTEPS = [4, 32];

  // the content of tables/live.json, with arrays for what it writes as text
  function loaded(data) {
    const program = (given) => given && machine.loaded(given);
    const values = ({ p, inputs, outputs }) => ({ p: machine.numbers(p), inputs, outputs });
    const series = (text) => ({ values: machine.numbers(text), pieces: null });
    const { derived, observer } = data;
    return {
      ...data,
      program: program(data.program),
      gains: program(data.gains),
      beside: program(data.beside),
      derived: derived && { ...derived, program: program(derived.program) },
      observer: observer && { ...observer, program: program(observer.program), initial: program(observer.initial) },
      given: values(data.given),
      identified: values(data.identified),
      experiments: data.experiments.map((e) => ({
        ...e,
        u: e.u.map(series),
        y: e.y.map(series),
        v: Object.fromEntries(Object.entries(e.v).map(([j, text]) => [j, series(text)])),
        given: machine.numbers(e.given),
        identified: machine.numbers(e.identified),
        hidden: e.hidden && machine.numbers(e.hidden),
      })),
    };
  }

  function whole(steps) {
    const nearest = Math.round(steps);
    if (Math.abs(steps - nearest) < WHOLE) return [nearest, 0];
    return [Math.floor(steps), steps - Math.floor(steps)];
  }

  // slopes of the cubic spline through uniform samples whose first two and last two pieces are one cubic each
  function splineSlopes(y) {
    const n = y.length, m = (i) => y[i + 1] - y[i];
    const above = new Float64Array(n), s = new Float64Array(n);
    above[0] = 2;
    s[0] = (5 * m(0) + m(1)) / 2;
    for (let i = 1; i < n - 1; i++) {
      const pivot = 4 - above[i - 1];
      above[i] = 1 / pivot;
      s[i] = (3 * (y[i + 1] - y[i - 1]) - s[i - 1]) / pivot;
    }
    s[n - 1] = ((m(n - 3) + 5 * m(n - 2)) / 2 - 2 * s[n - 2]) / (1 - 2 * above[n - 2]);
    for (let i = n - 2; i >= 0; i--) s[i] -= above[i] * s[i + 1];
    return s;
  }

  // samples read some steps later, held beyond the ends; between samples by a cubic spline, or by straight lines
  function ahead(series, steps, cubic) {
    const y = series.values, n = y.length, [shift, rest] = whole(steps);
    if (shift === 0 && rest === 0) return y;
    if (rest && cubic) series.pieces ??= splineSlopes(y);
    const s = series.pieces, found = new Float64Array(n);
    for (let k = 0; k < n; k++) {
      const at = Math.min(Math.max(k + shift, 0), n - 1), next = Math.min(Math.max(k + shift + 1, 0), n - 1);
      const inside = k + shift >= 0 && at < n - 1;
      if (!cubic || !rest || !inside) {
        found[k] = y[at] + (cubic ? 0 : rest * (y[next] - y[at]));
      } else {
        const m = y[next] - y[at], c = s[at] + s[next] - 2 * m;
        found[k] = ((c * rest + (m - s[at] - c)) * rest + s[at]) * rest + y[at];
      }
    }
    return found;
  }

  // gain, offset and lag of every reading at every sample
  function gainsOf(model, n, u, p, c) {
    const x = new Float64Array(model.program.rates.length), rest = new Float64Array(u.length);
    if (model.steady) {
      const once = machine.evaluate(model.gains, 0, x, rest, p, c);
      return () => once;
    }
    return (k) => machine.evaluate(model.gains, 0, x, u.map((column) => column[k]), p, c);
  }

  // states that outputs measure, at every sample
  function measuredStates(model, experiment, u, p, c, delays) {
    const n = experiment.y[0].values.length, late = delays.map((delay) => delay / model.period);
    const shown = (j, more) => ahead(experiment.y[j], late[j] + more, true);
    const slope = (j, more) => ahead(experiment.v[j], late[j] + more, true);
    if (!model.gains) return model.readings.map((r) => (r.slope ? slope : shown)(r.output, 0));
    const gains = gainsOf(model, n, u, p, c);
    const every = Array.from({ length: n }, (_, k) => gains(k));
    return model.readings.map(({ output, slope: derivative }, j) => {
      const lag = every.map((g) => g[3 * j + 2]), most = Math.max(0, lag.reduce((a, b) => Math.max(a, b), 0));
      const read = derivative ? slope(output, most / model.period) : shown(output, 0);
      const rate = !derivative && most > 0 ? slope(output, 0) : null;
      return Float64Array.from(read, (y, k) => (y + (rate ? lag[k] * rate[k] : 0) - every[k][3 * j + 1]) / every[k][3 * j]);
    });
  }

  // states that no output measures, integrated from the start of the experiment with the others imposed
  function hiddenStates(model, u, x, t, p, c, substeps, start) {
    const { program, initial, columns, hold } = model.observer;
    const driving = [...u, ...x], own = columns.map((j) => driving[j]), n = t.length;
    const none = new Float64Array(program.rates.length);
    // of an experiment that continues another one, the page does not have the record before it
    const x0 = start || machine.evaluate(initial, t[0], none, own.map((column) => column[0]), p, c);
    let found = [];
    for (const steps of [substeps, ...OBSERVER_SUBSTEPS.filter((more) => more > substeps)]) {
      const how = { period: model.period, substeps: steps, hold };
      found = machine.simulate(program, { u: own, t, start: 0, steps: n - 1 }, p, c, x0, how);
      if (found.every((z) => z.every(Number.isFinite))) break;
    }
    return found;
  }

  // weights of the polynomial through `count` neighbours at 0, 1, ... for its value at `at`
  function weights(count, at) {
    return Array.from({ length: count }, (_, a) => {
      let weight = 1;
      for (let b = 0; b < count; b++) if (b !== a) weight *= (at - b) / (a - b);
      return weight;
    });
  }

  // value a fraction of a sample before sample k of a window, by the cubic through four neighbours
  function delayedValue(y, k, late) {
    const last = y.length - 1, first = Math.max(0, Math.min(k + Math.floor(-late) - 1, last - 3));
    return weights(Math.min(4, last + 1 - first), k - late - first).reduce((sum, w, a) => sum + w * y[first + a], 0);
  }

  /* Simulated outputs and further observed values of an experiment, one array of samples for each, nan where nothing
     is simulated. setting: p, c, and delays `inputs` and `outputs` (s); steps: samples of a window, or Infinity. */
  function run(model, experiment, setting, steps) {
    const { period, substeps, hold } = model, n = experiment.y[0].values.length;
    const p = Float64Array.from(setting.p), c = setting.c;
    if (model.derived) {
      const x = new Float64Array(model.program.rates.length), u = new Float64Array(hold.length);
      const found = machine.evaluate(model.derived.program, 0, x, u, p, c);
      model.derived.at.forEach((index, k) => { p[index] = found[k]; });
    }
    const t = Float64Array.from({ length: n }, (_, k) => period * k);
    const u = experiment.u.map((column, j) => ahead(column, -setting.inputs[j] / period, false));
    const x = measuredStates(model, experiment, u, p, c, setting.outputs);
    const z = model.hidden.length ? hiddenStates(model, u, x, t, p, c, substeps, experiment.hidden) : [];
    const late = setting.outputs.map((delay) => delay / period), later = late.map((d) => Math.floor(d + WHOLE));
    const samples = n - Math.max(...later), found = model.program.shown.map(() => new Float64Array(n).fill(NaN));
    for (let start = 0; start < samples - 1; start += steps) {
      const length = Math.min(steps, samples - 1 - start), x0 = new Float64Array(model.program.rates.length);
      model.readings.forEach((r, j) => { x0[r.state] = x[j][start]; });
      model.hidden.forEach((state, j) => { x0[state] = z[j][start]; });
      if (model.beside) {
        const none = new Float64Array(u.length), beside = machine.evaluate(model.beside, 0, x0, none, p, c);
        model.readings.forEach((r, j) => { x0[r.state] -= beside[j]; });
      }
      const y = machine.simulate(model.program, { u, t, start, steps: length }, p, c, x0, { period, substeps, hold });
      y.forEach((values, j) => {
        const isOutput = j < late.length, rest = isOutput ? late[j] - later[j] : 0;
        for (let k = 1; k <= length; k++) {
          const value = Math.abs(rest) <= WHOLE ? values[k] : delayedValue(values, k, rest);
          found[j][start + k + (isOutput ? later[j] : 0)] = value;
        }
      });
    }
    return { t, outputs: found.slice(0, late.length), further: found.slice(late.length) };
  }

  return { loaded, run };
})();
