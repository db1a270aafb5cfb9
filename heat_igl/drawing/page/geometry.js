// What is drawn, from positions V and triangles F: normals, sizes of discs, needles in the directions in which values grow.
function vertexNormals(V, F) {
  const normals = new Float32Array(V.length);
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

// Half of the mean length of the edges at each vertex, and a little more so that discs overlap.
function discRadii(V, F) {
  const n = V.length / 3;
  const total = new Float64Array(n), count = new Int32Array(n);
  for (let h = 0; h < F.length; h++) {
    const v = F[h], w = F[h - h % 3 + (h + 1) % 3];
    const length = Math.hypot(V[3 * v] - V[3 * w], V[3 * v + 1] - V[3 * w + 1], V[3 * v + 2] - V[3 * w + 2]);
    for (const end of [v, w]) { total[end] += length; count[end]++; }
  }
  const all = total.reduce((sum, x) => sum + x, 0) / Math.max(count.reduce((sum, x) => sum + x, 0), 1);
  return Float32Array.from(total, (sum, v) => 0.62 * (count[v] ? sum / count[v] : all));
}

// Needles: one on one triangle in each cell of a grid. Side of the cells, in units of half the extent of the surface, and sizes of a needle in sides of a cell.
const CELL = 0.085, LENGTH = 0.75, WIDTH = 0.2;

// Corners of needles, three points each; V and F are positions and triangles, and `valueAt(v)` the value at a vertex.
function arrows(V, F, valueAt) {
  const taken = new Set(), corners = [];
  const minus = (p, q) => [p[0] - q[0], p[1] - q[1], p[2] - q[2]], dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
  const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  const along = (p, s, q) => [p[0] + s * q[0], p[1] + s * q[1], p[2] + s * q[2]];
  for (let f = 0; f < F.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((i) => [V[3 * F[f + i]], V[3 * F[f + i] + 1], V[3 * F[f + i] + 2]]);
    const middle = [0, 1, 2].map((i) => (a[i] + b[i] + c[i]) / 3), cell = middle.map((x) => Math.floor(x / CELL)).join();
    if (taken.has(cell)) continue;
    const [x, y, z] = [0, 1, 2].map((i) => valueAt(F[f + i])), normal = cross(minus(b, a), minus(c, a));
    if (!isFinite(x + y + z)) continue;
    // The gradient of a linear function, up to the area.
    const slope = cross(normal, along([0, 0, 0], x, minus(c, b)).map((p, i) => p + y * (a[i] - c[i]) + z * (b[i] - a[i])));
    const length = Math.sqrt(dot(slope, slope)), size = Math.sqrt(dot(normal, normal));
    if (!(length > 0 && size > 0)) continue;
    taken.add(cell);
    const forward = slope.map((p) => p / length), aside = cross(normal, forward).map((p) => p / size);
    const back = along(middle, -0.5 * LENGTH * CELL, forward);
    corners.push(...along(middle, 0.5 * LENGTH * CELL, forward));
    corners.push(...along(back, 0.5 * WIDTH * CELL, aside), ...along(back, -0.5 * WIDTH * CELL, aside));
  }
  return Float32Array.from(corners);
}
