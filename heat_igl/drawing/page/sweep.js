// Distance and departures by unfolding two triangles at a time: the algorithm of heat_igl/kernels/sweep/sweeping.py, in the order
// of its own front. The input is the corners and the edge lengths of triangles. Two triangles are glued at an edge if no other
// triangle has both ends of the edge.
// Smaller changes are not propagated, since lengths have single precision.
const NEGLIGIBLE = 1e-7;
// Smallest distance of a source from an edge, in edge lengths, such that circles about the ends intersect at an angle.
const CLOSE = 1e-3;
// Visits per vertex after which the sweep stops.
const GIVE_UP = 50;
// Ends of an edge whose departures differ by more than this lie on both sides of a cut: there is nothing between them.
const OPPOSITE = 0.5 * Math.PI;

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
  const first = new Int32Array(n + 1), twin = glued(n, F);
  for (let h = 0; h < F.length; h++) first[F[h] + 1]++;
  for (let v = 0; v < n; v++) first[v + 1] += first[v];
  const next = first.slice(0, n), rowOf = Int32Array.from(F, (v) => next[v]++);
  // One row per triangle around a vertex: the other corners a and b, and the opposite corner w across the edge ab (or -1); the
  // rows of a and b for the same triangle; the position of the vertex along ab and at right angles to ab, in units of ab; the
  // length of ab; the lengths of the edges to a and b; the position of w along ab and at right angles to ab, on the other side.
  const ends = new Int32Array(3 * F.length), beside = new Int32Array(2 * F.length), shape = new Float64Array(7 * F.length);
  for (let h = 0; h < F.length; h++) {
    const f = h - h % 3, p = f + (h + 1) % 3, q = f + (h + 2) % 3;
    const base = lengths[h], toA = lengths[q], toB = lengths[p], k = rowOf[h], t = twin[h];
    ends.set([F[p], F[q], t < 0 ? -1 : F[t]], 3 * k);
    beside.set([rowOf[p], rowOf[q]], 2 * k);
    shape.set([...apex(base, toA, toB), base, toA, toB], 7 * k);
    if (t < 0) continue;
    const g = t - t % 3, r = g + (t + 1) % 3, s = g + (t + 2) % 3;
    shape.set(F[r] === F[p] ? apex(base, lengths[s], lengths[r]) : apex(base, lengths[r], lengths[s]), 7 * k + 5);
  }
  return { n, first, ends, beside, shape };
}

// Vertices by their distance d, the least first.
class Queue {
  constructor(d) {
    Object.assign(this, { d, heap: [], place: new Int32Array(d.length).fill(-1) });
  }

  put(i, v) {
    this.heap[i] = v;
    this.place[v] = i;
  }

  // Insert v, or move it after d[v] has fallen.
  raise(v) {
    const { d, heap, place } = this;
    let i = place[v] < 0 ? heap.length : place[v];
    while (i > 0 && d[heap[(i - 1) >> 1]] > d[v]) { this.put(i, heap[(i - 1) >> 1]); i = (i - 1) >> 1; }
    this.put(i, v);
  }

