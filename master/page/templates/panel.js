/* A panel: the lines of one unit, drawn by uPlot from as many points as the screen has room for. */
const HEIGHT = 190, POINTS_PER_PIXEL = 2.5, DOTS = 80, NOISY = 150, FONT = "12px system-ui, sans-serif";

page.build = function () {
  page.panels.forEach((panel) => panel.plot.destroy());
  const box = document.getElementById("panels");
  box.replaceChildren();
  page.panels = page.groups().map((group) => makePanel(group, box));
  if (!page.panels.length) page.make("p", "empty", "Choose signals on the left.", box);
  page.panels.forEach(page.draw);
  page.show_times();
};

function makePanel(group, box) {
  const element = page.make("figure", "panel", undefined, box);
  const panel = { ...group, element, heights: null, marks: {} };
  page.legend(panel);
  const place = page.make("div", "plot", undefined, element);
  const signal = group.lines[0].signal;
  const stepped = uPlot.paths.stepped({ align: 1 });
  panel.plot = new uPlot({
    width: Math.max(280, place.clientWidth), height: HEIGHT,
    scales: { x: { time: false, range: () => page.range }, y: { range: (u, low, high) => panel.heights || heights(low, high, signal) } },
    axes: [
      { font: FONT, size: 28, stroke: "#4b5563", grid: { stroke: "#eceff2" }, ticks: { stroke: "#cbd2d9", size: 5 }, values: (u, v, _a, _s, step) => page.ticks(v, step) },
      { font: FONT, size: 76, stroke: "#4b5563", grid: { stroke: "#eceff2" }, ticks: { stroke: "#cbd2d9", size: 5 }, space: 26, ...axisOf(signal) },
    ],
    series: [{}, ...group.lines.map((line) => ({
      stroke: line.colour, width: 1.6, pxAlign: 0, dash: line.dash,
      points: { show: (u, i, first, last) => last - first < DOTS, size: 5 }, // rows show where there is room
      paths: line.signal.kind === "float" ? undefined : stepped,
    }))],
    cursor: cursorOf(panel),
    focus: { alpha: 0.2 },
    legend: { show: false },
    padding: [8, 26, 0, 0],
    hooks: { setSelect: [(u) => selected(panel, u)], setCursor: [(u) => page.pointed(panel, u)], draw: [() => page.place_marks(panel)] },
  }, [[], ...group.lines.map(() => [])], place);
  page.listen(panel);
  return panel;
}

function cursorOf() {
  const plain = (u, target, handler) => (e) => { if (e.button === 0 && !e.shiftKey) handler(e); };
  return {
    sync: { key: "time", scales: ["x", null], setSeries: false },
    drag: { x: true, y: true, uni: 30, setScale: false },
    bind: { mousedown: plain, dblclick: () => () => page.reset() },
    points: { size: 6 }, y: false,
  };
}

/* Heights of a panel: a little more than its lines, and no less than rounding makes of a constant. */
function heights(low, high, signal) {
  if (signal.kind === "boolean") return [-0.15, 1.15];
  if (low === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const size = Math.max(Math.abs(low), Math.abs(high));
  const least = size === 0 ? 1 : high === low ? 0.1 * size : 1e-8 * size;
  const span = Math.max(high - low, least), middle = 0.5 * low + 0.5 * high;
  return [middle - 0.57 * span, middle + 0.57 * span];
}

/* Ticks on the left: numbers, or words. */
function axisOf(signal) {
  if (signal.kind !== "text" && signal.kind !== "boolean") return { values: (u, v, _a, _s, step) => page.ticks(v, step) };
  const words = signal.kind === "boolean" ? ["false", "true"] : page.items(signal);
  const each = Math.max(1, Math.ceil(words.length / 7));
  const short = (word) => (word === undefined ? "" : word.length > 10 ? word.slice(0, 9) + "…" : word);
  return { splits: () => words.map((_, i) => i).filter((i) => i % each === 0), values: (u, v) => v.map((i) => short(words[i])) };
}

/* Draws the times in view. */
page.draw = function (panel) {
  const [low, high] = page.range;
  const most = POINTS_PER_PIXEL * Math.max(200, panel.plot.width - 90); // the axis takes 90; uPlot lays out later
  const data = page.view(panel.lines, low, high, most);
  const noisy = travel(data) > NOISY;
  panel.lines.forEach((line, i) => { // as thin as can be is drawn ten times as fast, and no dash can be seen there
    Object.assign(panel.plot.series[i + 1], noisy ? { width: 1 / devicePixelRatio, dash: [] } : { width: 1.6, dash: line.dash });
  });
  panel.plot.setData(data);
};

/* How often the lines of a panel go up and down through all of its height, together. */
function travel([, ...lines]) {
  let low = Infinity, high = -Infinity, way = 0;
  for (const values of lines) {
    let before = null;
    for (const v of values) {
      if (v == null) continue;
      if (v < low) low = v;
      if (v > high) high = v;
      if (before !== null) way += Math.abs(v - before);
      before = v;
    }
  }
  return high > low ? way / (high - low) : 0;
}

/* What has been dragged over: a range of time, of height, or both. */
function selected(panel, u) {
  const { left, top, width, height } = u.select;
  if (width <= 0 || height <= 0) return;
  if (height < u.over.clientHeight - 1) panel.heights = [u.posToVal(top + height, "y"), u.posToVal(top, "y")];
  const low = u.posToVal(left, "x"), high = u.posToVal(left + width, "x");
  u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  if (width < u.over.clientWidth - 1) page.show_range(low, high);
  else page.draw(panel);
}

/* As wide as the window has become. */
page.fit = function () {
  for (const panel of page.panels) {
    const width = Math.max(280, panel.element.querySelector(".plot").clientWidth);
    if (width !== panel.plot.width) panel.plot.setSize({ width, height: HEIGHT });
    page.draw(panel);
  }
};
