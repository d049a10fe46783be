// What is on the screen as a block of land in three dimensions: the tiles' heights, with their pictures laid over them.
//
// The block is what the map shows, so its tiles are asked for, kept and drawn in full as they are for the map. Lengths are
// in halves of the longer side of the block; x goes east, y up and z south, around the middle of the view.
import { $, notify } from "./page.js";

const FIELD = (30 * Math.PI) / 180; // of view, from top to bottom
const TILE = 256;
const UPLOAD_MS = 4; // of one frame for copying pictures and grids to the GPU, or a fifth of one that is slow anyway
const KEPT = 120; // textures
const WALL_PX = 4; // of the map for one piece of a side of the block
const RAISED = 0.1; // of half the window, since the controls are at the bottom
const NEAR = 0.75; // of the distance at which the block fills the screen: nearer, and the map zooms in
const FAR = 2.6;
const RISES_MS = 12000; // after which the land rises with the heights that are there
const SLOW_MS = 45; // a frame that takes as long has too many vertices for the machine

const LAND = {
  vertex: `#version 300 es
precision highp float;
uniform highp sampler2D heights;
uniform mat4 camera;
uniform vec2 corner, extent;
uniform vec4 grid;
uniform vec3 part;
uniform float unit, lift, sea;
uniform int side;
out vec2 uv;
float height(vec2 at) {
  ivec2 last = textureSize(heights, 0) - 1;
  at = clamp(at, vec2(0), vec2(last));
  ivec2 low = ivec2(at), high = min(low + 1, last);
  vec2 share = at - vec2(low);
  float north = mix(texelFetch(heights, low, 0).r, texelFetch(heights, ivec2(high.x, low.y), 0).r, share.x);
  float south = mix(texelFetch(heights, ivec2(low.x, high.y), 0).r, texelFetch(heights, high, 0).r, share.x);
  return mix(north, south, share.y);
}
void main() {
  vec2 pixel = 0.5 + vec2(gl_VertexID % side, gl_VertexID / side) * 256.0 / float(side - 1);
  // What lies past the block's edge is folded onto it, so that the edge is straight and smooth.
  vec2 ground = clamp(corner + pixel * unit, -extent, extent);
  pixel = (ground - corner) / unit;
  uv = part.xy + part.z * clamp(pixel / 256.0, 0.0, 1.0);
  float up = max(height((grid.xy * 256.0 + pixel * grid.z - 0.5) / grid.w), sea) * lift;
  gl_Position = camera * vec4(ground.x, up, ground.y, 1);
}`,
  fragment: `#version 300 es
precision highp float;
uniform sampler2D picture;
in vec2 uv;
out vec4 colour;
void main() {
  colour = vec4(texture(picture, uv).rgb, 1);
}`,
};

const SIDES = {
  vertex: `#version 300 es
precision highp float;
uniform mat4 camera;
uniform float base, top;
layout(location = 0) in vec4 place;
out vec2 what;
void main() {
  what = vec2(place.w, (place.y - base) / max(top - base, 1e-6));
  gl_Position = camera * vec4(place.xyz, 1);
}`,
  // Rock that is lighter towards the ground it stands on; the sides that face the light are lighter; water is blue.
  fragment: `#version 300 es
precision highp float;
in vec2 what;
out vec4 colour;
void main() {
  float side = fract(what.x), light = 0.84 + 0.4 * side;
  vec3 rock = mix(vec3(0.80, 0.77, 0.71), vec3(0.60, 0.55, 0.48), clamp(what.y, 0.0, 1.0));
  vec3 water = vec3(0.52, 0.66, 0.75);
  colour = vec4((what.x < 1.0 ? rock : water) * light, 1);
}`,
};

const SHADOW = {
  vertex: `#version 300 es
precision highp float;
uniform mat4 camera;
uniform vec2 extent;
uniform float base;
out vec2 ground;
void main() {
  ground = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * (extent + 0.5);
  gl_Position = camera * vec4(ground.x, base, ground.y, 1);
}`,
  fragment: `#version 300 es
precision highp float;
uniform vec2 extent;
in vec2 ground;
out vec4 colour;
void main() {
  float far = length(max(abs(ground) - extent, 0.0));
  colour = vec4(0.08, 0.09, 0.1, 0.34 * exp(-far * 11.0) * smoothstep(0.5, 0.3, far));
}`,
};

