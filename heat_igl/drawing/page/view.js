// The surface in WebGL: colours, isolines and stripes per pixel; rotation, zoom and translation; picking of vertices.
"use strict";

(async () => {
  const byId = (id) => document.getElementById(id);
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
  let values = Float64Array.from(arrays.distance), sources = meta.sources.slice(), dots = meta.dots;

  function vertexNormals() {
    const normals = new Float32Array(3 * n);
    for (let f = 0; f < F.length; f += 3) {
      const [a, b, c] = [3 * F[f], 3 * F[f + 1], 3 * F[f + 2]];
      const p = [0, 1, 2].map((i) => V[b + i] - V[a + i]), q = [0, 1, 2].map((i) => V[c + i] - V[a + i]);
      for (let i = 0; i < 3; i++) {
        const j = (i + 1) % 3, k = (i + 2) % 3, x = p[j] * q[k] - p[k] * q[j];
        normals[a + i] += x; normals[b + i] += x; normals[c + i] += x;
      }
    }
    return normals;
  }

  // ---- shaders

  const SURFACE_VERTEX = `#version 300 es
    uniform mat3 turn; uniform vec2 zoom, pan;
    in vec3 position, normal; in vec2 value;
    out vec3 place, smoothNormal; out vec2 here;
    void main() {
      place = turn * position; smoothNormal = turn * normal; here = value;
      gl_Position = vec4((place.xy + pan) * zoom, -0.5 * place.z, 1.0);
    }`;
  const SURFACE_FRAGMENT = `#version 300 es
    precision highp float;
    uniform sampler2D colours; uniform float low, high, spacing, lineWidth; uniform int style;
    in vec3 place, smoothNormal; in vec2 here;
    out vec4 colour;
    // Integral of a wave that is 1 on every second unit.
    float wave(float x) { return floor(0.5 * x) + max(mod(x, 2.0) - 1.0, 0.0); }
    void main() {
      float level = here.x / spacing, perPixel = length(vec2(dFdx(level), dFdy(level)));
      vec3 ink = texture(colours, vec2((here.x - low) / (high - low), 0.5)).rgb;
      if (style == 0 && perPixel > 0.0) {
        float nearest = round(level), width = min(lineWidth, 0.25 / perPixel);
        float cover = clamp(width / 2.0 + 0.5 - abs(level - nearest) / perPixel, 0.0, 1.0) * min(1.0, width);
        if (low < 0.0 || nearest > 0.5) ink *= 1.0 - LINE_INK * cover;
      }
      if (style == 1) {
        float span = max(perPixel, 1e-4);
        ink = mix(ink, vec3(1.0), STRIPE_INK * (wave(level + span / 2.0) - wave(level - span / 2.0)) / span);
      }
      if (here.y < 0.999) ink = vec3(0.72);
      vec3 flatNormal = normalize(cross(dFdx(place), dFdy(place))), n = normalize(smoothNormal);
      n = n.z < 0.0 ? -n : n;
      if (!(dot(n, flatNormal) > 0.82)) n = flatNormal;
      colour = vec4(ink * (0.6 + 0.4 * pow(clamp(dot(n, vec3(-0.53, 0.73, 1.0)), 0.0, 1.15), 0.8)), 1.0);
    }`;
  const DOT_VERTEX = `#version 300 es
    uniform mat3 turn; uniform vec2 zoom, pan; uniform float size;
    in vec3 position;
    void main() {
      vec3 place = turn * position;
      gl_Position = vec4((place.xy + pan) * zoom, -0.5 * place.z - 0.006, 1.0);
      gl_PointSize = size;
    }`;
  const DOT_FRAGMENT = `#version 300 es
    precision highp float;
    uniform bool isHidden;
    out vec4 colour;
    void main() {
      float r = 2.0 * length(gl_PointCoord - 0.5);
      if (r > 1.0 || (isHidden && r < 0.7)) discard;
      colour = !isHidden && r > 0.75 ? vec4(1.0) : vec4(0.91, 0.0, 0.043, 1.0);
    }`;

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
  const inked = SURFACE_FRAGMENT.replace("LINE_INK", meta.lineInk).replace("STRIPE_INK", meta.stripeInk);
  const surface = program(SURFACE_VERTEX, inked), dotProgram = program(DOT_VERTEX, DOT_FRAGMENT);

  function attribute(owner, name, size) {
    const buffer = gl.createBuffer(), at = gl.getAttribLocation(owner.made, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    return (data) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW); };
  }
  const surfaceArrays = gl.createVertexArray();
  gl.bindVertexArray(surfaceArrays);
  attribute(surface, "position", 3)(V);
  attribute(surface, "normal", 3)(vertexNormals());
  const setValues = attribute(surface, "value", 2);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, F, gl.STATIC_DRAW);
  const dotArrays = gl.createVertexArray();
  gl.bindVertexArray(dotArrays);
  const setDots = attribute(dotProgram, "position", 3);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  const table = Uint8Array.from(meta.colours.flatMap((rgb) => [...rgb, 255]));
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, meta.colours.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
  for (const [key, to] of [["MIN_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
    gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + key], gl[to]);
  gl.enable(gl.DEPTH_TEST);

  // ---- the displayed field

  const scale = { low: 0, high: 1, spacing: 1 };

  function roundSpacing(largest) {
    const power = 10 ** Math.floor(Math.log10(largest / 16));
    const steps = [1, 2, 5, 10, 20, 50].map((digit) => digit * power);
    const off = (step) => Math.abs(Math.log(largest / 16 / step));
    return steps.reduce((best, step) => (off(step) < off(best) ? step : best));
  }

  function showValues() {
    let low = 0, high = 0;
    for (const x of values) if (isFinite(x)) { low = Math.min(low, x); high = Math.max(high, x); }
    scale.low = low;
    scale.high = high > low ? high : low + 1;
    const asked = parseFloat(byId("spacing").value) / meta.unit;
    scale.spacing = asked > (scale.high - low) / 1000 ? asked : roundSpacing((scale.high - low) * meta.unit) / meta.unit;
    const pairs = new Float32Array(2 * n);
    for (let v = 0; v < n; v++) if (isFinite(values[v])) { pairs[2 * v] = values[v]; pairs[2 * v + 1] = 1; }
    setValues(pairs);
    setDots(Float32Array.from(dots));
    drawBar();
    redraw();
  }

  const written = (x) => String(Number((x * meta.unit).toPrecision(6)));

  function drawBar() {
    const bar = byId("bar"), rows = Math.max(bar.clientHeight, 1), pen = bar.getContext("2d"), style = byId("style").value;
    bar.width = 1;
    bar.height = rows;
    const { low, high, spacing } = scale, across = high - low;
    for (let row = 0; row < rows; row++) {
      const at = 1 - (row + 0.5) / rows, x = low + at * across, level = x / spacing;
      const last = meta.colours.length - 1, rgb = meta.colours[Math.round(at * last)];
      const isLine = style === "0" && Math.abs(level - Math.round(level)) <= 0.5 * across / rows / spacing;
      const isLight = style === "1" && Math.floor(level) % 2 !== 0;
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
    byId("ticks").replaceChildren(...ticks);
  }

  function setSources(chosen) {
    const start = performance.now();
    tables = tables || sweepTables(n, sweepFaces, arrays.lengths);
    const prepared = performance.now();
    values = sweepDistance(tables, chosen);
    const milliseconds = { prepare: prepared - start, solve: performance.now() - prepared };
    sources = chosen;
    dots = chosen.flatMap((s) => [V[3 * s], V[3 * s + 1], V[3 * s + 2]]);
    byId("method").textContent = "Computed in this page by the sweep, which unfolds triangles: " + milliseconds.solve.toFixed(0) + " ms.";
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
  // Pixels of the page per unit.
  function pixelsPerUnit() {
    const [x, y] = meta.extent;
    return 0.92 * zoom * Math.min(canvas.clientWidth / x, canvas.clientHeight / y);
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
  function zoomAt(factor, x, y) {
    const before = pixelsPerUnit();
    zoom = Math.min(Math.max(zoom * factor, 0.2), 2000);
    const change = 1 / pixelsPerUnit() - 1 / before;
    pan = [pan[0] + (x - canvas.clientWidth / 2) * change, pan[1] - (y - canvas.clientHeight / 2) * change];
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
    const place = (owner) => {
      gl.useProgram(owner.made);
      gl.uniformMatrix3fv(owner.turn, true, turn.flat());
      gl.uniform2f(owner.zoom, 2 * pixelsPerUnit() / canvas.clientWidth, 2 * pixelsPerUnit() / canvas.clientHeight);
      gl.uniform2f(owner.pan, ...pan);
    };
    place(surface);
    gl.uniform1f(surface.low, scale.low);
    gl.uniform1f(surface.high, scale.high);
    gl.uniform1f(surface.spacing, scale.spacing);
    gl.uniform1f(surface.lineWidth, 1.3 * ratio);
    gl.uniform1i(surface.style, Number(byId("style").value));
    gl.bindVertexArray(surfaceArrays);
    gl.drawElements(gl.TRIANGLES, F.length, gl.UNSIGNED_INT, 0);
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

  // Position of a vertex on the canvas, in pixels of the page, and depth.
  function onCanvas(v) {
    const at = turn.map((row) => row[0] * V[3 * v] + row[1] * V[3 * v + 1] + row[2] * V[3 * v + 2]), s = pixelsPerUnit();
    return [canvas.clientWidth / 2 + s * (at[0] + pan[0]), canvas.clientHeight / 2 - s * (at[1] + pan[1]), at[2]];
  }
  // The vertex nearest to the visible point at (x, y) on the canvas, or -1 outside the surface.
  function pick(x, y) {
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
    readout.textContent = "vertex " + v + " at (" + where.join(", ") + "): " + value;
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
  byId("style").addEventListener("change", () => { drawBar(); redraw(); });
  byId("spacing").addEventListener("input", showValues);
  byId("reset").addEventListener("click", start);
  new ResizeObserver(() => { drawBar(); redraw(); }).observe(canvas);

  function start() {
    resetView();
    values = Float64Array.from(arrays.distance);
    sources = meta.sources.slice();
    dots = meta.dots;
    byId("spacing").value = meta.spacing === null ? "" : meta.spacing;
    byId("style").value = meta.style;
    byId("method").textContent = meta.method;
    readout.textContent = n + " vertices, " + F.length / 3 + " triangles.";
    showValues();
  }
  byId("label").textContent = meta.label;
  byId("pick-label").hidden = !sweepFaces;
  start();

  // For other scripts in the page; lengths are in the unit of the mesh.
  window.heatIgl = {
    distance: () => Array.from(values, (x) => x * meta.unit),
    sources: () => sources.slice(),
    setSources,
    pick,
    onCanvas,
  };
})();
