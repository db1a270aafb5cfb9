// The surface in WebGL, once or twice side by side: colours, isolines, stripes and checkerboards per pixel; rotation, zoom and
// translation; picking of vertices. The page can save itself as it is.
"use strict";

(async () => {
  const byId = (id) => document.getElementById(id);
  // The document before anything changes in it, in two parts around the description of the scene.
  const documentParts = document.documentElement.outerHTML.split(byId("meta").textContent);
  const meta = JSON.parse(byId("meta").textContent);
  const readout = byId("readout"), canvas = byId("surface");
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl || typeof DecompressionStream === "undefined") {
    readout.textContent = "This browser cannot show the surface: it lacks " + (gl ? "DecompressionStream." : "WebGL 2.");
    return;
  }

  // ---- data: lengths in units of meta.unit around meta.centre

  async function unpack(base64) {
    const packed = Uint8Array.from(atob(base64.trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer()), arrays = {};
    let start = 0;
    for (const [name, kind, size] of meta.arrays) {
      // Bytes are grouped by significance, which compresses better.
      const whole = new Uint8Array(4 * size);
      for (let i = 0; i < size; i++) for (let b = 0; b < 4; b++) whole[4 * i + b] = bytes[start + b * size + i];
      arrays[name] = new (kind === "float" ? Float32Array : Int32Array)(whole.buffer);
      start += 4 * size;
    }
    return arrays;
  }

  const arrays = await unpack(byId("data").textContent);
  byId("data").remove();
  const V = arrays.positions, F = arrays.faces, n = V.length / 3;
  let tables = null;
  const sweepFaces = arrays.sweepFaces;
  if (sweepFaces && meta.sweepFacesAreDifferences) for (let i = 0; i < F.length; i++) sweepFaces[i] += F[i];
  let values = Float64Array.from(arrays.distance), sources = meta.sources.slice(), dots = meta.dots, isComputed = false;

  function program(vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return new Proxy({ made }, { get: (self, name) => (name === "made" ? made : gl.getUniformLocation(made, name)) });
  }
  const inked = (text) => text.replaceAll("LINE_INK", meta.lineInk).replaceAll("STRIPE_INK", meta.stripeInk);
  const surface = program(SURFACE_VERTEX, inked(SURFACE_FRAGMENT)), discs = program(DISC_VERTEX, inked(DISC_FRAGMENT));
  const dotProgram = program(DOT_VERTEX, DOT_FRAGMENT), arrowProgram = program(ARROW_VERTEX, ARROW_FRAGMENT);

  const refill = (buffer, data) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW); };
  const filled = (data) => {
    const buffer = gl.createBuffer();
    refill(buffer, data);
    return buffer;
  };
  // Arrays for a program: its inputs by name, each a buffer and the numbers per vertex.
  function arraysOf(owner, inputs) {
    const made = gl.createVertexArray();
    gl.bindVertexArray(made);
    for (const [name, [buffer, size]] of Object.entries(inputs)) {
      const at = gl.getAttribLocation(owner.made, name);
      if (at < 0) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    }
    return made;
  }
  const shared = { position: [filled(V), 3], normal: [filled(vertexNormals(V, F)), 3], radius: [filled(discRadii(V, F)), 1] };
  const nothing = new Float32Array(0), triangles = gl.createBuffer(), dotBuffer = filled(nothing);
  const dotArrays = arraysOf(dotProgram, { position: [dotBuffer, 3] });
  gl.bindVertexArray(null);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, F, gl.STATIC_DRAW);

  // One panel, or two side by side: the field that each shows, its numbers and the scale of its colours.
  function panel(field) {
    const value = filled(nothing), needles = filled(nothing);
    const made = { field, value, needles, nNeedles: 0, low: 0, high: 1, spacing: 1, row: 0, isMap: false };
    made.onSurface = arraysOf(surface, { ...shared, value: [value, 3] });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
    made.onDiscs = arraysOf(discs, { ...shared, value: [value, 3] });
    made.onArrows = arraysOf(arrowProgram, { position: [needles, 3] });
    gl.bindVertexArray(null);
    return made;
  }
  const panels = [panel("distance"), panel("")];
  const shown = () => (panels[1].field ? panels : panels.slice(0, 1));

  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  const table = Uint8Array.from([...meta.colours, ...meta.signedColours].flatMap((rgb) => [...rgb, 255]));
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, meta.colours.length, 2, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
  for (const [key, to] of [["MIN_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
    gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + key], gl[to]);
  gl.enable(gl.DEPTH_TEST);

  // ---- the displayed fields

  const sweep = () => (tables = tables || sweepTables(n, sweepFaces, arrays.lengths));
  let map = null;
  // Numbers of a field: one for each vertex, or two for a map.
  function numbers(field) {
    if (field === "distance") return values;
    if (field !== "log map") return arrays["field " + field];
    map = map || logMap(sweep(), isComputed ? values : sweepDistance(sweep(), sources), sources);
    return map;
  }
  const isMap = (field) => field === "log map" || meta.fields.some(([name, width]) => name === field && width === 2);
  const canMap = () => Boolean(sweepFaces) && sources.length > 0;

  function limits(shownHere, found) {
    let low = 0, high = 0;
    for (let v = 0; v < n; v++) {
      const x = shownHere.isMap ? Math.hypot(found[2 * v], found[2 * v + 1]) : found[v];
      if (isFinite(x)) { low = Math.min(low, x); high = Math.max(high, x); }
    }
    // White is 0 where there are values of both signs.
    const isSigned = low < 0 && high > 0;
    if (isSigned) [low, high] = [Math.min(low, -high), Math.max(high, -low)];
    return [low, high, isSigned ? 0.75 : 0.25];
  }

  function showPanel(at) {
    const found = numbers(at.field);
    at.isMap = isMap(at.field);
    [at.low, at.high, at.row] = limits(at, found);
    const triples = new Float32Array(3 * n), valueAt = (v) => (at.isMap ? Math.hypot(found[2 * v], found[2 * v + 1]) : found[v]);
    for (let v = 0; v < n; v++) {
      if (isFinite(valueAt(v))) triples.set(at.isMap ? [found[2 * v], found[2 * v + 1], 1] : [found[v], 0, 1], 3 * v);
    }
    refill(at.value, triples);
    const corners = byId("directions").checked ? arrows(V, F, valueAt) : nothing;
    at.nNeedles = corners.length / 3;
    refill(at.needles, corners);
  }

  function showValues() {
    if (!canMap()) for (const at of panels) if (at.field === "log map") at.field = at === panels[0] ? "distance" : "";
    listFields();
    shown().forEach(showPanel);
    const [left, right] = shown();
    // The same colours for the same numbers, if both are of one kind.
    if (right && right.row === left.row) {
      left.low = right.low = Math.min(left.low, right.low);
      left.high = right.high = Math.max(left.high, right.high);
    }
    const asked = parseFloat(byId("spacing").value) / meta.unit;
    for (const at of shown()) {
      if (!(at.high > at.low)) at.high = at.low + 1;
      const across = at.high - at.low;
      at.spacing = asked > across / 1000 ? asked : roundSpacing(across * meta.unit) / meta.unit;
    }
    refill(dotBuffer, Float32Array.from(dots));
    drawBars();
    redraw();
  }

  function listFields() {
    const names = ["distance", ...(canMap() ? ["log map"] : []), ...meta.fields.map(([name]) => name)];
    for (const [id, choices, chosen] of [["field", names, panels[0].field], ["beside", ["", ...names], panels[1].field]]) {
      byId(id).replaceChildren(...choices.map((name) => new Option(name || "nothing", name, false, name === chosen)));
      byId(id).parentElement.hidden = !sweepFaces && !meta.fields.length;
    }
  }

  const written = (x) => String(Number((x * meta.unit).toPrecision(6)));

  function drawBars() {
    const [left, right] = shown();
    drawBar("", left);
    byId("scale2").hidden = !right || (right.row === left.row && right.low === left.low && right.high === left.high);
    if (!byId("scale2").hidden) drawBar("2", right);
  }

  function drawBar(suffix, at) {
    const bar = byId("bar" + suffix), rows = Math.max(bar.clientHeight, 1), pen = bar.getContext("2d"), style = byId("style").value;
    bar.width = 1;
    bar.height = rows;
    const { low, high, spacing } = at, across = high - low, colours = at.row > 0.5 ? meta.signedColours : meta.colours;
    for (let row = 0; row < rows; row++) {
      const share = 1 - (row + 0.5) / rows, x = low + share * across, level = x / spacing;
      const last = colours.length - 1, rgb = colours[Math.round(share * last)];
      const isLine = style === "0" && !at.isMap && Math.abs(level - Math.round(level)) <= 0.5 * across / rows / spacing;
      const isLight = style === "1" && !at.isMap && Math.floor(level) % 2 !== 0;
      const ink = rgb.map((c) => (isLine && (low < 0 || Math.round(level) !== 0) ? c * (1 - meta.lineInk) : isLight ? c + meta.stripeInk * (255 - c) : c));
      pen.fillStyle = "rgb(" + ink.join(",") + ")";
      pen.fillRect(0, row, 1, 1);
    }
    const every = spacing * ([1, 2, 4, 5, 10, 20, 50, 100, 200].find((k) => across / (k * spacing) <= 8) || 500);
    const ticks = [];
    for (let i = Math.ceil(low / every - 1e-9); i * every <= high * (1 + 1e-9); i++) {
      const tick = document.createElement("span");
      tick.textContent = written(i * every);
      tick.style.top = 100 * (1 - (i * every - low) / across) + "%";
      ticks.push(tick);
    }
    byId("ticks" + suffix).replaceChildren(...ticks);
    byId("label" + suffix).textContent = at.field === "distance" ? meta.label : at.field === "log map" ? "length in the log map" : at.field;
  }

  function setSources(chosen) {
    const start = performance.now();
    sweep();
    const prepared = performance.now();
    values = sweepDistance(tables, chosen);
    const milliseconds = { prepare: prepared - start, solve: performance.now() - prepared };
    sources = chosen;
    isComputed = true;
    map = null;
    dots = chosen.flatMap((s) => [V[3 * s], V[3 * s + 1], V[3 * s + 2]]);
    const others = meta.fields.length ? " Other fields are as given: " + meta.fields.map(([name]) => name).join(", ") + "." : "";
    byId("method").textContent = "Computed in this page by the sweep, which unfolds triangles: " + milliseconds.solve.toFixed(0) + " ms." + others;
    showValues();
    return milliseconds;
  }

  // ---- the camera: a parallel projection

  let turn, pan, zoom;
  function resetView() {
    turn = meta.turn.map((row) => row.slice());
    pan = [-meta.middle[0], -meta.middle[1]];
    zoom = 1;
  }
  const panelWidth = () => Math.floor(canvas.clientWidth / shown().length);
  // Pixels of the page per unit.
  function pixelsPerUnit() {
    const [x, y] = meta.extent;
    return 0.92 * zoom * Math.min(panelWidth() / x, canvas.clientHeight / y);
  }
  function rotate(dx, dy) {
    const angle = Math.hypot(dx, dy);
    if (!angle) return;
    // The axis lies in the screen, at right angles to the motion: the front of the surface follows the pointer.
    const [x, y] = [dy / angle, dx / angle], c = Math.cos(angle), s = Math.sin(angle), t = 1 - c;
    const R = [[t * x * x + c, t * x * y, s * y], [t * x * y, t * y * y + c, -s * x], [-s * y, s * x, c]];
    const centre = [-pan[0], -pan[1], 0];
    const product = R.map((row) => [0, 1, 2].map((j) => row[0] * turn[0][j] + row[1] * turn[1][j] + row[2] * turn[2][j]));
    turn = product;
    pan = [-(R[0][0] * centre[0] + R[0][1] * centre[1]), -(R[1][0] * centre[0] + R[1][1] * centre[1])];
    redraw();
  }
  const inPanel = (x) => (x >= panelWidth() && panels[1].field ? x - panelWidth() : x);
  function zoomAt(factor, x, y) {
    const before = pixelsPerUnit();
    zoom = Math.min(Math.max(zoom * factor, 0.2), 2000);
    const change = 1 / pixelsPerUnit() - 1 / before;
    pan = [pan[0] + (inPanel(x) - panelWidth() / 2) * change, pan[1] - (y - canvas.clientHeight / 2) * change];
    redraw();
  }
  function move(dx, dy) {
    pan = [pan[0] + dx / pixelsPerUnit(), pan[1] - dy / pixelsPerUnit()];
    redraw();
  }

  let isWaiting = false;
  function redraw() {
    if (isWaiting) return;
    isWaiting = true;
    requestAnimationFrame(() => { isWaiting = false; draw(); });
  }
  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const across = Math.floor(width / shown().length);
    shown().forEach((at, i) => {
      gl.viewport(i * across, 0, across, height);
      drawPanel(at, ratio);
    });
  }
  function place(owner) {
    gl.useProgram(owner.made);
    gl.uniformMatrix3fv(owner.turn, true, turn.flat());
    gl.uniform2f(owner.zoom, 2 * pixelsPerUnit() / panelWidth(), 2 * pixelsPerUnit() / canvas.clientHeight);
    gl.uniform2f(owner.pan, ...pan);
  }
  function drawPanel(at, ratio) {
    const owner = byId("points").checked ? discs : surface;
    place(owner);
    for (const name of ["low", "high", "spacing", "row"]) gl.uniform1f(owner[name], at[name]);
    gl.uniform1f(owner.lineWidth, 1.3 * ratio);
    gl.uniform1i(owner.style, Number(byId("style").value));
    gl.uniform1i(owner.isMap, at.isMap);
    if (owner === discs) {
      gl.uniform1f(owner.pixels, pixelsPerUnit() * ratio);
      gl.bindVertexArray(at.onDiscs);
      gl.drawArrays(gl.POINTS, 0, n);
    } else {
      gl.bindVertexArray(at.onSurface);
      gl.drawElements(gl.TRIANGLES, F.length, gl.UNSIGNED_INT, 0);
    }
    if (at.nNeedles) {
      place(arrowProgram);
      gl.bindVertexArray(at.onArrows);
      gl.drawArrays(gl.TRIANGLES, 0, at.nNeedles);
    }
    place(dotProgram);
    gl.uniform1f(dotProgram.size, (dots.length <= 60 ? 11 : 5) * ratio);
    gl.bindVertexArray(dotArrays);
    gl.depthMask(false);
    for (const [isHidden, compare] of [[1, gl.GREATER], [0, gl.LEQUAL]]) {
      gl.depthFunc(compare);
      gl.uniform1i(dotProgram.isHidden, isHidden);
      gl.drawArrays(gl.POINTS, 0, dots.length / 3);
    }
    gl.depthFunc(gl.LESS);
    gl.depthMask(true);
  }

  // ---- picking

  // Position of a vertex on the canvas, in pixels of the page, and depth; in the left panel of two.
  function onCanvas(v) {
    const at = turn.map((row) => row[0] * V[3 * v] + row[1] * V[3 * v + 1] + row[2] * V[3 * v + 2]), s = pixelsPerUnit();
    return [panelWidth() / 2 + s * (at[0] + pan[0]), canvas.clientHeight / 2 - s * (at[1] + pan[1]), at[2]];
  }
  // The vertex nearest to the visible point at (x, y) on the canvas, or -1 outside the surface.
  function pick(xOnCanvas, y) {
    const x = inPanel(xOnCanvas);
    const at = new Float64Array(3 * n);
    for (let v = 0; v < n; v++) at.set(onCanvas(v), 3 * v);
    let best = -1, nearest = -Infinity;
    for (let f = 0; f < F.length; f += 3) {
      const [a, b, c] = [3 * F[f], 3 * F[f + 1], 3 * F[f + 2]];
      const px = at[b] - at[a], py = at[b + 1] - at[a + 1], qx = at[c] - at[a], qy = at[c + 1] - at[a + 1];
      const area = px * qy - py * qx, dx = x - at[a], dy = y - at[a + 1];
      const wb = (dx * qy - dy * qx) / area, wc = (px * dy - py * dx) / area;
      if (!(wb >= 0 && wc >= 0 && wb + wc <= 1)) continue;
      const depth = at[a + 2] + wb * (at[b + 2] - at[a + 2]) + wc * (at[c + 2] - at[a + 2]);
      if (depth <= nearest) continue;
      nearest = depth;
      const weight = [1 - wb - wc, wb, wc];
      const hit = [0, 1, 2].map((i) => weight[0] * V[a + i] + weight[1] * V[b + i] + weight[2] * V[c + i]);
      const away = [a, b, c].map((k) => Math.hypot(V[k] - hit[0], V[k + 1] - hit[1], V[k + 2] - hit[2]));
      best = F[f + away.indexOf(Math.min(...away))];
    }
    return best;
  }
  function describe(v) {
    const where = [0, 1, 2].map((i) => String(Number((meta.centre[i] + meta.unit * V[3 * v + i]).toPrecision(7))));
    const value = isFinite(values[v]) ? written(values[v]) : "unreachable";
    const others = meta.fields.filter(([, width]) => width === 1).map(([name]) => {
      const x = arrays["field " + name][v];
      return ", " + name + " " + (isFinite(x) ? written(x) : "none");
    });
    readout.textContent = "vertex " + v + " at (" + where.join(", ") + "): " + value + others.join("");
  }
  function click(x, y, isAdding) {
    const v = pick(x, y);
    if (v < 0) return;
    if (sweepFaces && byId("pick").checked) setSources(isAdding && !sources.includes(v) ? [...sources, v] : [v]);
    describe(v);
  }

  // ---- input

  const touching = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", (event) => {
    if (!touching.size) travelled = 0;
    touching.set(event.pointerId, [event.offsetX, event.offsetY]);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const was = touching.get(event.pointerId), now = [event.offsetX, event.offsetY];
    if (!was) {
      hover = now;
      if (!isHovering) { isHovering = true; requestAnimationFrame(() => { isHovering = false; lookAt(hover); }); }
      return;
    }
    const dx = now[0] - was[0], dy = now[1] - was[1];
    travelled += Math.hypot(dx, dy);
    if (touching.size === 1 && travelled > 4) {
      if (event.shiftKey || event.buttons > 1) move(dx, dy);
      else rotate(0.008 * dx, 0.008 * dy);
    } else if (touching.size === 2) {
      const [other] = [...touching].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const length = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      move(dx / 2, dy / 2);
      zoomAt(length(now) / length(was), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    }
    touching.set(event.pointerId, now);
  });
  let hover = null, isHovering = false;
  function lookAt([x, y]) {
    const v = pick(x, y);
    if (v >= 0) describe(v);
  }
  canvas.addEventListener("pointerup", (event) => {
    const wasAlone = touching.size === 1;
    touching.delete(event.pointerId);
    if (wasAlone && travelled <= 4 && event.button === 0) click(event.offsetX, event.offsetY, event.shiftKey);
  });
  canvas.addEventListener("pointercancel", (event) => touching.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomAt(Math.exp(-(event.deltaMode ? 30 : 1) * event.deltaY * 0.0015), event.offsetX, event.offsetY);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const factor = { "+": 1.2, "-": 1 / 1.2 }[event.key];
    if (turns) rotate(0.1 * turns[0], 0.1 * turns[1]);
    else if (factor) zoomAt(factor, canvas.clientWidth / 2, canvas.clientHeight / 2);
    else return;
    event.preventDefault();
  });
  byId("style").addEventListener("change", () => { drawBars(); redraw(); });
  byId("spacing").addEventListener("input", showValues);
  byId("directions").addEventListener("change", showValues);
  byId("points").addEventListener("change", redraw);
  byId("field").addEventListener("change", (event) => { panels[0].field = event.target.value; showValues(); });
  byId("beside").addEventListener("change", (event) => { panels[1].field = event.target.value; showValues(); });
  byId("reset").addEventListener("click", () => start(null));
  byId("save").addEventListener("click", save);
  new ResizeObserver(() => { drawBars(); redraw(); }).observe(canvas);

  // ---- the scene: what is shown, and how

  function state() {
    return {
      turn, pan, zoom, field: panels[0].field, beside: panels[1].field, style: byId("style").value, spacing: byId("spacing").value,
      directions: byId("directions").checked, points: byId("points").checked, sources: isComputed ? sources : null,
    };
  }
  // This page with the scene as it is, as a document of its own.
  function saved() {
    const text = JSON.stringify({ ...meta, state: state() }).replaceAll("<", "\\u003c");
    return "<!DOCTYPE html>\n" + documentParts.join(text);
  }
  function save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([saved()], { type: "text/html" }));
    link.download = document.title.replace(/[^\w.-]+/g, "-") + "-scene.html";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  function start(scene) {
    resetView();
    values = Float64Array.from(arrays.distance);
    sources = meta.sources.slice();
    dots = meta.dots;
    [isComputed, map] = [false, null];
    byId("method").textContent = meta.method;
    readout.textContent = n + " vertices, " + F.length / 3 + " triangles.";
    const begin = scene || { ...meta.begin, spacing: meta.spacing === null ? "" : meta.spacing, style: meta.style, sources: null };
    if (scene) [turn, pan, zoom] = [scene.turn.map((row) => row.slice()), scene.pan.slice(), scene.zoom];
    for (const name of ["spacing", "style"]) byId(name).value = begin[name];
    for (const name of ["directions", "points"]) byId(name).checked = begin[name];
    [panels[0].field, panels[1].field] = [begin.field, begin.beside];
    if (begin.sources) setSources(begin.sources);
    else showValues();
  }
  byId("pick-label").hidden = !sweepFaces;
  start(meta.state || null);

  // For other scripts in the page; lengths are in the unit of the mesh.
  window.heatIgl = {
    distance: () => Array.from(values, (x) => x * meta.unit),
    logMap: () => Array.from(numbers("log map"), (x) => x * meta.unit),
    sources: () => sources.slice(),
    setSources,
    pick,
    onCanvas,
    state,
    saved,
  };
})();
