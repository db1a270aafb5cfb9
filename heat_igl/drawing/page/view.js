// The page: the scene that is shown, the controls, and the answers to clicks. The page can save itself as it is.

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

  // Lengths are in units of meta.unit around meta.centre.
  const arrays = await unpacked(byId("data").textContent, meta.arrays);
  byId("data").remove();
  const V = arrays.positions, F = arrays.faces, n = V.length / 3;
  const sweepFaces = arrays.sweepFaces;
  if (sweepFaces && meta.sweepFacesAreDifferences) for (let i = 0; i < F.length; i++) sweepFaces[i] += F[i];

  // ---- what is shown

  // `computed` is what the sweep found after a click, null before.
  let values, sources, dots, computed, map, tables = null;
  const camera = new Camera(canvas, meta), renderer = new Renderer(canvas, gl, V, F, meta);
  // One panel, or two side by side: the field that each shows, and the scale of the colours.
  const panel = (field) => ({ field, low: 0, high: 1, spacing: 1, row: 0, isMap: false, ...renderer.panelBuffers() });
  const panels = [panel("distance"), panel("")];
  const shown = () => (panels[1].field ? panels : panels.slice(0, 1));

  const sweep = () => (tables = tables || sweepTables(n, sweepFaces, arrays.lengths));
  // Numbers of a field: one for each vertex, or two for a map.
  function numbers(field) {
    if (field === "distance") return values;
    if (field !== "log map") return arrays["field " + field];
    map = map || logMap(computed || swept(sweep(), sources));
    return map;
  }
  const isMap = (field) => field === "log map" || meta.fields.some(([name, width]) => name === field && width === 2);
  // Fields that were given do not follow clicks: they keep the sources that they were made with.
  const isGiven = (field) => meta.fields.some(([name]) => name === field);
  const canMap = () => Boolean(sweepFaces) && sources.length > 0;

  function showPanel(at) {
    const found = numbers(at.field);
    at.isMap = isMap(at.field);
    const valueAt = (v) => (at.isMap ? Math.hypot(found[2 * v], found[2 * v + 1]) : found[v]);
    [at.low, at.high, at.row] = limits(n, valueAt);
    const triples = new Float32Array(3 * n);
    for (let v = 0; v < n; v++) {
      if (isFinite(valueAt(v))) triples.set(at.isMap ? [found[2 * v], found[2 * v + 1], 1] : [found[v], 0, 1], 3 * v);
    }
    renderer.fillPanel(at, triples, byId("directions").checked ? arrows(V, F, valueAt) : new Float32Array(0), isGiven(at.field) ? meta.dots : dots);
  }

  function showValues() {
    if (!canMap()) for (const at of panels) if (at.field === "log map") at.field = at === panels[0] ? "distance" : "";
    camera.nPanels = shown().length;
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
    showScales();
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

  function showScale(suffix, at) {
    drawBar(byId("bar" + suffix), at, byId("style").value, meta);
    byId("ticks" + suffix).replaceChildren(...ticks(at, written));
    const names = { distance: meta.label, "log map": "length in the log map" };
    byId("label" + suffix).textContent = (names[at.field] || at.field) + (computed && isGiven(at.field) ? ", as given" : "");
  }

  function showScales() {
    const [left, right] = shown();
    showScale("", left);
    const follow = right && isGiven(left.field) === isGiven(right.field);
    byId("scale2").hidden = !right || ((follow || !computed) && (right.row === left.row && right.low === left.low && right.high === left.high));
    if (!byId("scale2").hidden) showScale("2", right);
  }

  let isWaiting = false;
  function redraw() {
    if (isWaiting) return;
    isWaiting = true;
    requestAnimationFrame(() => {
      isWaiting = false;
      renderer.draw(shown(), camera, Number(byId("style").value), byId("points").checked);
    });
  }

  // ---- clicks

  function setSources(chosen) {
    const start = performance.now();
    sweep();
    const prepared = performance.now();
    computed = swept(tables, chosen);
    values = computed.d;
    const milliseconds = { prepare: prepared - start, solve: performance.now() - prepared };
    sources = chosen;
    map = null;
    dots = chosen.flatMap((s) => [V[3 * s], V[3 * s + 1], V[3 * s + 2]]);
    const others = meta.fields.length ? " Other fields keep their own source: " + meta.fields.map(([name]) => name).join(", ") + "." : "";
    byId("method").textContent = "Computed in this page by the sweep, which unfolds triangles: " + milliseconds.solve.toFixed(0) + " ms." + others;
    showValues();
    return milliseconds;
  }

  const pick = (x, y) => picked(V, F, camera, x, y);

  function describe(v) {
    const where = [0, 1, 2].map((i) => String(Number((meta.centre[i] + meta.unit * V[3 * v + i]).toPrecision(7))));
    const value = isFinite(values[v]) ? written(values[v]) : "unreachable";
    const others = meta.fields.filter(([, width]) => width === 1).map(([name]) => {
      const x = arrays["field " + name][v];
      return ", " + name + " " + (isFinite(x) ? written(x) : "none");
    });
    readout.textContent = "vertex " + v + " at (" + where.join(", ") + "): " + value + others.join("");
  }

  function hover(x, y) {
    const v = pick(x, y);
    if (v >= 0) describe(v);
  }

  function click(x, y, isAdding) {
    const v = pick(x, y);
    if (v < 0) return;
    if (sweepFaces && byId("pick").checked) setSources(isAdding && !sources.includes(v) ? [...sources, v] : [v]);
    describe(v);
  }

  // ---- controls

  const turned = (how) => (...amounts) => { camera[how](...amounts); redraw(); };
  listen(canvas, { rotate: turned("rotate"), move: turned("move"), zoomAt: turned("zoomAt"), hover, click });
  byId("style").addEventListener("change", () => { showScales(); redraw(); });
  byId("spacing").addEventListener("input", showValues);
  byId("directions").addEventListener("change", showValues);
  byId("points").addEventListener("change", redraw);
  byId("field").addEventListener("change", (event) => { panels[0].field = event.target.value; showValues(); });
  byId("beside").addEventListener("change", (event) => { panels[1].field = event.target.value; showValues(); });
  byId("reset").addEventListener("click", () => start(null));
  byId("save").addEventListener("click", save);

  // ---- the scene as it is, to be saved and started with

  function state() {
    return {
      ...camera.state(), field: panels[0].field, beside: panels[1].field, style: byId("style").value, spacing: byId("spacing").value,
      directions: byId("directions").checked, points: byId("points").checked, sources: computed ? sources : null,
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
    values = Float64Array.from(arrays.distance);
    sources = meta.sources.slice();
    dots = meta.dots;
    [computed, map] = [null, null];
    byId("method").textContent = meta.method;
    readout.textContent = n + " vertices, " + F.length / 3 + " triangles.";
    const begin = scene || { ...meta.begin, spacing: meta.spacing === null ? "" : meta.spacing, style: meta.style, sources: null };
    if (scene) camera.set(scene);
    else camera.reset();
    for (const name of ["spacing", "style"]) byId(name).value = begin[name];
    for (const name of ["directions", "points"]) byId(name).checked = begin[name];
    [panels[0].field, panels[1].field] = [begin.field, begin.beside];
    if (begin.sources) setSources(begin.sources);
    else showValues();
  }
  byId("pick-label").hidden = !sweepFaces;
  start(meta.state || null);
  new ResizeObserver(() => { showScales(); redraw(); }).observe(canvas);

  // For other scripts in the page; lengths are in the unit of the mesh.
  window.heatIgl = {
    distance: () => Array.from(values, (x) => x * meta.unit),
    logMap: () => Array.from(numbers("log map"), (x) => x * meta.unit),
    sources: () => sources.slice(),
    setSources,
    pick,
    onCanvas: (v) => camera.project(V, v),
    // For each panel: its field, the vertex at which that is least, and the positions of the sources drawn there.
    panels: () => shown().map((at) => {
      const found = numbers(at.field), size = (v) => (at.isMap ? Math.hypot(found[2 * v], found[2 * v + 1]) : found[v]);
      let least = 0;
      for (let v = 1; v < n; v++) if (size(v) < size(least)) least = v;
      return { field: at.field, least, dots: isGiven(at.field) ? meta.dots : dots };
    }),
    state,
    saved,
  };
})();
