// Distance by unfolding two triangles at a time, in the order of Dijkstra's algorithm: what heat_igl/unfolding/sweeping.py does in
// the order of the heat. It needs triangles by their corners and edge lengths; two that alone share both ends of an edge
// are taken to be glued there.
"use strict";

// Changes by less than this are not passed on: lengths come in single precision.
const NEGLIGIBLE = 1e-7;
// Part of an edge by which a source lies beyond it, so that circles about its ends cross at an angle.
const CLOSE = 1e-3;
// Visits per vertex up to which the sweep goes back at once, and after which it gives up.
const GO_BACK = 10, GIVE_UP = 50;

// Where the third corner of a triangle lies over its side ab, along it and in height, in units of the side.
function apex(base, toA, toB) {
  // Heron's formula as a product of differences keeps the digits of slivers.
  const half = 0.5 * (base + toA + toB);
  const product = Math.max(half * (half - base) * (half - toA) * (half - toB), 0);
  return [0.5 * ((toA - toB) * (toA + toB) / (base * base) + 1), 2 * Math.sqrt(product) / (base * base)];
}

// For each corner, the corner opposite the same edge in the one other triangle there; -1 if there is none, or more.
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

// n vertices; F[3 f + c] the corners of face f, lengths[3 f + c] the edge opposite corner c.
function sweepTables(n, F, lengths) {
  const first = new Int32Array(n + 1);
  for (let h = 0; h < F.length; h++) first[F[h] + 1]++;
  for (let v = 0; v < n; v++) first[v + 1] += first[v];
  const next = first.slice(0, n), twin = glued(n, F);
  // One row per triangle around a vertex: the other corners a and b, and the one beyond the edge ab (or -1); the vertex
  // over that edge, along it and to its side in units of the edge; the edge; the ways to a and to b; the corner beyond
  // it, along it and on its other side.
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

// Distance from v at (px, py) of the source at (x, -y) as a = (0, 0) and b = (1, 0) see it, but by what the corner w beyond
// the edge ab at (wx, -wy) knows of it: through the edge between w and a or b, or bent at w. As it is, if the source lies
// in front of that edge. All in units of ab.
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

// Distance from the sources, Infinity where they do not reach.
function sweepDistance(tables, sources) {
  const { n, first, ends, shape } = tables;
  const order = edgeOrder(tables, sources), rank = new Int32Array(n);
  for (let i = 0; i < n; i++) rank[order[i]] = i;
  const d = new Float64Array(n).fill(Infinity), isStale = new Uint8Array(n).fill(1);
  // The source that the distance of a vertex is measured from.
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
        // The source in units of the edge ab: x along it, y behind it.
        x = 0.5 * ((da - db) * (da + db) / (base * base) + 1);
        const ySquared = da * da / (base * base) - x * x;
        y = Math.sqrt(Math.max(ySquared, 0));
        const crossing = x * py + px * y;
        if (ySquared >= 0 && crossing >= 0 && crossing <= y + py) length = base * Math.hypot(px - x, py + y);
      } else {
        // Between different sources a straight front comes in, from that of the end it passes nearer to.
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
    // Farther neighbours depend on v, and nearer ones whose way can cross an edge that ends in v.
    lowest = n;
    for (let k = first[v]; k < first[v + 1]; k++) {
      const a = ends[3 * k], b = ends[3 * k + 1], at = 7 * k, along = shape[at] * shape[at + 2];
      if (best < d[a] || 2 * d[a] * along < shape[at + 3] ** 2) mark(a);
      if (best < d[b] || 2 * d[b] * (shape[at + 2] - along) < shape[at + 4] ** 2) mark(b);
    }
    // Back to those that came too early, at once, before what is wrong there spreads.
    if (lowest < i) {
      if (visits < GO_BACK * n) i = lowest;
      else again = Math.min(again, lowest);
    }
  }
  return d;
}
