/* The system: a box a component with its connected inputs and outputs, lines between them, and the values at a time. */
const MOST_BOXES = 40, MOST_WIRES = 400, ROW = 20, HEAD = 26, LANE = 9, GAP = 26, MARGIN = 14;

page.write_diagram = function () {
  const section = document.getElementById("system"), { components, connections } = page.content;
  section.hidden = !connections.length;
  page.ports = [];
  if (!connections.length) return;
  page.known = new Set(components);
  const boxes = makeBoxes(components, connections);
  const seen = (port) => port.box.order < MOST_BOXES;
  const wires = wiresOf(boxes, connections).filter((w) => seen(w.from) && seen(w.to)).slice(0, MOST_WIRES);
  const used = [...boxes.values()].slice(0, MOST_BOXES);
  const size = layOut(used, wires);
  document.getElementById("diagram").append(drawing(used, wires, size));
  document.getElementById("diagram-more").textContent = wires.length === connections.length ? "" :
    "Shown are " + wires.length + " of " + connections.length + " connections, between " + used.length + " of " + boxes.size + " components.";
  const slider = document.getElementById("slider");
  slider.addEventListener("input", () => page.set_time("at", page.whole[0] + (slider.value / 1000) * (page.whole[1] - page.whole[0])));
};

const INPUTS = "inputs of the system", OUTPUTS = "outputs of the system";

/* [box, name in it] of an end of a connection; components may have dots in their names. */
function split(end, isStart) {
  let dot = end.lastIndexOf(".");
  while (dot > 0 && !page.known.has(end.slice(0, dot))) dot = end.lastIndexOf(".", dot - 1);
  return dot > 0 ? [end.slice(0, dot), end.slice(dot + 1)] : [isStart ? INPUTS : OUTPUTS, end];
}

function makeBoxes(components, connections) {
  const boxes = new Map(), ends = connections.map(([a, b]) => [split(a, true), split(b, false)]);
  const linked = new Set(ends.flatMap(([a, b]) => [a[0], b[0]]));
  for (const name of [INPUTS, ...components, OUTPUTS]) {
    if (linked.has(name)) boxes.set(name, { name, order: boxes.size, inputs: new Map(), outputs: new Map(), layer: 0 });
  }
  return boxes;
}

function wiresOf(boxes, connections) {
  const port = (side, box, label, name) => {
    if (!box[side].has(name)) box[side].set(name, { box, label, name, row: box[side].size });
    return box[side].get(name);
  };
  const wires = connections.map(([a, b]) => {
    const [from, start] = split(a, true), [to, end] = split(b, false);
    return { from: port("outputs", boxes.get(from), start, a), to: port("inputs", boxes.get(to), end, b) };
  });
  const forth = wires.filter(({ from, to }) => from.box.order < to.box.order); // the others come back
  for (const { from, to } of forth.sort((a, b) => a.to.box.order - b.to.box.order)) {
    to.box.layer = Math.max(to.box.layer, from.box.layer + 1); // a layer after the last that drives it
  }
  return wires;
}

const ruler = document.createElement("canvas").getContext("2d");

function widthOf(text, weight = "") {
  ruler.font = weight + " 13px system-ui, sans-serif";
  return ruler.measureText(text).width;
}

/* Places boxes and the lanes of the wires; gives width and height of all. */
function layOut(boxes, wires) {
  const layers = [];
  for (const box of boxes) {
    const widest = (ports) => Math.max(0, ...[...ports.values()].map((p) => widthOf(p.label)));
    box.value = Math.max(0, ...[...box.outputs.values()].map(roomOf));
    box.width = Math.max(widthOf(box.name, "bold") + 40, widest(box.inputs) + widest(box.outputs) + box.value + 56);
    box.height = HEAD + ROW * Math.max(1, box.inputs.size, box.outputs.size) + 8;
    (layers[box.layer] ??= []).push(box);
  }
  const filled = layers.filter(Boolean);
  filled.forEach((layer, i) => layer.forEach((box) => { box.layer = i; }));
  const before = filled.map(() => 0), behind = filled.map(() => 0); // lanes in the gap left and right of a layer
  let below = 0;
  for (const wire of wires) {
    wire.lane = behind[wire.from.box.layer]++;
    wire.direct = wire.to.box.layer === wire.from.box.layer + 1;
    if (!wire.direct) { wire.back = before[wire.to.box.layer]++; wire.below = below++; }
  }
  let x = MARGIN, bottom = 0;
  filled.forEach((layer, i) => {
    x += before[i] ? 16 + LANE * before[i] : 0;
    let y = MARGIN + (boxes.length > 2 && i % 2 ? ROW / 2 : 0); // so that no two wires lie on each other between layers
    const width = Math.max(...layer.map((b) => b.width));
    for (const box of layer) {
      Object.assign(box, { x, y, width });
      y += box.height + GAP;
    }
    bottom = Math.max(bottom, y - GAP);
    x += width + (behind[i] ? 26 + LANE * behind[i] : 0);
  });
  return { width: x + MARGIN, bottom, height: bottom + 12 + LANE * below + MARGIN };
}

