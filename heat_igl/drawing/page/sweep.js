// Distance by unfolding two triangles at a time: the algorithm of heat_igl/kernels/sweep/sweeping.py, in the order of Dijkstra's
// algorithm. The input is the corners and the edge lengths of triangles. Two triangles are glued at an edge
// if no other triangle has both ends of the edge.
"use strict";

// Smaller changes are not propagated, since lengths have single precision.
const NEGLIGIBLE = 1e-7;
// Smallest distance of a source from an edge, in edge lengths, such that circles about the ends intersect at an angle.
const CLOSE = 1e-3;
// Visits per vertex up to which vertices are visited again at once, and after which the sweep stops.
const GO_BACK = 10, GIVE_UP = 50;

// Position of the third corner of a triangle relative to the side ab: along ab and height, in units of ab.
function apex(base, toA, toB) {
  // Heron's formula as a product of differences is accurate for slivers.
  const half = 0.5 * (base + toA + toB);
  const product = Math.max(half * (half - base) * (half - toA) * (half - toB), 0);
  return [0.5 * ((toA - toB) * (toA + toB) / (base * base) + 1), 2 * Math.sqrt(product) / (base * base)];
}

// For each corner, the opposite corner in the other triangle at the same edge; -1 if there is no or more than one such triangle.
function glued(n, F) {
  const across = new Map(), twin = new Int32Array(F.length).fill(-1);
  for (let h = 0; h < F.length; h++) {
    const f = h - h % 3, a = F[f + (h + 1) % 3], b = F[f + (h + 2) % 3], edge = Math.min(a, b) * n + Math.max(a, b);
    if (across.has(edge)) across.get(edge).push(h);
    else across.set(edge, [h]);
  }
  for (const there of across.values()) {
    if (there.length === 2) [twin[there[0]], twin[there[1]]] = [there[1], there[0]];
  }
  return twin;
}

// n is the number of vertices, F[3 f + c] corner c of face f, lengths[3 f + c] the length of the edge opposite to corner c.
function sweepTables(n, F, lengths) {
  const first = new Int32Array(n + 1);
  for (let h = 0; h < F.length; h++) first[F[h] + 1]++;
  for (let v = 0; v < n; v++) first[v + 1] += first[v];
  const next = first.slice(0, n), twin = glued(n, F);
  // One row per triangle around a vertex: the other corners a and b, and the opposite corner w across the edge ab (or -1); the
  // position of the vertex along ab and at right angles to ab, in units of ab; the length of ab; the lengths of the edges to a
  // and b; the position of w along ab and at right angles to ab, on the other side.
  const ends = new Int32Array(3 * F.length), shape = new Float64Array(7 * F.length);
  for (let h = 0; h < F.length; h++) {
    const f = h - h % 3, p = f + (h + 1) % 3, q = f + (h + 2) % 3;
    const base = lengths[h], toA = lengths[q], toB = lengths[p];
    const k = next[F[h]]++, t = twin[h];
    ends.set([F[p], F[q], t < 0 ? -1 : F[t]], 3 * k);
    shape.set([...apex(base, toA, toB), base, toA, toB], 7 * k);
    if (t < 0) continue;
    const g = t - t % 3, r = g + (t + 1) % 3, s = g + (t + 2) % 3;
    shape.set(F[r] === F[p] ? apex(base, lengths[s], lengths[r]) : apex(base, lengths[r], lengths[s]), 7 * k + 5);
  }
  return { n, first, ends, shape };
}

// Vertices in ascending order of the distance along edges; unreachable vertices are last.
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
    for (let k = first[v]; k < first[v + 1]; k++) {
      for (const end of [0, 1]) {
        const a = ends[3 * k + end], length = d[v] + shape[7 * k + 3 + end];
        if (!isDone[a] && length < d[a]) { d[a] = length; raise(a); }
      }
    }
  }
  for (let v = 0; v < n; v++) if (!isDone[v]) order[count++] = v;
  return order;
}

