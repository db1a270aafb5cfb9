// The camera: a parallel projection on one panel of the canvas, or on two side by side that show the same view.

class Camera {
  // `turn` is the rotation at first, `middle` and `extent` are the centre and the size of what is seen then.
  constructor(canvas, { turn, middle, extent }) {
    Object.assign(this, { canvas, initialTurn: turn, middle, extent, nPanels: 1 });
    this.reset();
  }

  reset() {
    this.set({ turn: this.initialTurn, pan: [-this.middle[0], -this.middle[1]], zoom: 1 });
  }

  set({ turn, pan, zoom }) {
    [this.turn, this.pan, this.zoom] = [turn.map((row) => row.slice()), pan.slice(), zoom];
  }

  state() {
    return { turn: this.turn, pan: this.pan, zoom: this.zoom };
  }

  panelWidth() {
    return Math.floor(this.canvas.clientWidth / this.nPanels);
  }

  // Pixels of the page per unit.
  pixelsPerUnit() {
    const [x, y] = this.extent;
    return 0.92 * this.zoom * Math.min(this.panelWidth() / x, this.canvas.clientHeight / y);
  }

  // A place on the canvas, as seen from the left end of the panel.
  inPanel(x) {
    return x >= this.panelWidth() && this.nPanels > 1 ? x - this.panelWidth() : x;
  }

  rotate(dx, dy) {
    const angle = Math.hypot(dx, dy);
    if (!angle) return;
    // The axis lies in the screen, at right angles to the motion: the front of the surface follows the pointer.
    const [x, y] = [dy / angle, dx / angle], c = Math.cos(angle), s = Math.sin(angle), t = 1 - c, { turn, pan } = this;
    const R = [[t * x * x + c, t * x * y, s * y], [t * x * y, t * y * y + c, -s * x], [-s * y, s * x, c]];
    this.turn = R.map((row) => [0, 1, 2].map((j) => row[0] * turn[0][j] + row[1] * turn[1][j] + row[2] * turn[2][j]));
    // What is in the middle of the panel stays there.
    this.pan = [R[0][0] * pan[0] + R[0][1] * pan[1], R[1][0] * pan[0] + R[1][1] * pan[1]];
  }

  // Zoom about a place on the canvas.
  zoomAt(factor, x, y) {
    const before = this.pixelsPerUnit();
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.2), 2000);
    const change = 1 / this.pixelsPerUnit() - 1 / before;
    this.pan = [
      this.pan[0] + (this.inPanel(x) - this.panelWidth() / 2) * change, this.pan[1] - (y - this.canvas.clientHeight / 2) * change,
    ];
  }

  move(dx, dy) {
    this.pan = [this.pan[0] + dx / this.pixelsPerUnit(), this.pan[1] - dy / this.pixelsPerUnit()];
  }

  // Place on the canvas, in pixels of the page, and depth of the k-th of points V; in the left panel of two.
  project(V, k) {
    const at = this.turn.map((row) => row[0] * V[3 * k] + row[1] * V[3 * k + 1] + row[2] * V[3 * k + 2]), s = this.pixelsPerUnit();
    return [this.panelWidth() / 2 + s * (at[0] + this.pan[0]), this.canvas.clientHeight / 2 - s * (at[1] + this.pan[1]), at[2]];
  }
}
