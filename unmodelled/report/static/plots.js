// Plots of the machine: those over time zoom together, colours are those of the page.
"use strict";

const plotting = (() => {
  const plots = [];

  const colour = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const value = (_, v) => (v == null ? "" : format.shown(v));

  // shows a stretch of time in all plots over time
  function zoom(min, max) {
    for (const { chart, overTime } of plots) {
      const { x } = chart.scales;
      if (overTime && (x.min !== min || x.max !== max)) chart.setScale("x", { min, max });
    }
  }

  function line(label, stroke, width = 1.5) {
    return { label, stroke: colour(stroke), width, points: { show: false }, value };
  }

  function dots(label, stroke, size = 3) {
    return { label, stroke: colour(stroke), paths: () => null, points: { show: true, size, width: 0, fill: colour(stroke) }, value };
  }

  // a law that is switched off is zero everywhere
  function around(_, low, high) {
    if (low !== null && low === high) return [low - (Math.abs(low) || 1), high + (Math.abs(high) || 1)];
    return uPlot.rangeNum(low ?? 0, high ?? 1, 0.1, true);
  }

  // room for the longest number beside an axis
  const room = (_, values) => Math.max(40, 16 + 7.6 * Math.max(0, ...(values ?? []).map((v) => v.length)));

  function axis(label, size) {
    const thin = { stroke: colour("--line"), width: 1 }, values = (_, ticks) => ticks.map((v) => format.shown(v));
    return { label, stroke: colour("--soft"), grid: thin, ticks: thin, labelSize: 22, size, values };
  }

  // a label beside an axis of this length (px), shortened with its unit whole
  function fitted(label, length) {
    const most = Math.floor(length / 7.4), unit = label.match(/ \([^()]*\)$/)?.[0] ?? "";
    return label.length <= most ? label : `${label.slice(0, most - unit.length - 1)}…${unit}`;
  }

  // x, y: labels of the axes; series: lines or dots
  function add(host, x, y, series, overTime) {
    const height = Math.round(Math.min(260, Math.max(190, 0.5 * host.clientWidth)));
    const follow = (chart, key) => { if (key === "x" && overTime) zoom(chart.scales.x.min, chart.scales.x.max); };
    const options = {
      width: Math.max(host.clientWidth, 200),
      height,
      scales: { x: { time: false }, y: { range: around } },
      axes: [axis(x, 40), { ...axis(fitted(y, height - 35), room), space: 24 }],
      series: [{ label: x, value }, ...series],
      cursor: overTime ? { sync: { key: "time" } } : {},
      hooks: { setScale: [follow] },
    };
    const chart = new uPlot(options, [[], ...series.map(() => [])], host);
    plots.push({ chart, host, overTime });
    return chart;
  }

  // new numbers; with `keep`, what is zoomed stays zoomed
  function put(chart, data, keep) {
    const { min, max } = chart.scales.x;
    chart.setData(data, !keep || min == null);
    if (keep && min != null) chart.setScale("x", { min, max });
  }

  function clear() {
    for (const { chart } of plots.splice(0)) chart.destroy();
  }

  function fit() {
    for (const { chart, host } of plots) {
      if (Math.abs(host.clientWidth - chart.width) > 1) chart.setSize({ width: Math.max(host.clientWidth, 200), height: chart.height });
    }
  }

  function recolour() {
    for (const { chart } of plots) chart.redraw(false, true);
  }

  return { add, line, dots, put, zoom, clear, fit, recolour };
})();