// Distance of v at (px, py) from the source, whose position (x, -y) follows from a = (0, 0) and b = (1, 0), corrected by the
// distance of the corner w at (wx, -wy) across the edge ab: through the edge between w and a or b, or with a bend at w. It is
// not corrected if the source lies in front of that edge. All lengths are in units of ab.
function acrossTwo(px, py, x, y, da, db, dw, wx, wy) {
  const ux = px - wx, uy = py + wy, isRight = ux * (y + py) < uy * (px - x);
  const sign = isRight ? 1 : -1, end = isRight ? 0 : 1, dp = isRight ? da : db, ex = wx - end, square = ex * ex + wy * wy;
  const direct = Math.hypot(px - x, py + y);
  if (!(sign * (y * ex - (x - end) * wy) > CLOSE * square)) return direct;
  const s = 0.5 * ((dp - dw) * (dp + dw) / square + 1);
  const h = sign * Math.sqrt(Math.max(dp * dp / square - s * s, 0));
  const sx = px - end - s * ex + h * wy, sy = py + s * wy + h * ex;
  if (sign * (ux * sy - uy * sx) > 0) return Math.hypot(ux, uy) + dw;
  return sign * ((px - end) * sy - py * sx) >= 0 ? Math.hypot(sx, sy) : direct;
}

// Distance from the sources; Infinity at unreachable vertices.
function sweepDistance(tables, sources) {
  const { n, first, ends, shape } = tables;
  const order = edgeOrder(tables, sources), rank = new Int32Array(n);
  for (let i = 0; i < n; i++) rank[order[i]] = i;
  const d = new Float64Array(n).fill(Infinity), isStale = new Uint8Array(n).fill(1);
  // The source of the distance of each vertex.
  const label = new Int32Array(n).fill(-1);
  for (const s of sources) [d[s], label[s]] = [0, s];
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
    let best = old, giver = label[v], across = Infinity, row = -1, nearest = -1, sourceX = 0, sourceY = 0;
    for (let k = first[v]; k < first[v + 1]; k++) {
      const a = ends[3 * k], b = ends[3 * k + 1], da = d[a], db = d[b], at = 7 * k, base = shape[at + 2];
      if (da + shape[at + 3] < best) [best, giver] = [da + shape[at + 3], label[a]];
      if (db + shape[at + 4] < best) [best, giver] = [db + shape[at + 4], label[b]];
      if ((da >= best && db >= best) || da === Infinity || db === Infinity) continue;
      const px = shape[at], py = shape[at + 1];
      let length = Infinity, x = 0, y = 0, source = label[a];
      if (label[a] === label[b]) {
        // The position of the source in units of the edge ab: x along ab, y on the other side.
        x = 0.5 * ((da - db) * (da + db) / (base * base) + 1);
        const ySquared = da * da / (base * base) - x * x;
        y = Math.sqrt(Math.max(ySquared, 0));
        const crossing = x * py + px * y;
        if (ySquared >= 0 && crossing >= 0 && crossing <= y + py) length = base * Math.hypot(px - x, py + y);
      } else {
        // Between different sources the front is straight; the source is that of the nearer end.
        const slope = (db - da) / base, rise = Math.sqrt(Math.max(1 - slope * slope, 0)), foot = px * rise - py * slope;
        if (foot >= 0 && foot <= rise) length = da + base * (slope * px + rise * py);
        if (foot >= 0.5 * rise) source = label[b];
      }
      if (length < across) [across, row, nearest, sourceX, sourceY] = [length, k, source, x, y];
    }
    if (across < best) {
      const [a, b, w] = ends.subarray(3 * row, 3 * row + 3), [px, py, base, , , wx, wy] = shape.subarray(7 * row, 7 * row + 7);
      if (w >= 0 && d[w] < across && label[a] === label[b] && label[w] === label[a]) {
        across = base * acrossTwo(px, py, sourceX, sourceY, d[a] / base, d[b] / base, d[w] / base, wx, wy);
      }
      if (across < best) [best, giver] = [across, nearest];
    }
    if (!(best < old)) continue;
    [d[v], label[v]] = [best, giver];
    if (best >= old * (1 - NEGLIGIBLE)) continue;
    // Farther neighbours depend on v, and nearer ones if the path can cross an edge that ends in v.
    lowest = n;
    for (let k = first[v]; k < first[v + 1]; k++) {
      const a = ends[3 * k], b = ends[3 * k + 1], at = 7 * k, along = shape[at] * shape[at + 2];
      if (best < d[a] || 2 * d[a] * along < shape[at + 3] ** 2) mark(a);
      if (best < d[b] || 2 * d[b] * (shape[at + 2] - along) < shape[at + 4] ** 2) mark(b);
    }
    // Vertices that were visited too early are visited again at once, before wrong values spread.
    if (lowest < i) {
      if (visits < GO_BACK * n) i = lowest;
      else again = Math.min(again, lowest);
    }
  }
  return d;
}
