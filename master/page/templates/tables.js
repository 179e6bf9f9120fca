/* What stands beside the plots: what the run answers, how far to trust it, power bonds, parameters, differences. */
page.write_head = function () {
  const { title, about, sentences, trust, warnings, error } = page.content;
  document.querySelector("h1").textContent = title;
  document.getElementById("about").textContent = about.join("  ·  ");
  const told = document.getElementById("told");
  sentences.forEach((text) => page.make("p", "", text, told));
  if (error) page.make("p", "error", "The run had to stop: " + error, told);
  hideOr(document.getElementById("trust"), trust);
  const list = document.getElementById("warnings");
  warnings.forEach((text) => page.make("li", "", text, list));
  list.hidden = !warnings.length;
  if (warnings.length) document.getElementById("trust").classList.add("warned");
  const told_of = page.runs.filter((r) => r.group > 1).map((r) => (page.compares ? r.name + ": of " : "Of ") + r.rows.toLocaleString("en") +
    " rows this page holds the least and the greatest value of every " + r.group + ", and no more.");
  hideOr(document.getElementById("reduced"), told_of.join(" "));
};

function hideOr(element, text) {
  element.textContent = text;
  element.hidden = !text;
}

/* A table of texts; those columns whose name ends in # are numbers. */
function table(parent, names, rows) {
  const made = page.make("table", "data", undefined, parent);
  const head = page.make("tr", "", undefined, page.make("thead", "", undefined, made));
  names.forEach((name) => { page.make("th", name.endsWith("#") ? "number" : "", name.replace("#", ""), head).scope = "col"; });
  const body = page.make("tbody", "", undefined, made);
  for (const row of rows) {
    const line = page.make("tr", row.name || "", undefined, body);
    row.cells.forEach((text, k) => {
      const cell = page.make("td", names[k].endsWith("#") ? "number" : "", text ?? "–", line);
      if (row.titles && row.titles[k]) cell.title = row.titles[k];
    });
    if (row.click) {
      line.addEventListener("click", row.click);
      line.classList.add("clicks");
    }
  }
  return made;
}

page.write_bonds = function () {
  const section = document.getElementById("bonds"), bonds = page.content.bonds;
  section.hidden = !bonds.length;
  if (!bonds.length) return;
  const names = ["power bond", "error [J]#", "exchanged [J]#", "share#", "omega h#", "numerical damping#"];
  const share = (v) => (v == null ? "–" : page.show(100 * v, 3) + " %");
  table(section.querySelector(".scroll"), names, bonds.map((b) => ({
    cells: [b.name, page.show(b.residual, 4), page.show(b.exchanged, 4), share(b.relative), page.show(b.omega_h, 3), page.show(b.damping, 3)],
    name: b.relative > 0.1 ? "off" : "",
  })));
};

const MOST_ROWS = 400;

page.write_parameters = function () {
  const section = document.getElementById("parameters"), all = page.content.parameters;
  section.hidden = !all.length;
  if (!all.length) return;
  if (page.compares) section.querySelector("h2").textContent = "Parameters that differ";
  const search = section.querySelector("input");
  const fill = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const text = (p) => [p.name, p.unit, p.from, p.where, p.text].join(" ").toLowerCase();
    const fits = all.filter((p) => words.every((word) => text(p).includes(word)));
    const box = section.querySelector(".scroll");
    box.replaceChildren();
    (page.compares ? differing : inForce)(box, fits.slice(0, MOST_ROWS));
    const more = fits.length > MOST_ROWS ? "; the first " + MOST_ROWS + " are shown" : "";
    const changed = all.filter((p) => p.changed).length;
    section.querySelector(".remark").textContent = (words.length ? fits.length + " of " : "") + all.length + " parameters" +
      (changed ? ", " + changed + " changed for this run" : "") + more;
  };
  search.addEventListener("input", fill);
  fill();
};

function inForce(box, fits) {
  table(box, ["parameter", "value#", "unit", "what it is", "from"], fits.map((p) => ({
    cells: [p.name, p.value, p.unit, p.text, p.changed ? p.from + " (changed)" : p.from], titles: ["", p.own, "", "", p.where],
    name: p.changed ? "changed" : "",
  })));
}

function differing(box, fits) {
  table(box, ["parameter", ...page.runs.map((r) => r.name + "#")], fits.map((p) => ({
    cells: [p.name, ...p.values],
  })));
}

/* Signals by how far the runs are apart; a click shows one. */
page.write_comparison = function () {
  const section = document.getElementById("comparison"), told = page.content.comparison;
  section.hidden = !told;
  if (!told) return;
  section.querySelector(".remark").textContent = told.remarks.join(" ") + " Click a row to plot its signal.";
  const names = ["signal", "run", "apart at most#", "at t [s]#", "share of its range#", "apart first at t [s]#"];
  const rows = told.rows.map((r) => {
    const signal = page.byName.get(r.name);
    const unit = page.unit(signal);
    const most = r.difference === null ? "–" : page.show(signal.factor * r.difference, 4) + (unit ? " " + unit : "");
    return {
      cells: [r.name, r.run, most, page.show(r.at), r.relative === null ? "–" : page.show(100 * r.relative, 3) + " %", page.show(r.first)],
      name: r.differs ? "off" : "", click: () => page.choose(r.name, !page.chosen.has(r.name)),
    };
  });
  table(section.querySelector(".scroll"), names, rows.slice(0, MOST_ROWS));
};