function svg(tag, attributes, parent, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

function drawing(boxes, wires, size) {
  const root = svg("svg", { width: size.width, height: size.height, viewBox: `0 0 ${size.width} ${size.height}`, role: "img", "aria-label": "Components and their connections" });
  const arrow = svg("marker", { id: "arrow", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto" }, svg("defs", {}, root));
  svg("path", { d: "M0 0 L8 4 L0 8 Z", fill: "#64748b" }, arrow);
  for (const wire of wires) {
    const path = svg("path", { d: route(wire, size.bottom), class: "wire", "marker-end": "url(#arrow)" }, root);
    svg("title", {}, path, wire.from.name + " → " + wire.to.name);
  }
  boxes.forEach((box) => drawBox(box, root));
  return root;
}

/* For the value of an output, and its unit. */
function roomOf(port) {
  const signal = recorded(port);
  return signal === undefined ? 0 : 12 + widthOf(signal.kind === "float" ? "−8.88e−88 " + page.unit(signal) : "fourteen chars", "bold");
}

/* The signal of a port, of an array that of its first value. */
const recorded = (port) => page.byName.get(port.name) || page.byName.get(port.name + "[1]");

const rowOf = (port) => port.box.y + HEAD + ROW * (port.row + 0.5);

/* Along the gap behind the source; to a box that is not the next one below all boxes and up in front of it. */
function route({ from, to, lane, direct, back, below }, bottom) {
  const x0 = from.box.x + from.box.width, y0 = rowOf(from), x1 = to.box.x, y1 = rowOf(to);
  const turn = x0 + 14 + LANE * lane;
  if (direct) return y0 === y1 ? `M${x0} ${y0} H${x1}` : `M${x0} ${y0} H${turn} V${y1} H${x1}`;
  return `M${x0} ${y0} H${turn} V${bottom + 12 + LANE * below} H${x1 - 14 - LANE * back} V${y1} H${x1}`;
}

function drawBox(box, root) {
  const system = box.name === INPUTS || box.name === OUTPUTS;
  svg("rect", { x: box.x, y: box.y, width: box.width, height: box.height, rx: 5, class: system ? "box system" : "box" }, root);
  svg("text", { x: box.x + box.width / 2, y: box.y + 18, class: "box-name", "text-anchor": "middle" }, root, box.name);
  for (const port of box.inputs.values()) drawPort(port, box.x + 9, "start", root);
  for (const port of box.outputs.values()) drawPort(port, box.x + box.width - 9, "end", root);
}

/* A name; of an output the value too. A click shows the signal. */
function drawPort(port, x, anchor, root) {
  const y = rowOf(port) + 4.5, signal = recorded(port);
  const isOutput = anchor === "end";
  const text = svg("text", { x: isOutput ? x - port.box.value : x, y, class: signal ? "port clicks" : "port", "text-anchor": anchor }, root, port.label);
  svg("title", {}, text, port.name + (signal ? " (click: plot it)" : " (not recorded)"));
  if (signal) text.addEventListener("click", () => page.choose(signal.name, !page.chosen.has(signal.name)));
  if (!isOutput || !signal) return;
  page.ports.push({ signal, text: svg("text", { x, y, class: "value", "text-anchor": "end" }, root) });
}

/* The values at the time of the pointer. */
page.show_diagram = function () {
  const t = page.time.at;
  document.getElementById("t-system").textContent = page.show(t) + " s";
  document.getElementById("slider").value = String(Math.round((1000 * (t - page.whole[0])) / (page.whole[1] - page.whole[0])));
  for (const { signal, text } of page.ports) {
    const span = page.runs[0].read(signal, t), unit = page.unit(signal);
    const value = span === null ? "–" : signal.kind === "float" ? page.show(span[0], 4) : page.reading(signal, [span[0], span[0]]);
    text.textContent = value.length > 14 ? value.slice(0, 13) + "…" : value + (unit ? " " + unit : "");
  }
};
