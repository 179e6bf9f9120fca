/* The list of signals: by component, searched by name and unit, each on or off. */
page.list_signals = function () {
  const list = document.getElementById("list"), groups = new Map();
  for (const signal of page.signals) {
    if (!groups.has(signal.component)) groups.set(signal.component, []);
    groups.get(signal.component).push(signal);
  }
  page.entries = [];
  for (const [component, signals] of groups) {
    const box = page.make("details", "", undefined, list);
    box.open = page.signals.length <= 200 || signals.some((s) => page.chosen.has(s.name));
    const head = page.make("summary", "", component || (groups.size > 1 ? "the system" : "signals"), box);
    page.make("span", "number", String(signals.length), head);
    signals.forEach((signal) => page.entries.push(entry(signal, box)));
  }
  const search = document.getElementById("search");
  search.addEventListener("input", () => filter(search.value));
  document.getElementById("none").addEventListener("click", () => page.choose_all([]));
  filter("");
};

function entry(signal, box) {
  const label = page.make("label", signal.driven ? "driven" : "", undefined, box);
  const tick = page.make("input", "", undefined, label);
  tick.type = "checkbox";
  tick.checked = page.chosen.has(signal.name);
  tick.addEventListener("change", () => page.choose(signal.name, tick.checked));
  page.make("span", "name", signal.label, label);
  page.make("span", "unit", signal.kind === "float" || signal.kind === "integer" ? page.unit(signal) : signal.kind, label);
  label.title = signal.name + (signal.driven ? " (an input that is connected)" : "") + (signal.text ? "\n" + signal.text : "");
  const words = [signal.name, page.unit(signal), signal.kind, signal.text].join(" ").toLowerCase();
  return { signal, label, tick, box, words };
}

/* Shows what has all the words in it. */
function filter(text) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  const shown = new Set();
  for (const { label, words: own, box } of page.entries) {
    const fits = words.every((word) => own.includes(word));
    label.hidden = !fits;
    count += fits;
    if (fits) shown.add(box);
  }
  for (const box of new Set(page.entries.map((e) => e.box))) {
    box.hidden = !shown.has(box);
    if (words.length && shown.has(box)) box.open = true;
  }
  document.getElementById("count").textContent = words.length ? count + " of " + page.entries.length + " signals" : page.entries.length + " signals";
}

page.choose = function (name, on) {
  if (on) page.chosen.add(name);
  else page.chosen.delete(name);
  page.choose_all([...page.chosen]);
};

/* Shows these signals and no others. */
page.choose_all = function (names) {
  page.chosen = new Set(names);
  for (const { signal, tick } of page.entries) tick.checked = page.chosen.has(signal.name);
  page.build();
};
