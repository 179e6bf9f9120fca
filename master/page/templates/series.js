/* The record of a run: its points, and coarser ones of which each four have become two (least and greatest). */
page.Run = class {
  constructor(content) {
    this.name = content.name;
    this.rows = content.rows;
    this.group = content.group;
    this.content = content;
    this.times = [page.decode(content.t, Float64Array)];
    this.columns = new Map(); // name: levels, made when they are asked for
  }

  get start() { return this.times[0][0]; }
  get end() { return this.times[0][this.times[0].length - 1]; }

  /* Times of a level. */
  at(level) {
    while (this.times.length <= level) {
      const fine = this.times[this.times.length - 1], n = fine.length;
      const made = new Float64Array(2 * Math.ceil(n / 4));
      for (let i = 0, k = 0; i < n; i += 4, k += 2) {
        made[k] = fine[i];
        made[k + 1] = fine[Math.min(i + 3, n - 1)];
      }
      this.times.push(made);
    }
    return this.times[level];
  }

  /* Values of a signal at a level, in the unit that is shown; null where this run has no such signal. */
  values(signal, level) {
    let levels = this.columns.get(signal.name);
    if (levels === undefined) {
      const place = signal.places[page.runs.indexOf(this)];
      levels = place == null ? null : [this.decoded(this.content.columns[place], signal)];
      this.columns.set(signal.name, levels);
    }
    if (levels === null) return null;
    while (levels.length <= level) levels.push(coarser(levels[levels.length - 1]));
    return levels[level];
  }

  decoded(column, signal) {
    const { factor, offset } = signal;
    if (column.value !== undefined) return new Float64Array(this.times[0].length).fill(factor * column.value + offset);
    return Float64Array.from(page.decode(column.points, Float32Array), (v) => factor * (v + column.middle) + offset);
  }

  /* Place of the point next to t; a switch or text holds until its next point. */
  near(t, held) {
    const times = this.times[0], k = page.after(times, t);
    if (t < times[0] || t > times[times.length - 1]) return -1;
    if (k === 0 || times[k] === t) return k;
    return held || t - times[k - 1] < times[k] - t ? k - 1 : k;
  }

  /* [least, greatest] of a signal about t, null outside of the run. */
  read(signal, t) {
    const values = this.values(signal, 0);
    const k = values === null || t === null ? -1 : this.near(t, signal.kind !== "float");
    if (k < 0) return null;
    if (this.group === 1 || k === values.length - 1) return [values[k], values[k]];
    const first = k - (k % 2), a = values[first], b = values[first + 1];
    return a > b ? [b, a] : [a, b];
  }
};

function coarser(fine) {
  const n = fine.length, made = new Float64Array(2 * Math.ceil(n / 4));
  for (let i = 0, k = 0; i < n; i += 4, k += 2) {
    let low = NaN, high = NaN, first = 0, last = 0;
    for (let j = i; j < Math.min(i + 4, n); j++) {
      if (!(fine[j] >= low)) if (!Number.isNaN(fine[j])) { low = fine[j]; first = j; }
      if (!(fine[j] <= high)) if (!Number.isNaN(fine[j])) { high = fine[j]; last = j; }
    }
    made[k] = first <= last ? low : high;
    made[k + 1] = first <= last ? high : low;
  }
  return made;
}

/* Times and values of some signals of a run between two times, at most about `most` points. */
function piece(run, signals, low, high, most) {
  const all = run.at(0);
  const count = page.after(all, high) - page.after(all, low);
  const level = Math.max(0, Math.ceil(Math.log2(count / most)));
  const times = run.at(level);
  const first = Math.max(0, page.after(times, low) - 2), end = Math.min(times.length, page.after(times, high) + 2);
  const drawn = (values) => Array.from(values.subarray(first, end), (v) => (Number.isFinite(v) ? v : null));
  return [Array.from(times.subarray(first, end)), ...signals.map((s) => drawn(run.values(s, level)))];
}

/* What uPlot takes, of lines {run, signal}: the times of all of them, and a row for each. */
page.view = function (lines, low, high, most) {
  const runs = [...new Set(lines.map((line) => line.run))];
  const pieces = runs.map((run) => piece(run, lines.filter((line) => line.run === run).map((line) => line.signal), low, high, most));
  const joined = pieces.length > 1 ? uPlot.join(pieces) : pieces[0] || [[]];
  const order = runs.flatMap((run) => lines.filter((line) => line.run === run));
  return [joined[0], ...lines.map((line) => joined[1 + order.indexOf(line)])];
};
