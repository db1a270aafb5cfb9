// Drawing with WebGL 2: each panel shows the surface, or discs at the points of it, needles, and dots at the sources.

class Renderer {
  // `meta` has the tables of colours and the strengths of the lines and stripes.
  constructor(canvas, gl, V, F, meta) {
    Object.assign(this, { canvas, gl, nVertices: V.length / 3, nCorners: F.length });
    const inked = (text) => text.replaceAll("LINE_INK", meta.lineInk).replaceAll("STRIPE_INK", meta.stripeInk);
    this.surfaceProgram = this.program(SURFACE_VERTEX, inked(SURFACE_FRAGMENT));
    this.discProgram = this.program(DISC_VERTEX, inked(DISC_FRAGMENT));
    this.dotProgram = this.program(DOT_VERTEX, DOT_FRAGMENT);
    this.needleProgram = this.program(DOT_VERTEX, ARROW_FRAGMENT);
    this.shared = {
      position: [this.buffer(V), 3], normal: [this.buffer(vertexNormals(V, F)), 3], radius: [this.buffer(discRadii(V, F)), 1],
    };
    this.triangles = gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, F, gl.STATIC_DRAW);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    const table = Uint8Array.from([...meta.colours, ...meta.signedColours].flatMap((rgb) => [...rgb, 255]));
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, meta.colours.length, 2, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
    for (const [key, to] of [["MIN_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
      gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + key], gl[to]);
    gl.enable(gl.DEPTH_TEST);
  }

  // A program; its uniforms are properties.
  program(vertex, fragment) {
    const gl = this.gl, made = gl.createProgram();
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

  fill(buffer, data) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, this.gl.DYNAMIC_DRAW);
  }

  buffer(data) {
    const made = this.gl.createBuffer();
    this.fill(made, data);
    return made;
  }

  // Arrays for a program: its inputs by name, each a buffer and the numbers per vertex.
  arrays(owner, inputs) {
    const gl = this.gl, made = gl.createVertexArray();
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

  // What a panel is drawn from; `fillPanel` fills it.
  panelBuffers() {
    const [value, needles, dots] = [0, 1, 2].map(() => this.buffer(new Float32Array(0)));
    const made = { value, needles, dots, nNeedles: 0, nDots: 0 };
    made.onSurface = this.arrays(this.surfaceProgram, { ...this.shared, value: [value, 3] });
    this.gl.bindBuffer(this.gl.ELEMENT_ARRAY_BUFFER, this.triangles);
    made.onDiscs = this.arrays(this.discProgram, { ...this.shared, value: [value, 3] });
    made.onNeedles = this.arrays(this.needleProgram, { position: [needles, 3] });
    made.onDots = this.arrays(this.dotProgram, { position: [dots, 3] });
    this.gl.bindVertexArray(null);
    return made;
  }

  // Three numbers per vertex (two of the field, and 1 where it is finite), the corners of the needles, and the sources.
  fillPanel(panel, values, needles, dots) {
    this.fill(panel.value, values);
    this.fill(panel.needles, needles);
    this.fill(panel.dots, Float32Array.from(dots));
    [panel.nNeedles, panel.nDots] = [needles.length / 3, dots.length / 3];
  }

  // Draw panels side by side; `style` is a number as shaders.js has it.
  draw(panels, camera, style, asPoints) {
    const { gl, canvas } = this, ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const across = Math.floor(width / panels.length);
    panels.forEach((panel, i) => {
      gl.viewport(i * across, 0, across, height);
      this.drawField(panel, camera, style, asPoints, ratio);
      this.drawNeedles(panel, camera);
      this.drawDots(panel, camera, ratio);
    });
  }

  // Take a program and its arrays into use, and place what it draws.
  use(owner, arrays, camera) {
    const gl = this.gl, scale = 2 * camera.pixelsPerUnit();
    gl.useProgram(owner.made);
    gl.bindVertexArray(arrays);
    gl.uniformMatrix3fv(owner.turn, true, camera.turn.flat());
    gl.uniform2f(owner.zoom, scale / camera.panelWidth(), scale / this.canvas.clientHeight);
    gl.uniform2f(owner.pan, ...camera.pan);
  }

  drawField(panel, camera, style, asPoints, ratio) {
    const gl = this.gl, owner = asPoints ? this.discProgram : this.surfaceProgram;
    this.use(owner, asPoints ? panel.onDiscs : panel.onSurface, camera);
    for (const name of ["low", "high", "spacing", "row"]) gl.uniform1f(owner[name], panel[name]);
    gl.uniform1f(owner.lineWidth, 1.3 * ratio);
    gl.uniform1i(owner.style, style);
    gl.uniform1i(owner.isMap, panel.isMap);
    gl.uniform1f(owner.pixels, camera.pixelsPerUnit() * ratio);
    if (asPoints) gl.drawArrays(gl.POINTS, 0, this.nVertices);
    else gl.drawElements(gl.TRIANGLES, this.nCorners, gl.UNSIGNED_INT, 0);
  }

  drawNeedles(panel, camera) {
    this.use(this.needleProgram, panel.onNeedles, camera);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, panel.nNeedles);
  }

  // Dots behind the surface are drawn too, as shaders.js has it.
  drawDots(panel, camera, ratio) {
    const gl = this.gl;
    this.use(this.dotProgram, panel.onDots, camera);
    gl.uniform1f(this.dotProgram.size, (panel.nDots <= 20 ? 11 : 5) * ratio);
    gl.depthMask(false);
    for (const [isHidden, compare] of [[1, gl.GREATER], [0, gl.LEQUAL]]) {
      gl.depthFunc(compare);
      gl.uniform1i(this.dotProgram.isHidden, isHidden);
      gl.drawArrays(gl.POINTS, 0, panel.nDots);
    }
    gl.depthFunc(gl.LESS);
    gl.depthMask(true);
  }
}
