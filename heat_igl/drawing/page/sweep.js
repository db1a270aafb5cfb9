// Distance by unfolding one triangle at a time, in the order of Dijkstra's algorithm: what heat_igl/refine/sweeping.py does in
// the order of the heat. It needs triangles by their corners and edge lengths, and nothing about how they are glued.
"use strict";

// Changes by less than this are not passed on: lengths come in single precision.
const NEGLIGIBLE = 1e-7;
// Visits per vertex up to which the sweep goes back at once, and after which it gives up.
const GO_BACK = 10, GIVE_UP = 50;

// n vertices; F[3 f + c] the corners of face f, lengths[3 f + c] the edge opposite corner c.
function sweepTables(n, F, lengths) {
  const first = new Int32Array(n + 1);
  for (let h = 0; h < F.length; h++) first[F[h] + 1]++;
  for (let v = 0; v < n; v++) first[v + 1] += first[v];
  const next = first.slice(0, n);
  // One row per triangle around a vertex: the other corners a and b; the vertex over the edge ab, along it and to its
  // side in units of the edge; the edge; the ways to a and to b.
  const ends = new Int32Array(2 * F.length), shape = new Float64Array(5 * F.length);
  for (let h = 0; h < F.length; h++) {
    const f = h - h % 3, p = f + (h + 1) % 3, q = f + (h + 2) % 3;
    const base = lengths[h], toA = lengths[q], toB = lengths[p];
    const k = next[F[h]]++;
    ends[2 * k] = F[p];
    ends[2 * k + 1] = F[q];
    // Heron's formula as a product of differences keeps the digits of slivers.
    const half = 0.5 * (base + toA + toB);
    const product = Math.max(half * (half - base) * (half - toA) * (half - toB), 0);
    shape[5 * k] = 0.5 * ((toA - toB) * (toA + toB) / (base * base) + 1);
    shape[5 * k + 1] = 2 * Math.sqrt(product) / (base * base);
    shape[5 * k + 2] = base;
    shape[5 * k + 3] = toA;
    shape[5 * k + 4] = toB;
  }
  return { n, first, ends, shape };
}

// Vertices in ascending order of their distance along edges; those out of reach come last.
function edgeOrder(tables, sources) {
  const { n, first, ends, shape } = tables;
  const d = new Float64Array(n).fill(Infinity), isDone = new Uint8Array(n), order = new Int32Array(n);
  const heap = [], place = new Int32Array(n).fill(-1);
  const put = (i, v) => { heap[i] = v; place[v] = i; };
  const raise = (v) => {
    let i = place[v] < 0 ? heap.length : place[v];
    while (i > 0 && d[heap[(i - 1) >> 1]] > d[v]) { put(i, heap[(i - 1) >> 1]); i = (i - 1) >> 1; }
    put(i, v);
  };
  const pop = () => {
    const top = heap[0], v = heap.pop();
    let i = 0;
    if (heap.length) {
      for (let child = 1; child < heap.length; child = 2 * i + 1) {
        if (child + 1 < heap.length && d[heap[child + 1]] < d[heap[child]]) child++;
        if (d[heap[child]] >= d[v]) break;
        put(i, heap[child]);
        i = child;
      }
      put(i, v);
    }
    return top;
  };
  for (const s of sources) { d[s] = 0; raise(s); }
  let count = 0;
  while (heap.length) {
    const v = pop();
    isDone[v] = 1;
    order[count++] = v;
    for (let k = 2 * first[v]; k < 2 * first[v + 1]; k++) {
      const a = ends[k], length = d[v] + shape[5 * (k >> 1) + 3 + (k & 1)];
      if (!isDone[a] && length < d[a]) { d[a] = length; raise(a); }
    }
  }
  for (let v = 0; v < n; v++) if (!isDone[v]) order[count++] = v;
  return order;
}

// Distance from the sources, Infinity where they do not reach.
function sweepDistance(tables, sources) {
  const { n, first, ends, shape } = tables;
  const order = edgeOrder(tables, sources), rank = new Int32Array(n);
  for (let i = 0; i < n; i++) rank[order[i]] = i;
  const d = new Float64Array(n).fill(Infinity), isStale = new Uint8Array(n).fill(1);
  for (const s of sources) d[s] = 0;
  let lowest = n;
  const mark = (v) => { if (!isStale[v]) { isStale[v] = 1; lowest = Math.min(lowest, rank[v]); } };
  let i = 0, again = n;
  for (let visits = 0; visits < GIVE_UP * n;) {
    if (i === n) {
      if (again === n) break;
      i = again;
      again = n;
    }
    const v = order[i++];
    if (!isStale[v]) continue;
    isStale[v] = 0;
    visits++;
    const old = d[v];
    let best = old;
    for (let k = first[v]; k < first[v + 1]; k++) {
      const da = d[ends[2 * k]], db = d[ends[2 * k + 1]], row = 5 * k, base = shape[row + 2];
      best = Math.min(best, da + shape[row + 3], db + shape[row + 4]);
      if ((da >= best && db >= best) || da === Infinity || db === Infinity) continue;
      // The source in units of the edge ab: x along it, y behind it.
      const x = 0.5 * ((da - db) * (da + db) / (base * base) + 1), ySquared = da * da / (base * base) - x * x;
      if (!(ySquared >= 0)) continue;
      const y = Math.sqrt(ySquared), px = shape[row], py = shape[row + 1], crossing = x * py + px * y;
      if (crossing >= 0 && crossing <= y + py) best = Math.min(best, base * Math.sqrt((px - x) ** 2 + (py + y) ** 2));
    }
    if (!(best < old)) continue;
    d[v] = best;
    if (best >= old * (1 - NEGLIGIBLE)) continue;
    // Farther neighbours depend on v, and nearer ones whose way can cross an edge that ends in v.
    lowest = n;
    for (let k = first[v]; k < first[v + 1]; k++) {
      const a = ends[2 * k], b = ends[2 * k + 1], row = 5 * k, along = shape[row] * shape[row + 2];
      if (best < d[a] || 2 * d[a] * along < shape[row + 3] ** 2) mark(a);
      if (best < d[b] || 2 * d[b] * (shape[row + 2] - along) < shape[row + 4] ** 2) mark(b);
    }
    // Back to those that came too early, at once, before what is wrong there spreads.
    if (lowest < i) {
      if (visits < GO_BACK * n) i = lowest;
      else again = Math.min(again, lowest);
    }
  }
  return d;
}
