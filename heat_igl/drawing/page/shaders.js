// Programs for the graphics card: surfaces, discs for points, needles for directions, and dots for sources.
const SURFACE_VERTEX = `#version 300 es
  uniform mat3 turn; uniform vec2 zoom, pan;
  in vec3 position, normal, value;
  out vec3 place, smoothNormal, here;
  void main() {
    place = turn * position; smoothNormal = turn * normal; here = value;
    gl_Position = vec4((place.xy + pan) * zoom, -0.5 * place.z, 1.0);
  }`;
// The colour of values (x, y, 1), or of no value (0, 0, 0), and the light on it.
const INK = `
  uniform sampler2D colours; uniform float low, high, spacing, lineWidth, row; uniform int style; uniform bool isMap;
  // Integral of a wave that is 1 on every second unit.
  float wave(float x) { return floor(0.5 * x) + max(mod(x, 2.0) - 1.0, 0.0); }
  float stripe(float level, float perPixel) {
    float span = max(perPixel, 1e-4);
    return (wave(level + span / 2.0) - wave(level - span / 2.0)) / span;
  }
  vec3 inkOf(vec3 here, vec4 change, float placeChange) {
    vec2 level = here.xy / spacing, perPixel = vec2(length(change.xy), length(change.zw)) / spacing;
    float value = isMap ? length(here.xy) : here.x;
    vec3 ink = texture(colours, vec2((value - low) / (high - low), row)).rgb;
    if (here.z < 0.999) return vec3(0.72);
    if (isMap) {
      // Across a cut the map jumps, and what lies between is no value.
      if (length(perPixel) * spacing > 6.0 * placeChange && placeChange > 0.0) return mix(ink, vec3(0.72), 0.5);
      float u = stripe(level.x, perPixel.x), v = stripe(level.y, perPixel.y);
      return mix(ink, vec3(1.0), 1.3 * STRIPE_INK * (u + v - 2.0 * u * v));
    }
    if (style == 0 && perPixel.x > 0.0) {
      float nearest = round(level.x), width = min(lineWidth, 0.25 / perPixel.x);
      if (low < 0.0 && nearest == 0.0) width *= 2.5;
      float cover = clamp(width / 2.0 + 0.5 - abs(level.x - nearest) / perPixel.x, 0.0, 1.0) * min(1.0, width);
      if (low < 0.0 || nearest > 0.5) ink *= 1.0 - LINE_INK * cover;
    }
    if (style == 1) ink = mix(ink, vec3(1.0), STRIPE_INK * stripe(level.x, perPixel.x));
    return ink;
  }
  vec3 lit(vec3 ink, vec3 n) {
    return ink * (0.6 + 0.4 * pow(clamp(dot(n, vec3(-0.53, 0.73, 1.0)), 0.0, 1.15), 0.8));
  }`;
const SURFACE_FRAGMENT = `#version 300 es
  precision highp float;
  in vec3 place, smoothNormal, here;
  out vec4 colour;
  ${INK}
  void main() {
    vec4 change = vec4(dFdx(here.x), dFdy(here.x), dFdx(here.y), dFdy(here.y));
    vec3 flatNormal = normalize(cross(dFdx(place), dFdy(place))), n = normalize(smoothNormal);
    n = n.z < 0.0 ? -n : n;
    if (!(dot(n, flatNormal) > 0.82)) n = flatNormal;
    colour = vec4(lit(inkOf(here, change, length(vec2(length(dFdx(place)), length(dFdy(place))))), n), 1.0);
  }`;
const DISC_VERTEX = `#version 300 es
  uniform mat3 turn; uniform vec2 zoom, pan; uniform float pixels;
  in vec3 position, normal, value; in float radius;
  flat out vec3 here, facing; flat out float depth;
  void main() {
    vec3 place = turn * position;
    here = value; depth = 0.25 * radius;
    facing = length(normal) > 0.0 ? normalize(turn * normal) : vec3(0.0, 0.0, 1.0);
    facing = facing.z < 0.0 ? -facing : facing;
    gl_Position = vec4((place.xy + pan) * zoom, -0.5 * place.z, 1.0);
    gl_PointSize = max(2.0 * radius * pixels, 2.0);
  }`;
const DISC_FRAGMENT = `#version 300 es
  precision highp float;
  flat in vec3 here, facing; flat in float depth;
  out vec4 colour;
  ${INK}
  void main() {
    vec2 at = vec2(2.0, -2.0) * (gl_PointCoord - 0.5);
    float height = -dot(facing.xy, at) / max(facing.z, 0.15);
    if (dot(at, at) + height * height > 1.0) discard;
    colour = vec4(lit(inkOf(here, vec4(0.0), 0.0), facing), 1.0);
    gl_FragDepth = gl_FragCoord.z - depth * height;
  }`;
const ARROW_FRAGMENT = `#version 300 es
  precision highp float;
  out vec4 colour;
  void main() { colour = vec4(0.12, 0.12, 0.12, 1.0); }`;
// Dots and needles, a little in front of the surface.
const DOT_VERTEX = `#version 300 es
  uniform mat3 turn; uniform vec2 zoom, pan; uniform float size;
  in vec3 position;
  void main() {
    vec3 place = turn * position;
    gl_Position = vec4((place.xy + pan) * zoom, -0.5 * place.z - 0.008, 1.0);
    gl_PointSize = size;
  }`;
const DOT_FRAGMENT = `#version 300 es
  precision highp float;
  uniform bool isHidden;
  out vec4 colour;
  void main() {
    float r = 2.0 * length(gl_PointCoord - 0.5);
    if (r > 1.0 || (isHidden && r < 0.7)) discard;
    colour = !isHidden && r > 0.75 ? vec4(1.0) : vec4(0.91, 0.0, 0.043, 1.0);
  }`;
