// The arrays of the page, from the text that `heat_igl.drawing.html_view` packs them in.
"use strict";

// Arrays by name; `layout` has the name, the kind ("float" or "int", of 4 bytes) and the size of each.
async function unpacked(base64, layout) {
  const packed = Uint8Array.from(atob(base64.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer()), arrays = {};
  let start = 0;
  for (const [name, kind, size] of layout) {
    // Bytes are grouped by significance, which compresses better.
    const whole = new Uint8Array(4 * size);
    for (let i = 0; i < size; i++) for (let b = 0; b < 4; b++) whole[4 * i + b] = bytes[start + b * size + i];
    arrays[name] = new (kind === "float" ? Float32Array : Int32Array)(whole.buffer);
    start += 4 * size;
  }
  return arrays;
}