// ---------- matrices, column by column

const times = (a, b) => {
  const product = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
};

const perspective = (aspect, near, far) => {
  const f = 1 / Math.tan(FIELD / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, -RAISED, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
};

// From a distance onto a place at a height, `tilt` above the horizon, `yaw` east of south.
function looking(distance, yaw, tilt, up) {
  const [sy, cy, st, ct] = [Math.sin(yaw), Math.cos(yaw), Math.sin(tilt), Math.cos(tilt)];
  const [right, above, back] = [[cy, 0, -sy], [-sy * st, ct, -cy * st], [sy * ct, st, cy * ct]];
  const eye = [back[0] * distance, up + back[1] * distance, back[2] * distance];
  const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
  return [right[0], above[0], back[0], 0, right[1], above[1], back[1], 0, right[2], above[2], back[2], 0, dot(right), dot(above), dot(back), 1];
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

export function scene() {
  const canvas = $("scene");
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  const HOME = { yaw: -0.42, tilt: 0.78 };
  const eye = { yaw: 0, tilt: Math.PI / 2, far: 1 };
  let goal = null; // where the eye moves to
  let middle = null; // metres that the eye looks at, which follows the land
  let floor = null; // and those of the lowest land
  let risen = 0; // how much of their height the land has: it rises when all of it is known
  let rises = false;
  let since = 0; // when the block was shown
  let world = null;
  let gl = null;
  let programs = null;
  let textures = new Map(); // picture or grid -> { texture, used }
  let frame = 0;
  let uploading = { until: 0, waits: false };
  let slow = 0; // frames one after another
  let side = 129; // vertices of a tile's side
  let lastNow = 0;
  const isOpen = () => !canvas.hidden;

  // ---------- WebGL

  function compiled({ vertex, fragment }) {
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    const at = {};
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
    for (let index = 0; index < count; index++) {
      const { name } = gl.getActiveUniform(program, index);
      at[name] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  function prepare() {
    gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: false });
    if (!gl) return false;
    programs = { land: compiled(LAND), sides: compiled(SIDES), shadow: compiled(SHADOW) };
    programs.empty = gl.createVertexArray();
    programs.grid = gl.createVertexArray();
    programs.indices = gl.createBuffer();
    fillGrid();
    programs.walls = gl.createVertexArray();
    programs.wallBuffer = gl.createBuffer();
    gl.bindVertexArray(programs.walls);
    gl.bindBuffer(gl.ARRAY_BUFFER, programs.wallBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
    programs.anisotropic = gl.getExtension("EXT_texture_filter_anisotropic");
    programs.level = gridTexture(new Float32Array(1), 1);
    programs.bare = pictureTexture({ picture: new ImageData(new Uint8ClampedArray([220, 223, 217, 255]), 1, 1) });
    return true;
  }

  function fillGrid() {
    const indices = new Uint32Array(6 * (side - 1) ** 2);
    let next = 0;
    for (let j = 0; j < side - 1; j++) {
      for (let i = 0; i < side - 1; i++) {
        const a = j * side + i;
        indices.set([a, a + side, a + 1, a + 1, a + side, a + side + 1], next);
        next += 6;
      }
    }
    gl.bindVertexArray(programs.grid);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, programs.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  // Fewer vertices where frames are slow one after another, as without a GPU.
  function spare(ms) {
    slow = ms > SLOW_MS && ms < 1000 ? slow + 1 : 0;
    if (slow < 5 || side <= 33) return;
    [side, slow] = [(side + 1) / 2, 0];
    fillGrid();
  }

  function gridTexture(values, width) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, width, width, 0, gl.RED, gl.FLOAT, values);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    return texture;
  }

  function pictureTexture({ picture }) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    const { anisotropic } = programs;
    if (anisotropic) gl.texParameterf(gl.TEXTURE_2D, anisotropic.TEXTURE_MAX_ANISOTROPY_EXT, 8);
    return texture;
  }

  // The texture of a picture or grid; null where it must wait for another frame.
  function textureOf(key, make) {
    const known = textures.get(key);
    if (known) {
      known.used = frame;
      return known.texture;
    }
    if (performance.now() > uploading.until) {
      uploading.waits = true;
      return null;
    }
    const texture = make();
    textures.set(key, { texture, used: frame });
    return texture;
  }

  function forget() {
    if (textures.size <= KEPT) return;
    for (const [key, { texture, used }] of textures) {
      if (used >= frame - 2) continue;
      gl.deleteTexture(texture);
      textures.delete(key);
    }
  }

  // ---------- the land

  const ranges = new WeakMap(); // of the heights of a grid, in metres
  function rangeOf(values) {
    if (!ranges.has(values)) {
      let [low, high] = [Infinity, -Infinity];
      for (const value of values) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
      ranges.set(values, [low, high].map((value) => value * world.heights.step_m));
    }
    return ranges.get(values);
  }

  // The block: its tiles, the place of its middle in pixels of their zoom, half its sides in units.
  function blockNow() {
    const patches = terrane.patches();
    const look = terrane.looking();
    const { ground } = world;
    const pixel_m = ground.finest_m * 2 ** (ground.max_zoom - patches[0].z);
    const centre = [(look.at_m[0] - ground.corner_m[0]) / pixel_m, (ground.corner_m[1] - look.at_m[1]) / pixel_m];
    const halves = [innerWidth, innerHeight].map((px) => (px / 2) * (look.pixel_m / pixel_m));
    const unit = 1 / Math.max(...halves);
    const extent = halves.map((half) => (half - 1) * unit);
    const byPlace = new Map(patches.map((patch) => [`${patch.x},${patch.y}`, patch]));
    return { patches, byPlace, pixel_m, centre, unit, extent, sea: world.sea_level_m ?? -1e5 };
  }

  // Height in metres at a place of the block in units; null where it is not known.
  function heightAt(block, x, z) {
    const [px, py] = [block.centre[0] + x / block.unit, block.centre[1] + z / block.unit];
    const [column, row] = [px, py].map((at) => Math.floor((at - 0.5) / TILE));
    const patch = block.byPlace.get(`${column},${row}`);
    if (!patch?.grid) return null;
    const { values, u, v, share } = patch.grid;
    const { spacing_px, step_m } = world.heights;
    const cells = TILE / spacing_px;
    const along = (at, from) => clamp((from * TILE + at * share - 0.5) / spacing_px, 0, cells);
    const [a, b] = [along(px - column * TILE, u), along(py - row * TILE, v)];
    const [i, j] = [a, b].map((at) => Math.min(Math.floor(at), cells - 1));
    const at = (di, dj) => values[(j + dj) * (cells + 1) + i + di];
    const mixed = (dj) => at(0, dj) * (1 - a + i) + at(1, dj) * (a - i);
    return (mixed(0) * (1 - b + j) + mixed(1) * (b - j)) * step_m;
  }

  // The sides of the block as triangles: x, up, z, and what they are: a share of light, and 1 more for water.
  function walls(block, lift, base) {
    const [a, b] = block.extent;
    const corners = [[-a, -b], [a, -b], [a, b], [-a, b]];
    const light = [0.45, 0.2, 0.5, 0.3];
    const out = [];
    const piece = (p, q, low, high, what) => {
      out.push(p[0], low[0], p[1], what, p[0], high[0], p[1], what, q[0], low[1], q[1], what);
      out.push(q[0], low[1], q[1], what, p[0], high[0], p[1], what, q[0], high[1], q[1], what);
    };
    corners.forEach((from, index) => {
      const to = corners[(index + 1) % 4];
      let before = null;
      const pieces = Math.ceil(Math.hypot(to[0] - from[0], to[1] - from[1]) / block.unit / WALL_PX);
      for (let step = 0; step <= pieces; step++) {
        const share = step / pieces;
        const at = [from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share];
        const height = heightAt(block, ...at) ?? middle ?? 0;
        const now = { at, bed: Math.max(height * lift, base), top: Math.max(height, block.sea) * lift };
        if (before) {
          piece(before.at, at, [base, base], [before.bed, now.bed], light[index]);
          if (before.top > before.bed || now.top > now.bed) piece(before.at, at, [before.bed, now.bed], [before.top, now.top], 1 + light[index]);
        }
        before = now;
      }
    });
    return new Float32Array(out);
  }

  // ---------- a frame

  function paint(now) {
    const before = lastNow;
    const ms = clamp(now - lastNow, 1, 50);
    lastNow = now;
    frame += 1;
    uploading = { until: performance.now() + Math.max(UPLOAD_MS, Math.min(now - before, 150) / 5), waits: false };
    spare(now - before);
    const block = blockNow();
    let [low, high] = [Infinity, -Infinity];
    for (const { grid } of block.patches) {
      if (!grid) continue;
      const [least, most] = rangeOf(grid.values);
      [low, high] = [Math.min(low, least), Math.max(high, most)];
    }
    const known = low <= high;
    rises ||= block.patches.every(({ grid }) => grid) || (known && now - since > RISES_MS);
    let moves = approach(ms);
    if (rises && risen < 1) {
      risen = calm.matches ? 1 : Math.min(1, 1 - (1 - risen) * Math.exp(-ms / 260) + 0.002);
      moves = true;
    }
    if (known) {
      low = Math.max(low, block.sea - 0.12 * block.pixel_m / block.unit);
      high = Math.max(high, block.sea);
      const follow = (value, target) => {
        if (value === null || calm.matches || Math.abs(value - target) < 1) return target;
        moves = true;
        return target + (value - target) * Math.exp(-ms / 120);
      };
      [middle, floor] = [follow(middle, (Math.max(low, block.sea) + high) / 2), follow(floor, low)];
    }
    draw(block);
    forget();
    // For tests: how much of the land is there.
    canvas.dataset.tiles = block.patches.length;
    canvas.dataset.risen = risen;
    canvas.dataset.lacks = block.patches.filter(({ picture, grid }) => !picture || !grid).length;
    return !moves && !uploading.waits;
  }

  // Moves the eye towards its goal; returns whether it goes on.
  function approach(ms) {
    if (!goal) return false;
    const rest = calm.matches ? 0 : Math.exp(-ms / 150);
    let far = 0;
    for (const key of ["yaw", "tilt", "far"]) {
      eye[key] = goal[key] + (eye[key] - goal[key]) * rest;
      far = Math.max(far, Math.abs(eye[key] - goal[key]));
    }
    if (far < 5e-4) goal = null;
    return goal !== null;
  }

  function draw(block) {
    const dense = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [Math.round(innerWidth * dense), Math.round(innerHeight * dense)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);

    // Seen from above, the land is as high as it is for the map's own scale, times the exaggeration.
    const lift = (block.unit / block.pixel_m) * Number($("exaggeration").value) * risen * clamp((Math.PI / 2 - eye.tilt) * 8, 0, 1) + 1e-9;
    const base = (floor ?? 0) * lift - 0.05;
    const top = (middle ?? 0) * lift;
    const camera = cameraOf(eye, block.extent, top);

    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    const { shadow, sides, land } = programs;
    gl.useProgram(shadow.program);
    gl.uniformMatrix4fv(shadow.at.camera, false, camera);
    gl.uniform2fv(shadow.at.extent, block.extent);
    gl.uniform1f(shadow.at.base, base);
    gl.bindVertexArray(programs.empty);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
    gl.disable(gl.BLEND);

    gl.useProgram(sides.program);
    gl.uniformMatrix4fv(sides.at.camera, false, camera);
    gl.uniform1f(sides.at.base, base);
    gl.uniform1f(sides.at.top, 2 * top - base);
    gl.bindVertexArray(programs.walls);
    gl.bindBuffer(gl.ARRAY_BUFFER, programs.wallBuffer);
    gl.enable(gl.CULL_FACE);
    const vertices = walls(block, lift, base);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.TRIANGLES, 0, vertices.length / 4);
    gl.disable(gl.CULL_FACE);

    gl.useProgram(land.program);
    gl.bindVertexArray(programs.grid);
    gl.uniformMatrix4fv(land.at.camera, false, camera);
    gl.uniform2fv(land.at.extent, block.extent);
    gl.uniform1f(land.at.unit, block.unit);
    gl.uniform1f(land.at.lift, lift);
    gl.uniform1f(land.at.sea, block.sea);
    gl.uniform1i(land.at.side, side);
    gl.uniform1i(land.at.heights, 0);
    gl.uniform1i(land.at.picture, 1);
    for (const patch of block.patches) drawPatch(block, patch, land);
    gl.bindVertexArray(null);
  }

  function cameraOf({ yaw, tilt, far }, extent, up) {
    const distance = (far * extent[1]) / Math.tan(FIELD / 2) + 1e-3;
    return times(perspective(innerWidth / innerHeight, distance * 0.02, distance * 2 + 6), looking(distance, yaw, tilt, up));
  }

  // How far away all of the block is on the screen, with a margin, above the controls.
  function fitting({ yaw, tilt }) {
    const side = Math.max(innerWidth, innerHeight);
    const [a, b] = [innerWidth / side, innerHeight / side];
    const inside = (camera) =>
      [[-a, -b], [a, -b], [a, b], [-a, b]].every(([x, z]) => {
        const [px, py, w] = [0, 1, 3].map((row) => camera[row] * x + camera[8 + row] * z + camera[12 + row]);
        return Math.abs(px / w) < 0.97 && py / w < 0.85 && py / w > -0.7;
      });
    let far = 0.8;
    while (far < FAR && !inside(cameraOf({ yaw, tilt, far }, [a, b], 0))) far += 0.02;
    return { yaw, tilt, far };
  }

  function drawPatch(block, { x, y, picture, grid }, land) {
    // Bare and level ground until pictures and heights are there: a hole would look like one in the land.
    const laid = (picture && textureOf(picture.found, () => pictureTexture(picture.found))) || programs.bare;
    const { spacing_px, step_m } = world.heights;
    const width = TILE / spacing_px + 1;
    const raised = grid && textureOf(grid.values, () => gridTexture(Float32Array.from(grid.values, (value) => value * step_m), width));
    if (!raised) {
      gl.bindTexture(gl.TEXTURE_2D, programs.level);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 1, 1, gl.RED, gl.FLOAT, new Float32Array([middle ?? 0]));
    }
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, laid);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, raised || programs.level);
    const { u, v, share } = raised ? grid : { u: 0, v: 0, share: 1 };
    gl.uniform4f(land.at.grid, u, v, share, spacing_px);
    const { part } = picture ?? { part: { u: 0, v: 0, share: 1 } };
    gl.uniform3f(land.at.part, part.u, part.v, part.share);
    gl.uniform2f(land.at.corner, (x * TILE - block.centre[0]) * block.unit, (y * TILE - block.centre[1]) * block.unit);
    gl.drawElements(gl.TRIANGLES, 6 * (side - 1) ** 2, gl.UNSIGNED_INT, 0);
  }

  // ---------- the hand

  function turn(yaw, tilt, soft = false) {
    const from = goal ?? eye;
    const to = { yaw: from.yaw + yaw, tilt: clamp(from.tilt + tilt, 0.14, 1.55), far: from.far };
    if (soft) goal = to;
    else [goal] = [null, Object.assign(eye, to)];
    terrane.invalidate();
  }

  // Nearer or farther by a factor; where that is too near or too far for the block, the map zooms by a level.
  function approachBy(factor, soft = false) {
    const from = goal ?? eye;
    let far = from.far * factor;
    const level = (share) => {
      const look = terrane.looking();
      terrane.look({ ...look, pixel_m: look.pixel_m * share });
      return Math.abs(terrane.looking().pixel_m / look.pixel_m - share) < 0.01;
    };
    if (far < NEAR && level(0.5)) {
      far *= 2;
      eye.far *= 2;
    } else if (far > FAR && level(2)) {
      far /= 2;
      eye.far /= 2;
    }
    far = clamp(far, NEAR * 0.6, FAR);
    if (soft) goal = { yaw: from.yaw, tilt: from.tilt, far };
    else {
      eye.far = far;
      if (goal) goal.far = far;
    }
    terrane.invalidate();
  }

  // Moves the land by pixels of the screen.
  function shift(dx, dy) {
    const look = terrane.looking();
    const [s, c] = [Math.sin(eye.yaw), Math.cos(eye.yaw)];
    const along = dy / Math.max(Math.sin(eye.tilt), 0.35);
    const metres = look.pixel_m * eye.far;
    const [east, south] = [-(c * dx + s * along) * metres, -(-s * dx + c * along) * metres];
    terrane.look({ at_m: [look.at_m[0] + east, look.at_m[1] - south], pixel_m: look.pixel_m });
  }

  const touching = new Map();
  const place = ({ clientX: x, clientY: y }) => ({ x, y });
  function hold() {
    const all = [...touching.values()];
    const [x, y] = ["x", "y"].map((axis) => all.reduce((sum, at) => sum + at[axis], 0) / all.length);
    return { x, y, spread: all.length < 2 ? 0 : Math.hypot(all[0].x - x, all[0].y - y) };
  }

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    goal = null;
    touching.set(event.pointerId, place(event));
    canvas.classList.add("held");
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!touching.has(event.pointerId)) return;
    const from = hold();
    touching.set(event.pointerId, place(event));
    const to = hold();
    if (touching.size > 1) {
      shift(to.x - from.x, to.y - from.y);
      if (from.spread > 1 && to.spread > 1) approachBy(from.spread / to.spread);
    } else if (event.shiftKey || event.buttons & 2) {
      shift(to.x - from.x, to.y - from.y);
    } else {
      turn((from.x - to.x) * 0.006, (to.y - from.y) * 0.005);
    }
  });
  for (const type of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(type, (event) => {
      touching.delete(event.pointerId);
      canvas.classList.toggle("held", touching.size > 0);
    });
  }
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 24 : event.deltaMode === 2 ? 400 : 1;
      approachBy(Math.exp(clamp(event.deltaY * lines * (event.ctrlKey ? 0.008 : 0.0018), -0.5, 0.5)), true);
    },
    { passive: false },
  );
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    [gl, textures] = [null, new Map()];
    leave();
    notify({ error: "The browser took the 3-D view away.", hint: "It may be short of graphics memory; try again." });
  });
  $("exaggeration").addEventListener("input", () => {
    const { value, min, max } = $("exaggeration");
    $("exaggeration-told").textContent = Number(value).toFixed(1);
    $("exaggeration").style.setProperty("--part", `${(100 * (value - min)) / (max - min)}%`);
    terrane.invalidate();
  });
  $("exaggeration").dispatchEvent(new Event("input"));
  const north = () => {
    goal = fitting({ ...HOME, yaw: 0 });
    terrane.invalidate();
  };
  $("scene-north").addEventListener("click", north);
  $("scene-close").addEventListener("click", () => leave());

  // ---------- open and closed

  function enter() {
    if (!gl && !prepare()) return notify({ error: "This browser has no WebGL 2, which the 3-D view needs." });
    canvas.hidden = false;
    $("scene-bar").hidden = false;
    $("tool-scene").setAttribute("aria-pressed", "true");
    // From above, where the block is the map, and down to where it is land.
    Object.assign(eye, { yaw: 0, tilt: Math.PI / 2 - 0.001, far: 1 });
    [goal, middle, floor] = [fitting(HOME), null, null];
    sink();
    terrane.hooks.paint = paint;
    canvas.focus({ preventScroll: true });
    terrane.invalidate();
  }

  function sink() {
    [risen, rises, since] = [0, false, performance.now()];
  }

  function leave() {
    if (!isOpen()) return;
    canvas.hidden = true;
    $("scene-bar").hidden = true;
    $("tool-scene").setAttribute("aria-pressed", "false");
    terrane.hooks.paint = null;
    $("map").focus({ preventScroll: true });
    terrane.invalidate();
  }

  function key(event) {
    if (!isOpen() || event.target instanceof HTMLButtonElement) return false;
    const arrow = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (arrow) {
      if (event.shiftKey) shift(80 * arrow[0], 80 * arrow[1]);
      else turn(-0.14 * arrow[0], 0.1 * arrow[1], true);
      return true;
    }
    const acts = { "+": () => approachBy(0.7, true), "=": () => approachBy(0.7, true), "-": () => approachBy(1.43, true), 0: north, Escape: leave };
    acts[event.key]?.();
    return event.key in acts;
  }

  return {
    key,
    leave,
    toggle: () => (isOpen() ? leave() : enter()),
    show(about) {
      if (world?.id !== about.id) {
        [middle, floor] = [null, null];
        sink();
      }
      world = about;
    },
  };
}
