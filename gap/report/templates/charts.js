/* The charts of section "signals": all channels of a run under each other, zoom and pointer shared. */
(function () {
  "use strict";
  const data = JSON.parse(document.getElementById("signals-data").textContent);
  const AT_ONCE = 6; // charts of a run that are drawn together, those that are furthest off
  const box = document.getElementById("charts");
  const runs = document.getElementById("chart-run");
  const channels = document.getElementById("chart-channel");
  const shown = Object.fromEntries(data.curves.map((c) => [c.key, true]));
  let plots = [];

  /* A base64 text as numbers; what is not a number becomes null, where uPlot draws nothing. */
  function numbers(text, Kind, middle) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return Array.from(new Kind(bytes.buffer), (v) => (Number.isFinite(v) ? v + middle : null));
  }

  /* Five significant digits, without an exponent where that is readable. */
  function show(v, unit) {
    if (v == null) return "–";
    const size = Math.abs(v);
    const text = size !== 0 && (size < 1e-4 || size >= 1e7) ? v.toExponential(3) : String(Number(v.toPrecision(5)));
    return text.replace("-", "−") + (unit ? " " + unit : "");
  }

  function ticks(u, values) {
    return values.map((v) => (v == null ? "" : show(v, "")));
  }

  /* What is drawn on a channel's two charts. */
  function decoded(trace) {
    const known = data.curves.filter((c) => trace[c.key] !== undefined);
    const y = Object.fromEntries(known.map((c) => [c.key, numbers(trace[c.key], Float32Array, trace.middle)]));
    const t = numbers(trace.t, Float64Array, 0);
    const noise = trace.noise ? numbers(trace.noise, Float32Array, 0) : null;
    return { known, y, t, noise };
  }

  /* Shares a zoom with all other charts. */
  function follow(u, scale) {
    if (scale !== "x") return;
    const { min, max } = u.scales.x;
    for (const other of plots) {
      const x = other.scales.x;
      if (other !== u && (x.min !== min || x.max !== max)) other.setScale("x", { min, max });
    }
  }

  /* Dotted lines at the times at which the residual changes its level. */
  function marks(times) {
    return (u) => {
      const g = u.ctx, { left, top, width, height } = u.bbox;
      g.save();
      g.strokeStyle = "#555b63";
      g.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
      g.beginPath();
      for (const t of times) {
        const x = u.valToPos(t, "x", true);
        if (x >= left && x <= left + width) { g.moveTo(x, top); g.lineTo(x, top + height); }
      }
      g.stroke();
      g.restore();
    };
  }

  function plot(parent, height, unit, values, series, bands, times, last) {
    const u = new uPlot({
      width: Math.max(320, parent.clientWidth), height,
      scales: { x: { time: false } },
      axes: [
        { values: (_, v) => v.map((t) => show(t, "")), size: 30, label: last ? "time [s]" : undefined, labelSize: 15, labelFont: "12px sans-serif", font: "12px sans-serif" },
        { values: ticks, size: 74, space: 24, label: unit ? "[" + unit + "]" : "[–]", labelSize: 18, labelFont: "12px sans-serif", font: "12px sans-serif" },
      ],
      series: [{ label: "time", value: (_, v) => show(v, "s") }, ...series],
      bands,
      cursor: { sync: { key: "signals", scales: ["x", null], setSeries: false }, drag: { x: true, y: false } },
      legend: { live: true, isolate: false },
      hooks: { setScale: [follow], draw: times.length ? [marks(times)] : [] },
    }, values, parent);
    plots.push(u);
    return u;
  }

  function heading(parent, trace) {
    const line = document.createElement("h4");
    line.textContent = trace.name + " ";
    const more = document.createElement("span");
    const off = (trace.off || []).join(" → ");
    more.textContent = (trace.connector && trace.connector !== trace.name ? trace.connector + " " : "") +
      (off ? "off by " + off + " times the noise (RMS: as delivered, calibrated" + (trace.off.length > 2 ? ", with the effects)" : ")") : "measured, drives the model");
    line.append(more);
    parent.append(line);
  }

  function draw(trace) {
    const parent = document.createElement("div");
    parent.className = "chart";
    box.append(parent);
    heading(parent, trace);
    const { known, y, t, noise } = decoded(trace);
    const line = (c, label) => ({
      label, stroke: c.colour, width: c.key === "measured" ? 2.5 : 1.4, alpha: c.key === "measured" ? 0.55 : 1,
      dash: c.key === "explained" ? [7, 3] : undefined, points: { show: false }, show: shown[c.key],
      value: (_, v) => show(v, trace.unit), curve: c.key,
    });
    const keys = (u, list) => { u.curves = [null, ...list]; return u; };
    keys(plot(parent, noise ? 170 : 140, trace.unit, [t, ...known.map((c) => y[c.key])], known.map((c) => line(c, c.name)), [], [], !noise),
      known.map((c) => c.key));
    if (!noise) return;
    const models = known.filter((c) => c.key !== "measured");
    const left = models.map((c) => y[c.key].map((v, i) => (v == null ? null : y.measured[i] - v)));
    const edge = (sign, label) => ({
      label, stroke: "transparent", points: { show: false }, value: (_, v) => show(v, trace.unit),
      data: noise.map((v) => (v == null ? null : sign * 2 * v)),
    });
    const edges = [edge(1, "± 2 × noise"), edge(-1, "− 2 × noise")];
    const lower = keys(plot(parent, 150, trace.unit, [t, ...edges.map((e) => e.data), ...left],
      [...edges.map(({ data: _, ...e }) => e), ...models.map((c) => line(c, "measured − " + c.name))],
      [{ series: [1, 2], fill: "#d9dde2" }], trace.changes || [], true), [null, null, ...models.map((c) => c.key)]);
    lower.root.classList.add("residual");
  }

  function clear() {
    plots.forEach((u) => u.destroy());
    plots = [];
    box.replaceChildren();
  }

  /* Draws what is chosen; an x range given is kept. */
  function build(range) {
    clear();
    const run = data.runs[Number(runs.value)];
    const which = channels.value;
    const all = [...run.traces, ...run.inputs];
    const chosen = which === "all" ? run.traces.slice(0, AT_ONCE) : [all[Number(which)]];
    document.getElementById("chart-printed").textContent = run.name;
    chosen.forEach(draw);
    if (range) plots.forEach((u) => u.setScale("x", range));
  }

  function offer() {
    const run = data.runs[Number(runs.value)];
    const option = (value, text) => Object.assign(document.createElement("option"), { value, textContent: text });
    const n = run.traces.length;
    channels.replaceChildren(
      option("all", n > AT_ONCE ? "the " + AT_ONCE + " that are furthest off" : "all"),
      ...run.traces.map((t, i) => option(String(i), t.name)),
      ...run.inputs.map((t, i) => option(String(n + i), t.name + " (input)")),
    );
  }

  function range() {
    const x = plots.length ? plots[0].scales.x : null;
    return x && x.min != null ? { min: x.min, max: x.max } : null;
  }

  function toggle(key, on) {
    shown[key] = on;
    for (const u of plots) u.curves.forEach((k, i) => { if (k === key) u.setSeries(i, { show: on }); });
  }

  function reset() {
    for (const u of plots) u.setScale("x", { min: u.data[0][0], max: u.data[0][u.data[0].length - 1] });
  }

  function resize(width) {
    for (const u of plots) u.setSize({ width: width || Math.max(320, box.clientWidth), height: u.height });
  }

  runs.addEventListener("change", () => { offer(); build(null); });
  channels.addEventListener("change", () => build(range()));
  document.getElementById("chart-reset").addEventListener("click", reset);
  document.querySelectorAll("[data-curve]").forEach((c) => c.addEventListener("change", () => toggle(c.dataset.curve, c.checked)));
  let waiting = 0;
  window.addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(() => resize(0), 100); });
  window.addEventListener("beforeprint", () => resize(690)); // the width of an A4 page less its margins
  window.addEventListener("afterprint", () => resize(0));
  offer();
  build(null);
})();
