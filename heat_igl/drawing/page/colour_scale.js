// The scale of colours of a panel, and the bar that shows it.

// Lowest and highest of values, for which 0 is among them, and the row of colours: 0.25 for one sign, 0.75 for both.
function limits(n, valueAt) {
  let low = 0, high = 0;
  for (let v = 0; v < n; v++) {
    const x = valueAt(v);
    if (isFinite(x)) { low = Math.min(low, x); high = Math.max(high, x); }
  }
  // White is 0 where there are values of both signs.
  const isSigned = low < 0 && high > 0;
  if (isSigned) [low, high] = [Math.min(low, -high), Math.max(high, -low)];
  return [low, high, isSigned ? 0.75 : 0.25];
}

// A round number near a sixteenth.
function roundSpacing(largest) {
  const power = 10 ** Math.floor(Math.log10(largest / 16));
  const steps = [1, 2, 5, 10, 20, 50].map((digit) => digit * power);
  const off = (step) => Math.abs(Math.log(largest / 16 / step));
  return steps.reduce((best, step) => (off(step) < off(best) ? step : best));
}

// Draw the bar of a panel, with lines or stripes as on the surface.
function drawBar(canvas, { low, high, spacing, row, isMap }, style, meta) {
  const rows = Math.max(canvas.clientHeight, 1), pen = canvas.getContext("2d");
  canvas.width = 1;
  canvas.height = rows;
  const across = high - low, colours = row > 0.5 ? meta.signedColours : meta.colours;
  for (let y = 0; y < rows; y++) {
    const share = 1 - (y + 0.5) / rows, level = (low + share * across) / spacing;
    const last = colours.length - 1, rgb = colours[Math.round(share * last)];
    const isLine = style === "0" && !isMap && Math.abs(level - Math.round(level)) <= 0.5 * across / rows / spacing;
    const isLight = style === "1" && !isMap && Math.floor(level) % 2 !== 0;
    const isInked = isLine && (low < 0 || Math.round(level) !== 0);
    const ink = rgb.map((c) => (isInked ? c * (1 - meta.lineInk) : isLight ? c + meta.stripeInk * (255 - c) : c));
    pen.fillStyle = "rgb(" + ink.join(",") + ")";
    pen.fillRect(0, y, 1, 1);
  }
}

// Numbers beside the bar, at most eight of them or so, at multiples of the spacing.
function ticks({ low, high, spacing }, written) {
  const across = high - low;
  const every = spacing * ([1, 2, 4, 5, 10, 20, 50, 100, 200].find((k) => across / (k * spacing) <= 8) || 500), found = [];
  for (let i = Math.ceil(low / every - 1e-9); i * every <= high * (1 + 1e-9); i++) {
    const tick = document.createElement("span");
    tick.textContent = written(i * every);
    tick.style.top = 100 * (1 - (i * every - low) / across) + "%";
    found.push(tick);
  }
  return found;
}