  pop() {
    const { d, heap, place } = this, top = heap[0], v = heap.pop();
    let i = 0;
    for (let child = 1; child < heap.length; child = 2 * i + 1) {
      if (child + 1 < heap.length && d[heap[child + 1]] < d[heap[child]]) child++;
      if (d[heap[child]] >= d[v]) break;
      this.put(i, heap[child]);
      i = child;
    }
    if (heap.length) this.put(i, v);
    place[top] = -1;
    return top;
  }
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

// Angle from the direction (ax, ay) to (bx, by), between -pi and pi.
const turnFrom = (ax, ay, bx, by) => Math.atan2(ax * by - ay * bx, ax * bx + ay * by);
const wrapped = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

// Directions of the edges around s, scaled to a full turn, or to half of one on the boundary: a Map from neighbour to angle.
function fanAngles(tables, s) {
  const { first, ends, shape } = tables, rows = new Map(), isSecond = new Set();
  for (let k = first[s]; k < first[s + 1]; k++) { rows.set(ends[3 * k], k); isSecond.add(ends[3 * k + 1]); }
  const starts = [...rows.keys()], begin = starts.find((a) => !isSecond.has(a));
  const angles = new Map(), isClosed = begin === undefined;
  let total = 0;
  for (let a = isClosed ? starts[0] : begin; a !== undefined && !angles.has(a);) {
    angles.set(a, total);
    const k = rows.get(a);
    if (k === undefined) break;
    const [px, py] = [shape[7 * k], shape[7 * k + 1]];
    total += Math.abs(turnFrom(-px, -py, 1 - px, -py));
    a = ends[3 * k + 1];
  }
  const scale = (isClosed ? 2 : 1) * Math.PI / total;
  for (const [a, angle] of angles) angles.set(a, angle * scale);
  return angles;
}

// The angle that is `share` of the way from one angle to another, or the nearer of the two if they lie on both sides of a cut.
function between(a, b, share) {
  const turn = wrapped(b - a);
  if (Math.abs(turn) < OPPOSITE) return a + turn * Math.min(Math.max(share, 0), 1);
  return share < 0.5 ? a : b;
}

// The distance d of each vertex from the sources, Infinity if it is unreachable, and the angle at which the shortest path leaves
// its source, NaN if there is none. As in Melvaer and Reimers, "Geodesic polar coordinates on polygonal meshes" (2012), the angle
// of a vertex across an edge lies between those of both ends, as the angles at the unfolded source do.
function swept(tables, sources) {
  const { n, first, ends, beside, shape } = tables;
  const d = new Float64Array(n).fill(Infinity), label = new Int32Array(n).fill(-1), angle = new Float64Array(n).fill(NaN);
  const fans = new Map(sources.map((s) => [s, fanAngles(tables, s)])), queue = new Queue(d);
  const lower = (v, length, source, departure) => {
    const matters = length < d[v] * (1 - NEGLIGIBLE);
    d[v] = length;
    label[v] = source;
    angle[v] = departure;
    if (matters || queue.place[v] >= 0) queue.raise(v);
  };
  // A path along the edge from v departs as that of v.
  const alongEdge = (v, w) => (fans.has(v) ? fans.get(v).get(w) : angle[v]);
  const update = (v, k) => {
    const a = ends[3 * k], b = ends[3 * k + 1], w = ends[3 * k + 2], da = d[a], db = d[b], at = 7 * k;
    if (da + shape[at + 3] < d[v]) lower(v, da + shape[at + 3], label[a], alongEdge(a, v));
    if (db + shape[at + 4] < d[v]) lower(v, db + shape[at + 4], label[b], alongEdge(b, v));
    // From a source at an end, the straight line is the edge.
    if ((da >= d[v] && db >= d[v]) || da === Infinity || db === Infinity || !da || !db) return;
    const px = shape[at], py = shape[at + 1], base = shape[at + 2];
    if (label[a] !== label[b]) {
      // Between different sources the front is straight; the source is that of the nearer end.
      const slope = (db - da) / base, rise = Math.sqrt(Math.max(1 - slope * slope, 0)), foot = px * rise - py * slope;
      const length = da + base * (slope * px + rise * py), end = foot >= 0.5 * rise ? b : a;
      if (foot >= 0 && foot <= rise && length < d[v]) lower(v, length, label[end], alongEdge(end, v));
      return;
    }
    // The position of the source in units of the edge ab: x along ab, y on the other side.
    const x = 0.5 * ((da - db) * (da + db) / (base * base) + 1), ySquared = da * da / (base * base) - x * x;
    const y = Math.sqrt(Math.max(ySquared, 0)), crossing = x * py + px * y;
    let length = base * Math.hypot(px - x, py + y);
    if (!(ySquared >= 0 && crossing >= 0 && crossing <= y + py && length < d[v])) return;
    if (w >= 0 && d[w] < length && label[w] === label[a]) {
      length = base * acrossTwo(px, py, x, y, da / base, db / base, d[w] / base, shape[at + 5], shape[at + 6]);
    }
    if (!(length < d[v])) return;
    const share = turnFrom(-x, y, px - x, py + y) / turnFrom(-x, y, 1 - x, y);
    lower(v, length, label[a], between(angle[a], angle[b], share));
  };
  for (const s of sources) lower(s, 0, s, NaN);
  for (let visits = 0; queue.heap.length && visits < GIVE_UP * n; visits++) {
    const v = queue.pop();
    for (let k = first[v]; k < first[v + 1]; k++) {
      update(ends[3 * k], beside[2 * k]);
      update(ends[3 * k + 1], beside[2 * k + 1]);
    }
  }
  return { d, angle };
}

// The logarithmic map: vectors (u, v) one after the other, as long as the distance, in the direction of the departure; 0 at
// sources, and NaN at vertices without a direction.
function logMap({ d, angle }) {
  const map = new Float32Array(2 * d.length);
  for (let v = 0; v < d.length; v++) if (d[v] > 0) map.set([d[v] * Math.cos(angle[v]), d[v] * Math.sin(angle[v])], 2 * v);
  return map;
}
