/* The pointer: it reads, drags a range, pans with shift, and sets the two cursors. */
page.listen = function (panel) {
  const over = panel.plot.over;
  for (const which of ["A", "B"]) panel.marks[which] = page.make("div", "cursor " + which.toLowerCase(), undefined, over);
  let down = null;
  over.addEventListener("mousedown", (e) => {
    down = e.button === 0 ? { x: e.clientX, y: e.clientY, range: [...page.range], pans: e.shiftKey } : null;
    if (down && down.pans) follow(down, over);
  });
  over.addEventListener("mouseup", (e) => { // uPlot lets no click through after a drag
    if (!down || e.button !== 0 || Math.hypot(e.clientX - down.x, e.clientY - down.y) > 3) return;
    const t = panel.plot.posToVal(e.clientX - over.getBoundingClientRect().left, "x");
    page.set_time(e.shiftKey ? "B" : "A", Math.min(Math.max(t, page.whole[0]), page.whole[1]));
  });
  over.addEventListener("wheel", (e) => {
    if (!e.ctrlKey) return;
    e.preventDefault();
    page.zoom(Math.exp(0.002 * e.deltaY), panel.plot.posToVal(e.clientX - over.getBoundingClientRect().left, "x"));
  }, { passive: false });
};

/* Drags the view along until the button is let go. */
function follow(down, over) {
  const move = (e) => {
    const by = ((down.x - e.clientX) / over.clientWidth) * (down.range[1] - down.range[0]);
    page.show_range(down.range[0] + by, down.range[1] + by);
  };
  document.addEventListener("mousemove", move);
  document.addEventListener("mouseup", () => document.removeEventListener("mousemove", move), { once: true });
}

/* The pointer is over a panel: the others follow by uPlot's own means. */
page.pointed = function (panel, u) {
  if (u.cursor.left >= 0 && u.over.matches(":hover")) page.set_time("at", u.posToVal(u.cursor.left, "x"));
};

/* Puts the lines of both cursors where their times are. */
page.place_marks = function (panel) {
  for (const [which, mark] of Object.entries(panel.marks)) {
    const t = page.time[which];
    const seen = t !== null && t >= page.range[0] && t <= page.range[1];
    mark.hidden = !seen;
    if (seen) mark.style.left = panel.plot.valToPos(t, "x") + "px";
    mark.dataset.name = which;
  }
};

/* Everything that depends on the times of pointer and cursors. */
page.show_times = function () {
  const { at, A, B } = page.time;
  const field = (id) => document.getElementById(id);
  field("t").textContent = page.show(at) + " s";
  for (const [id, t] of [["a", A], ["b", B]]) {
    if (document.activeElement !== field(id)) field(id).value = t === null ? "" : String(Number(t.toPrecision(7)));
  }
  const dt = A !== null && B !== null ? B - A : null;
  field("dt").textContent = dt === null ? "" : "B − A  " + page.show(dt) + " s" + (dt ? "  (" + page.show(1 / Math.abs(dt), 4) + " Hz)" : "");
  field("bar").classList.toggle("measuring", dt !== null); // the hint makes room
  field("clear").hidden = A === null && B === null;
  for (const panel of page.panels) {
    page.place_marks(panel);
    page.show_values(panel);
  }
  page.show_diagram();
};

/* Buttons, keys, and the fields of the two cursors. */
page.listen_to_bar = function () {
  const on = (id, work) => document.getElementById(id).addEventListener("click", work);
  on("whole", page.reset);
  on("closer", () => page.zoom(0.5));
  on("wider", () => page.zoom(2));
  on("left", () => page.pan(-0.25));
  on("right", () => page.pan(0.25));
  on("clear", () => { page.set_time("A", null); page.set_time("B", null); });
  for (const which of ["A", "B"]) {
    document.getElementById(which.toLowerCase()).addEventListener("change", (e) => {
      const text = e.target.value.trim().replace("−", "-").replace(",", "."), t = Number(text);
      e.target.blur();
      page.set_time(which, text === "" || !Number.isFinite(t) ? null : Math.min(Math.max(t, page.whole[0]), page.whole[1]));
    });
  }
  const keys = { "+": () => page.zoom(0.5), "-": () => page.zoom(2), 0: page.reset, ArrowLeft: () => page.pan(-0.25), ArrowRight: () => page.pan(0.25) };
  document.addEventListener("keydown", (e) => {
    if (e.target.closest("input, select, textarea") || e.ctrlKey || e.metaKey || e.altKey || !keys[e.key]) return;
    keys[e.key]();
    e.preventDefault();
  });
};
