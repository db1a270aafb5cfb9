// The vertex under the pointer.

// The vertex nearest to the visible point at (x, y) on the canvas, or -1 outside the surface.
function picked(V, F, camera, xOnCanvas, y) {
  const x = camera.inPanel(xOnCanvas), n = V.length / 3;
  const at = new Float64Array(3 * n);
  for (let v = 0; v < n; v++) at.set(camera.project(V, v), 3 * v);
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
