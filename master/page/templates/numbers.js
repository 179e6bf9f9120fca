/* Numbers: out of base64, and as a person reads them. */
page.decode = function (text, Kind) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Kind(bytes.buffer);
};

/* Six significant digits, without an exponent where that is readable. */
page.show = function (v, digits = 6) {
  if (v === undefined || v === null) return "–";
  if (Number.isNaN(v)) return "not a number";
  if (!Number.isFinite(v)) return v > 0 ? "∞" : "−∞";
  const size = Math.abs(v);
  const text = size !== 0 && (size < 1e-4 || size >= 1e7) ? v.toExponential(digits - 2) : String(Number(v.toPrecision(digits)));
  return text.replaceAll("-", "−");
};

/* Ticks of an axis that lie `step` apart. */
page.ticks = function (values, step) {
  const largest = Math.max(...values.map((v) => Math.abs(v ?? 0)));
  if (largest >= 1e6 || (largest > 0 && largest < 1e-3)) {
    const digits = Math.max(0, Math.min(6, Math.ceil(Math.log10(largest / step))));
    return values.map((v) => (v == null ? "" : v === 0 ? "0" : v.toExponential(digits).replaceAll("-", "−")));
  }
  const decimals = Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return values.map((v) => (v == null ? "" : v.toFixed(Number.isInteger(step) ? 0 : decimals).replace("-", "−")));
};

/* An element with a text, which is never read as HTML. */
page.make = function (tag, name, text, parent) {
  const made = document.createElement(tag);
  if (name) made.className = name;
  if (text !== undefined) made.textContent = text;
  if (parent) parent.append(made);
  return made;
};

/* First place whose time is at or after t. */
page.after = function (times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < t) low = middle + 1;
    else high = middle;
  }
  return low;
};
