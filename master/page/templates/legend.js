/* Above a panel: a row a line, with its values at the pointer and at both cursors, and their difference. */
page.legend = function (panel) {
  const table = page.make("table", page.runs.some((r) => r.group > 1) ? "legend spans" : "legend", undefined, panel.element);
  const head = page.make("tr", "", undefined, page.make("thead", "", undefined, table));
  page.make("th", "unit", panel.title, head).scope = "col";
  for (const [name, text] of [["at", "at t"], ["a", "at A"], ["b", "at B"], ["d", "B − A"], ["x", ""]]) {
    page.make("th", name, text, head).scope = "col";
  }
  const body = page.make("tbody", "", undefined, table);
  panel.rows = panel.lines.map((line, i) => legendRow(panel, line, i, body));
  panel.table = table;
};

function legendRow(panel, line, i, body) {
  const row = page.make("tr", "", undefined, body);
  const name = page.make("th", "name", undefined, row);
  name.scope = "row";
  name.append(sample(line));
  page.make("span", "", line.label, name);
  name.title = line.label;
  const cells = Object.fromEntries(["at", "a", "b", "d"].map((key) => [key, page.make("td", key, "", row)]));
  const close = page.make("button", "close", "×", page.make("td", "x", undefined, row));
  close.type = "button";
  close.title = "take " + line.signal.name + " away";
  close.setAttribute("aria-label", close.title);
  close.addEventListener("click", () => page.choose(line.signal.name, false));
  row.addEventListener("mouseenter", () => panel.plot.setSeries(i + 1, { focus: true }));
  row.addEventListener("mouseleave", () => panel.plot.setSeries(null, { focus: true }));
  return cells;
}

/* A piece of the line, dashes and all. */
function sample(line) {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg"), stroke = document.createElementNS(space, "line");
  for (const [key, value] of Object.entries({ width: 30, height: 8, "aria-hidden": "true" })) svg.setAttribute(key, value);
  const drawn = { x1: 1, x2: 29, y1: 4, y2: 4, stroke: line.colour, "stroke-width": 2, "stroke-dasharray": line.dash.join(" ") };
  for (const [key, value] of Object.entries(drawn)) stroke.setAttribute(key, value);
  svg.append(stroke);
  return svg;
}

/* Fills in the values. */
page.show_values = function (panel) {
  const { at, A, B } = page.time;
  panel.table.classList.toggle("with-a", A !== null);
  panel.table.classList.toggle("with-b", B !== null);
  panel.table.classList.toggle("with-d", A !== null && B !== null);
  panel.lines.forEach(({ run, signal }, i) => {
    const cells = panel.rows[i];
    cells.at.textContent = page.reading(signal, run.read(signal, at));
    const a = run.read(signal, A), b = run.read(signal, B);
    cells.a.textContent = page.reading(signal, a);
    cells.b.textContent = page.reading(signal, b);
    const numbers = a !== null && b !== null && signal.kind !== "text";
    cells.d.textContent = numbers ? page.show(0.5 * (b[0] + b[1]) - 0.5 * (a[0] + a[1])) : "–";
  });
};
