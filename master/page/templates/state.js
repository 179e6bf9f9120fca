/* What the page shows: the runs, the signals, which of them are chosen, the times in view and at the cursors. */
page.content = JSON.parse(document.getElementById("content").textContent);
page.runs = page.content.runs.map((run) => new page.Run(run));
page.signals = page.content.signals;
page.byName = new Map(page.signals.map((s) => [s.name, s]));
page.compares = page.runs.length > 1;
page.whole = [Math.min(...page.runs.map((r) => r.start)), Math.max(...page.runs.map((r) => r.end))];
if (page.whole[0] === page.whole[1]) page.whole = [page.whole[0] - 0.5, page.whole[1] + 0.5]; // one row
page.range = [...page.whole];
page.chosen = new Set(page.content.chosen);
page.panels = [];
page.time = { at: page.runs[0].start, A: null, B: null };

/* Colours that people of all kinds of sight tell apart, on white; and dashes, for who sees none. */
page.COLOURS = ["#0b5fa5", "#c2410c", "#15803d", "#7e3794", "#a16207", "#be185d", "#0e7490", "#475569"];
page.DASHES = [[], [9, 4], [2, 3], [12, 3, 2, 3], [5, 2], [16, 5], [2, 6], [8, 2, 2, 2, 2, 2]];

/* Words for a unit. */
page.unit = (signal) => (signal.shown === "" || signal.shown === "1" ? "" : signal.shown);

/* A value of a signal as a person reads it; a span where rows are grouped. */
page.reading = function (signal, span) {
  if (span === null) return "–";
  const items = page.items(signal);
  const word = (v, digits) => (signal.kind === "text" ? items[v] ?? "…" : signal.kind === "boolean" ? (v ? "true" : "false") : page.show(v, digits));
  const [low, high] = span;
  return word(low, 6) === word(high, 6) ? word(low, 6) : word(low, 4) + " … " + word(high, 4);
};

/* The texts of a signal; runs that are compared share them. */
page.items = (signal) => page.content.runs.map((r) => r.items[signal.name] || []).sort((a, b) => b.length - a.length)[0];

/* Panels of what is chosen: a unit each, or a signal where runs are compared. */
page.groups = function () {
  const groups = new Map();
  for (const name of page.chosen) {
    const signal = page.byName.get(name);
    const alone = page.compares || signal.kind === "text";
    const key = alone ? "name " + signal.name : signal.kind === "boolean" ? "true or false" : "unit " + page.unit(signal);
    if (!groups.has(key)) groups.set(key, { title: panelTitle(signal, alone), lines: [] });
    const lines = groups.get(key).lines;
    for (const run of page.runs) {
      if (signal.places[page.runs.indexOf(run)] == null) continue;
      const k = page.compares ? page.runs.indexOf(run) : lines.length;
      lines.push({ run, signal, label: page.compares ? run.name : signal.name, colour: page.COLOURS[k % 8], dash: page.DASHES[k % 8] });
    }
  }
  return [...groups.values()];
};

function panelTitle(signal, alone) {
  const unit = page.unit(signal);
  if (alone) return signal.name + (unit ? " [" + unit + "]" : "");
  if (signal.kind === "boolean") return "true or false";
  return unit ? "[" + unit + "]" : "without unit";
}

/* Shows the times from low to high, in all panels, as soon as the browser draws. */
page.show_range = function (low, high) {
  const [first, last] = page.whole;
  const least = (last - first) * 1e-7;
  let width = Math.min(Math.max(high - low, least), last - first);
  low = Math.min(Math.max(low, first), last - width);
  page.range = [low, low + width];
  soon("range", () => page.panels.forEach(page.draw));
};

/* Widens or narrows the view by a factor about a time. */
page.zoom = function (factor, about) {
  const [low, high] = page.range;
  const middle = about ?? 0.5 * (low + high);
  page.show_range(middle - (middle - low) * factor, middle + (high - middle) * factor);
};

page.pan = function (share) {
  const by = share * (page.range[1] - page.range[0]);
  page.show_range(page.range[0] + by, page.range[1] + by);
};

/* The whole run, and every panel's own height. */
page.reset = function () {
  page.panels.forEach((panel) => { panel.heights = null; });
  page.show_range(...page.whole);
};

/* Sets the pointer's time or that of a cursor. */
page.set_time = function (which, t) {
  page.time[which] = t;
  soon("time", page.show_times);
};

const waiting = new Map();

/* Once before the browser draws next, however often it is asked for. */
function soon(name, work) {
  if (!waiting.size) requestAnimationFrame(() => {
    const all = [...waiting.values()];
    waiting.clear();
    all.forEach((f) => f());
  });
  waiting.set(name, work);
}
