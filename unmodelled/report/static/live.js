// The machine of a diagnosis in the page: sliders, switches and plots over simulation.js.
"use strict";

(() => {
  const block = document.getElementById("live-data");
  if (!block) return;
  const model = simulation.loaded(JSON.parse(block.textContent));
  const place = document.getElementById("live-machine");
  const MOST_POINTS = 2500; // of a law
  const STEPS = 500; // of a slider
  const FAR = 100; // ranges of the measured output: a simulation that is farther off has diverged

  // base: the system that has all that no slider holds, such as the timing of inputs
  const now = { experiment: 0, output: 0, steps: model.steps, base: "identified", values: [], own: new Map(), off: new Set() };
  const before = new Map(); // runs of the system as given

  function made(tag, attributes = {}, ...children) {
    const e = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name in e && typeof value !== "string") e[name] = value; else e.setAttribute(name, value);
    }
    e.append(...children);
    return e;
  }

  const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

  function shown(value, digits = 4) {
    const size = Math.abs(value);
    if (size < 1e5 && (size === 0 || size >= 1e-3)) return String(Number(value.toPrecision(digits))).replace("-", "−");
    const [mantissa, exponent] = value.toExponential(Math.min(digits, 3) - 1).split("e");
    return `${mantissa}×10${[...String(Number(exponent))].map((c) => RAISED[c]).join("")}`.replace("-", "−");
  }

  const unitText = (unit) => (["", "1", "-"].includes(unit) ? "" : unit.replace(/\^(-?\d+)/g, (_, n) => [...n].map((c) => RAISED[c]).join("")));
  const withUnit = (value, unit, digits) => `${shown(value, digits)} ${unitText(unit)}`.trim();
  const named = ({ name, unit }) => (unitText(unit) ? `${name} (${unitText(unit)})` : name);
  const colour = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

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

  function asGiven() {
    const e = model.experiments[now.experiment], key = `${now.experiment} ${now.steps}`;
    if (!before.has(key)) before.set(key, simulation.run(model, e, { ...model.given, c: e.given }, now.steps));
    return before.get(key);
  }

  // --- plots

  const plots = [];
  let zooming = false;

  function zoomed(min, max) {
    zooming = true;
    for (const { chart, free } of plots) if (!free) chart.setScale("x", { min, max });
    zooming = false;
  }

  function series(label, stroke, more = {}) {
    return { label, stroke: colour(stroke), width: 1.5, points: { show: false }, value: (_, v) => (v == null ? "–" : shown(v)), ...more };
  }

  // a law that is switched off is zero everywhere
  const around = (_, low, high) => (low === high && low !== null ? [low - (Math.abs(low) || 1), high + (Math.abs(high) || 1)] : uPlot.rangeNum(low ?? 0, high ?? 1, 0.1, true));

  const dots = { paths: () => null, points: { show: true, size: 3, width: 0 } };

  function plot(host, x, y, lines, free) {
    const axis = (label, size) => ({ label, stroke: colour("--soft"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1 }, labelSize: 22, size, values: (_, ticks) => ticks.map((v) => shown(v)) });
    const options = {
      width: Math.max(host.clientWidth, 200),
      height: Math.round(Math.min(260, Math.max(170, 0.5 * host.clientWidth))),
      scales: { x: { time: false }, y: { range: around } },
      axes: [axis(x, 40), axis(y, 62)],
      series: [{ label: x, value: (_, v) => (v == null ? "–" : shown(v)) }, ...lines],
      cursor: free ? {} : { sync: { key: "live" } },
      hooks: { setScale: [(chart, key) => { if (key === "x" && !free && !zooming && chart.status) zoomed(chart.scales.x.min, chart.scales.x.max); }] },
    };
    const chart = new uPlot(options, [[], ...lines.map(() => [])], host);
    plots.push({ chart, host, free });
    return chart;
  }

  // new numbers; what is zoomed stays zoomed
  function put(chart, data, keep) {
    const { min, max } = chart.scales.x;
    zooming = true;
    chart.setData(data, !keep || min == null);
    if (keep && min != null) chart.setScale("x", { min, max });
    zooming = false;
  }

  const finite = (values, low, high) => Array.from(values, (v) => (v > low && v < high ? v : null));

  function rms(values, measured) {
    let sum = 0, count = 0;
    values.forEach((v, k) => { if (v != null) { sum += (v - measured[k]) ** 2; count += 1; } });
    return count ? Math.sqrt(sum / count) : NaN;
  }

  function lawPoints(k, run, given) {
    const at = 2 * model.effects.slice(0, k).filter((e) => e.curve).length;
    const [x, y] = [run.further[at], run.further[at + 1]];
    const every = Math.ceil(x.length / MOST_POINTS), points = [];
    for (let i = 1; i < x.length; i += every) if (Number.isFinite(x[i]) && Number.isFinite(y[i])) points.push([x[i], y[i], given]);
    return points;
  }

  // --- what is built once

  const picker = made("select", { id: "live-experiment" }, ...model.experiments.map((e, i) => made("option", { value: String(i) }, `${e.id}${e.held_out ? " (held out)" : ""}`)));
  const outputs = made("select", { id: "live-output" }, ...model.outputs.map((y, j) => made("option", { value: String(j) }, y.name)));
  const horizon = shown(model.steps * model.period);
  const modes = made("select", { id: "live-mode" }, made("option", { value: String(model.steps) }, `windows of ${horizon} s`), made("option", { value: "Infinity" }, "the whole run"));
  const status = made("p", { class: "live-status", role: "status" });
  const extent = made("p", { class: "live-extent" });
  const hosts = { trajectory: made("div", { role: "img" }), residual: made("div", { role: "img" }) };
  const laws = model.effects.map((e) => e.curve && made("div", { role: "img" }));
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
    const interval = number.interval ? `95 % interval ${shown(number.interval[0])} to ${shown(number.interval[1])}` : "a value of its own for every experiment";
    const known = number.known == null ? "" : `, ${shown(number.known)} in the system file`;
    const row = made("div", { class: "slider" }, made("label", { for: input.id }, number.name), output, track, made("small", {}, interval + known));
    const tell = () => {
      const value = valueOf(i);
      input.value = String(value);
      output.textContent = withUnit(value, number.unit);
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
    zoomed(middle - half, middle + half);
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
    const measured = e.y[j].values, given = asGiven(), run = simulation.run(model, e, setting(), now.steps);
    const low = measured.reduce((a, b) => Math.min(a, b)), high = measured.reduce((a, b) => Math.max(a, b)), room = FAR * (high - low);
    const [old, fresh] = [given, run].map((r) => finite(r.outputs[j], low - room, high + room));
    const minus = (values) => values.map((v, k) => (v == null ? null : v - measured[k]));
    put(charts.trajectory, [run.t, measured, old, fresh], keep);
    put(charts.residual, [run.t, minus(old), minus(fresh)], keep);
    model.effects.forEach((effect, k) => {
      if (!effect.curve) return;
      const points = lawPoints(k, run).sort((a, b) => a[0] - b[0]);
      put(charts.laws[k], [points.map((q) => q[0]), points.map((q) => q[1])], false);
    });
    keep = true;
    const lost = (values, r) => values.some((v, k) => v === null && k > 0 && !Number.isNaN(r.outputs[j][k]));
    const told = (values, r) => (lost(values, r) ? "diverges" : withUnit(rms(values, measured), output.unit, 3));
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
    for (const { chart } of plots.splice(0)) chart.destroy();
    const output = model.outputs[now.output];
    charts = {
      trajectory: plot(hosts.trajectory, "t (s)", named(output), [series("measured", "--measured", { width: 3 }), series("as given", "--before"), series("now", "--after")], false),
      residual: plot(hosts.residual, "t (s)", `error of ${named(output)}`, [series("as given", "--before"), series("now", "--after")], false),
      laws: model.effects.map(({ curve }, k) => curve && plot(laws[k], named({ name: curve.x, unit: curve.x_unit }), named({ name: curve.y, unit: curve.unit }), [series("law, now", "--after", dots)], true)),
    };
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
    button("All", () => { const t = charts.trajectory.data[0]; zoomed(t[0], t[t.length - 1]); }, "Whole experiment"));
  const groups = [...model.effects.map(effectGroup), ...parameterGroup()];
  const buttons = made("div", { class: "live-buttons" }, button("As identified", reset), button("As given", allAsGiven));
  const pictures = [hosts.trajectory, hosts.residual, ...laws.filter(Boolean)];
  place.append(
    made("div", { class: "live-choices" }, ...choices, zoom),
    made("div", { class: "live-plots" }, status, ...pictures, extent),
    made("div", { class: "live-controls" }, ...groups, ...(groups.length ? [buttons] : [])),
  );
  place.hidden = false;
  build();
  refresh();
  new ResizeObserver(() => {
    for (const { chart, host } of plots) {
      if (Math.abs(host.clientWidth - chart.width) > 1) chart.setSize({ width: Math.max(host.clientWidth, 200), height: chart.height });
    }
  }).observe(place);
  const recolour = () => { for (const { chart } of plots) chart.redraw(false, true); };
  new MutationObserver(recolour).observe(document.documentElement, { attributeFilter: ["data-theme"] });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
})();
