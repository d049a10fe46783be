// Decodes a GLB with EXT_meshopt_compression and one without that shows the same, and compares what they hold:
// node tests/decompress.js FOLDER-OF-NODE_MODULES COMPRESSED PLAIN. Exits with 1 if they differ.
const fs = require("fs");
const path = require("path");
const { createRequire } = require("module");

const [modules, ...files] = process.argv.slice(2);
const MeshoptDecoder = createRequire(path.resolve(modules, "node_modules", "x"))("meshoptimizer/decoder.cjs");

/// The JSON of a GLB, and the bytes of each of its buffer views.
function read(file) {
  const glb = fs.readFileSync(file);
  const length = glb.readUInt32LE(12);
  const root = JSON.parse(glb.subarray(20, 20 + length).toString());
  const bytes = new Uint8Array(glb.subarray(28 + length));
  const views = root.bufferViews.map((view) => {
    const coded = view.extensions?.EXT_meshopt_compression;
    if (!coded) return bytes.subarray(view.byteOffset, view.byteOffset + view.byteLength);
    const target = new Uint8Array(coded.count * coded.byteStride);
    const source = bytes.subarray(coded.byteOffset, coded.byteOffset + coded.byteLength);
    MeshoptDecoder.decodeGltfBuffer(target, coded.count, coded.byteStride, source, coded.mode, coded.filter);
    return target;
  });
  return { root, views };
}

/// Triangles as text, each from its least index on and in the order of that text: the codec may turn triangles.
function triangles(accessor, view) {
  const indices = accessor.componentType === 5123
    ? new Uint16Array(view.buffer.slice(view.byteOffset, view.byteOffset + 2 * accessor.count))
    : new Uint32Array(view.buffer.slice(view.byteOffset, view.byteOffset + 4 * accessor.count));
  const all = [];
  for (let at = 0; at < indices.length; at += 3) {
    const corners = [...indices.subarray(at, at + 3)];
    const least = corners.indexOf(Math.min(...corners));
    all.push([0, 1, 2].map((step) => corners[(least + step) % 3]).join());
  }
  return all.sort().join(";");
}

MeshoptDecoder.ready.then(() => {
  const [coded, plain] = files.map(read);
  const compressed = coded.root.bufferViews.filter((view) => view.extensions?.EXT_meshopt_compression).length;
  let same = coded.root.accessors.length === plain.root.accessors.length && compressed === coded.root.accessors.length;
  coded.root.accessors.forEach((accessor, index) => {
    const other = plain.root.accessors[index];
    const [a, b] = [coded.views[accessor.bufferView], plain.views[other.bufferView]];
    const isIndices = coded.root.bufferViews[accessor.bufferView].target === 34963;
    same &&= isIndices ? triangles(accessor, a) === triangles(other, b) : Buffer.compare(a, b) === 0;
  });
  console.log(`${compressed} of ${coded.root.accessors.length} accessors were compressed; ${same ? "all the same" : "they DIFFER"}`);
  process.exitCode = same ? 0 : 1;
});
