// The machine of a diagnosis or of a simulation in the page: sliders, switches and plots over simulation.js.
"use strict";

(() => {
  const block = document.getElementById("live-data");
  if (!block) return;
  const model = simulation.loaded(JSON.parse(block.textContent));
  const place = document.getElementById("live-machine");
  const { shown, range, withUnit, named, clock } = format;
  const MOST_POINTS = 2500; // of a law
  const MOST_INPUTS = 3; // that are plotted
  const STEPS = 500; // of a slider
  const FAR = 100; // ranges of the measured output: a simulation that is farther off has diverged

  // base: the system that has all that no slider holds, such as the timing of inputs
  const now = { experiment: 0, output: 0, steps: model.steps, base: "identified", values: [], own: new Map(), off: new Set() };
  const runs = new Map(); // of the system as given and as identified
  const time = clock(model.period * Math.max(...model.experiments.map((e) => e.y[0].values.length)));
  const T = `t (${time.unit})`;

  function made(tag, attributes = {}, ...children) {
    const e = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name in e && typeof value !== "string") e[name] = value; else e.setAttribute(name, value);
    }
    e.append(...children);
    return e;
  }

  // --- the numbers that the sliders hold

  function identified({ at }) {
    if (at.kind === "p") return model.identified.p[at.index];
    return at.kind === "c" ? model.experiments[now.experiment].identified[at.index] : at.value;
  }

  function valueOf(i) {
    const number = model.numbers[i];
    const held = number.at.kind === "c" ? now.own.get(`${i} ${now.experiment}`) : now.values[i];
    return held ?? identified(number);
  }

  function setValue(i, value) {
    if (model.numbers[i].at.kind === "c") now.own.set(`${i} ${now.experiment}`, value); else now.values[i] = value;
  }

  const isDelay = ({ kind }) => kind === "inputs" || kind === "outputs";

  function setting() {
    const { p, inputs, outputs } = model[now.base], e = model.experiments[now.experiment];
    const found = { p: p.slice(), c: e[now.base].slice(), inputs: [...inputs], outputs: [...outputs] };
    const held = new Map(model.numbers.map(({ at }, i) => [`${at.kind} ${at.index}`, valueOf(i)]));
    model.numbers.forEach(({ at }, i) => { if (!isDelay(at)) found[at.kind][at.index] = valueOf(i); });
    model.effects.forEach((effect, k) => {
      for (const at of effect.off) {
        const value = now.off.has(k) ? 0 : held.get(`${at.kind} ${at.index}`) ?? identified({ at });
        if (!isDelay(at)) found[at.kind][at.index] = value;
        else found[at.kind][at.index] += value - (now.base === "identified" ? at.value : 0);
      }
    });
    return found;
  }

  // the run of the system as given, or as identified
  function ran(kind) {
    const e = model.experiments[now.experiment], key = `${kind} ${now.experiment} ${now.steps}`;
    if (!runs.has(key)) runs.set(key, simulation.run(model, e, { ...model[kind], c: e[kind] }, now.steps));
    return runs.get(key);
  }

  // --- what the plots show

  // values in SI units in the unit of a column, whose unit and zero have these values in SI units
  const ONE = [1, 0];
  const inUnit = (value, [factor, offset]) => (value == null ? value : (value - offset) / factor);

  const finite = (values, low, high) => Array.from(values, (v) => (v > low && v < high ? v : null));

  function rms(values, measured) {
    let sum = 0, count = 0;
    values.forEach((v, k) => { if (v != null) { sum += (v - measured[k]) ** 2; count += 1; } });
    return count ? Math.sqrt(sum / count) : NaN;
  }

  const over = (run) => Array.from(run.t, (t) => t / time.size);

  // coordinate and law of an effect among what is observed beside the outputs
  const curveOf = (k, run) => run.further.slice(2 * model.effects.slice(0, k).filter((e) => e.curve).length);

  // coordinate and law of an effect at some samples
  function lawPoints(k, run) {
    const [x, y] = curveOf(k, run), every = Math.ceil(x.length / MOST_POINTS), points = [];
    const { x_scale: across = ONE, y_scale: up = ONE } = model.effects[k].curve;
    for (let i = 1; i < x.length; i += every) if (Number.isFinite(x[i]) && Number.isFinite(y[i])) points.push([inUnit(x[i], across), inUnit(y[i], up)]);
    return points;
  }

  // missing effort as estimated from the measurements, and the law now, over the time of the experiment
  function effortData(k, run) {
    const { curve, missing } = model.effects[k], [, along] = curveOf(k, run);
    const estimated = Array(run.t.length).fill(null), found = missing?.[model.experiments[now.experiment].id];
    found?.at.forEach((sample, i) => { if (sample < estimated.length) estimated[sample] = found.value[i]; });
    const law = Array.from(along, (v) => (Number.isFinite(v) ? inUnit(v, curve.y_scale ?? ONE) : null));
    return [over(run), estimated, law];
  }

  // the law as identified, and now, over one axis
  function lawData(k, run) {
    const points = [ran("identified"), run].flatMap((r, which) => lawPoints(k, r).map((q) => [...q, which]));
    points.sort((a, b) => a[0] - b[0]);
    const only = (which) => points.map((q) => (q[2] === which ? q[1] : null));
    return [points.map((q) => q[0]), only(0), only(1)];
  }

  // --- what is built once

  const picker = made("select", { id: "live-experiment" }, ...model.experiments.map((e, i) => made("option", { value: String(i) }, `${e.id}${e.held_out ? " (held out)" : ""}`)));
  const outputs = made("select", { id: "live-output" }, ...model.outputs.map((y, j) => made("option", { value: String(j) }, y.name)));
  const horizon = model.steps * model.period, read = clock(horizon);
  const modes = made("select", { id: "live-mode" }, made("option", { value: String(model.steps) }, `windows of ${withUnit(horizon / read.size, read.unit)}`), made("option", { value: "Infinity" }, "the whole run"));
  const status = made("p", { class: "live-status", role: "status" });
  const extent = made("p", { class: "live-extent" });
  const hosts = { trajectory: made("div", { role: "img" }), residual: made("div", { role: "img" }) };
  const driving = model.inputs.slice(0, MOST_INPUTS).map(() => made("div", { role: "img" }));
  const laws = model.effects.map((e) => e.curve && made("div", { role: "img" }));
  const efforts = model.effects.map((e) => e.curve && e.missing && made("div", { role: "img" }));
  const rows = [];

  function labelled(text, control) {
    return made("label", { for: control.id }, made("span", {}, text), control);
  }

  function slider(number, i) {
    const input = made("input", { type: "range", id: `live-${i}`, min: String(number.low), max: String(number.high), step: String((number.high - number.low) / STEPS) });
    const output = made("output", { for: input.id });
    const track = made("div", { class: "track" }, input);
    const share = (value) => String((value - number.low) / (number.high - number.low));
    const scale = made("div", { class: "scale", "aria-hidden": "true" });
    if (number.interval) {
      const [from, to] = number.interval.map((v) => Math.min(Math.max(v, number.low), number.high));
      const band = made("span", { class: "band" });
      band.style.setProperty("--from", share(from));
      band.style.setProperty("--to", share(to));
      scale.append(band);
    }
    if (number.known != null && number.known >= number.low && number.known <= number.high) {
      const mark = made("span", { class: "known" });
      mark.style.setProperty("--from", share(number.known));
      scale.append(mark);
    }
    track.append(scale);
    const { symbol, unit: own, slope, shift } = number.said ?? { symbol: number.name, unit: number.unit, slope: 1, shift: 0 };
    const { size, unit } = own === "s" ? clock(Math.abs(slope * valueOf(i) + shift)) : { size: 1, unit: own };
    const said = (value) => (slope * value + shift) / size, told = [];
    if (number.interval) told.push(`95 % interval ${range(...number.interval.map(said))}`);
    else if (number.at.kind === "c") told.push("a value of its own for every experiment");
    if (number.known != null) told.push(`${shown(said(number.known))} in the system file`);
    const row = made("div", { class: "slider" }, made("label", { for: input.id }, symbol), output, track, made("small", {}, told.join(", ")));
    const tell = () => {
      const value = valueOf(i);
      input.value = String(value);
      output.textContent = withUnit(said(value), unit);
      const inside = number.interval && value >= number.interval[0] && value <= number.interval[1];
      input.setAttribute("aria-valuetext", output.textContent + (number.interval ? `, ${inside ? "inside" : "outside"} the 95 % interval` : ""));
      input.disabled = now.off.has(number.effect);
    };
    input.addEventListener("input", () => { setValue(i, Number(input.value)); tell(); later(); });
    rows.push(tell);
    return row;
  }

  function effectGroup(effect, k) {
    const box = made("input", { type: "checkbox", id: `live-effect-${k}`, role: "switch", checked: true });
    box.addEventListener("change", () => { if (box.checked) now.off.delete(k); else now.off.add(k); refresh(); });
    rows.push(() => { box.checked = !now.off.has(k); });
    const own = model.numbers.map((number, i) => (number.effect === k ? slider(number, i) : null)).filter(Boolean);
    return made("fieldset", {}, made("legend", {}, made("label", { class: "switch", for: box.id }, box, made("span", {}, effect.name))), ...own);
  }

  function parameterGroup() {
    const own = model.numbers.map((number, i) => (number.effect === null ? slider(number, i) : null)).filter(Boolean);
    return own.length ? [made("fieldset", {}, made("legend", {}, "Parameters of the system file"), ...own)] : [];
  }

  function button(text, act, label = text) {
    const b = made("button", { type: "button", "aria-label": label }, text);
    b.addEventListener("click", act);
    return b;
  }

  function reset() {
    now.base = "identified";
    now.values = [];
    now.own.clear();
    now.off.clear();
    refresh();
  }

  function allAsGiven() {
    reset();
    now.base = "given";
    model.numbers.forEach((number, i) => { if (number.effect === null && number.known != null) setValue(i, number.known); });
    model.effects.forEach((_, k) => now.off.add(k));
    refresh();
  }

  function zoomBy(factor, shift) {
    const { min, max } = charts.trajectory.scales.x, half = (0.5 * (max - min)) * factor, middle = 0.5 * (min + max) + shift * (max - min);
    plotting.zoom(middle - half, middle + half);
  }

  // --- what follows a change

  let charts = null, waiting = 0, speaking = 0, keep = false;

  function later() {
    if (!waiting) waiting = requestAnimationFrame(() => { waiting = 0; draw(); });
  }

  function refresh() {
    rows.forEach((tell) => tell());
    later();
  }

  function draw() {
    const e = model.experiments[now.experiment], j = now.output, output = model.outputs[j];
    const measured = e.y[j].values, given = ran("given"), run = simulation.run(model, e, setting(), now.steps);
    const low = measured.reduce((a, b) => Math.min(a, b)), high = measured.reduce((a, b) => Math.max(a, b)), room = FAR * (high - low);
    const [old, fresh] = [given, run].map((r) => finite(r.outputs[j], low - room, high + room));
    const scale = [output.factor ?? 1, output.offset ?? 0], inColumn = (values) => Array.from(values, (v) => inUnit(v, scale));
    const minus = (values) => values.map((v, k) => (v == null ? null : (v - measured[k]) / scale[0]));
    plotting.put(charts.trajectory, [over(run), ...[measured, old, fresh].map(inColumn)], keep);
    plotting.put(charts.residual, [over(run), minus(old), minus(fresh)], keep);
    charts.driving.forEach((chart, i) => {
      const { name, factor = 1, offset = 0 } = model.inputs[i];
      plotting.put(chart, [over(run), Array.from(e.u[i].values, (v) => inUnit(v, [factor, offset]))], keep);
      driving[i].setAttribute("aria-label", `Input ${name} over time in ${e.id}`);
    });
    model.effects.forEach((effect, k) => {
      if (!effect.curve) return;
      if (charts.efforts[k]) plotting.put(charts.efforts[k], effortData(k, run), keep);
      plotting.put(charts.laws[k], lawData(k, run), false);
    });
    keep = true;
    const lost = (values, r) => values.some((v, k) => v === null && k > 0 && !Number.isNaN(r.outputs[j][k]));
    const told = (values, r) => (lost(values, r) ? "diverges" : withUnit(rms(values, measured) / scale[0], output.error_unit ?? output.unit, 3));
    const text = `Root mean square error of ${output.name} in ${e.id}: ${told(old, given)} as given, ${told(fresh, run)} now.`;
    status.dataset.before = String(rms(old, measured));
    status.dataset.after = String(rms(fresh, measured));
    clearTimeout(speaking);
    speaking = setTimeout(() => { status.textContent = text; }, status.textContent ? 150 : 0);
    hosts.trajectory.setAttribute("aria-label", `${output.name} over time in ${e.id}: measured, as given and now. ${text}`);
    hosts.residual.setAttribute("aria-label", `Simulated minus measured ${output.name} over time in ${e.id}. ${text}`);
    extent.textContent = e.logged > measured.length ? `The page holds the first ${measured.length} of ${e.logged} samples of ${e.id}.` : "";
  }

  function build() {
    plotting.clear();
    const output = model.outputs[now.output];
    const both = [plotting.line("as given", "--before"), plotting.line("now", "--after")];
    const law = (curve, host) => plotting.add(
      host, named({ name: curve.x, unit: curve.x_unit }), named({ name: curve.y, unit: curve.unit }),
      [plotting.dots("as identified", "--measured"), plotting.dots("now", "--after")], false,
    );
    const effort = (curve, host) => plotting.add(
      host, T, named({ name: curve.y, unit: curve.unit }),
      [plotting.dots("missing, from the measurements", "--measured", 5), plotting.line("law now", "--after")], true,
    );
    charts = {
      trajectory: plotting.add(hosts.trajectory, T, named(output), [plotting.line("measured", "--measured", 3), ...both], true),
      residual: plotting.add(hosts.residual, T, named({ name: "error", unit: output.error_unit ?? output.unit }), both, true),
      driving: driving.map((host, i) => plotting.add(host, T, named(model.inputs[i]), [plotting.line("input", "--measured")], true)),
      efforts: model.effects.map(({ curve }, k) => efforts[k] && effort(curve, efforts[k])),
      laws: model.effects.map(({ curve }, k) => curve && law(curve, laws[k])),
    };
    model.effects.forEach((effect, k) => efforts[k]?.setAttribute("aria-label", `${effect.name}: missing ${effect.curve.y} over time, and the law now`));
    model.effects.forEach((effect, k) => laws[k]?.setAttribute("aria-label", `${effect.name}: ${effect.curve.y} over ${effect.curve.x}`));
  }

  function chosen(select, key, changed) {
    select.addEventListener("change", () => { now[key] = Number(select.value); changed(); refresh(); });
  }

  chosen(picker, "experiment", () => { keep = false; });
  chosen(outputs, "output", () => { build(); keep = false; });
  chosen(modes, "steps", () => {});
  const choices = [labelled("Experiment", picker), ...(model.outputs.length > 1 ? [labelled("Output", outputs)] : []), labelled("Free runs over", modes)];
  const zoom = made("div", { class: "zoom", role: "group", "aria-label": "Time that the plots show" },
    button("+", () => zoomBy(0.5, 0), "Zoom in"), button("−", () => zoomBy(2, 0), "Zoom out"),
    button("←", () => zoomBy(1, -0.25), "Earlier"), button("→", () => zoomBy(1, 0.25), "Later"),
    button("All", () => { const t = charts.trajectory.data[0]; plotting.zoom(t[0], t[t.length - 1]); }, "Whole experiment"));
  const groups = [...model.effects.map(effectGroup), ...parameterGroup()];
  const fitted = model.effects.length > 0 || model.numbers.some(({ interval }) => interval);
  const buttons = made("div", { class: "live-buttons" }, ...(fitted ? [button("As identified", reset)] : []), button("As given", allAsGiven));
  const pictures = [hosts.trajectory, hosts.residual, ...driving, ...efforts.flatMap((host, k) => [host, laws[k]]).filter(Boolean)];
  place.append(
    made("div", { class: "live-choices" }, ...choices, zoom),
    made("div", { class: "live-plots" }, status, ...pictures, extent),
    made("div", { class: "live-controls" }, ...groups, ...(groups.length ? [buttons] : [])),
  );
  place.hidden = false;
  build();
  refresh();
  new ResizeObserver(plotting.fit).observe(place);
  new MutationObserver(plotting.recolour).observe(document.documentElement, { attributeFilter: ["data-theme"] });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", plotting.recolour);
})();
