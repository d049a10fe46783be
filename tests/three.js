// Loads the meshes of a bake with three.js in a headless Chromium, and looks whether they are what its manifest says:
//   node tests/three.js FOLDER-OF-NODE_MODULES BAKE PICTURE
// The first must hold puppeteer-core, three and esbuild; CHROMIUM names the browser, or it is the one in /usr/bin. The bake
// must have the exports gltf and gltf-region, and may have collision. WebGL is SwiftShader's, so no GPU is needed. The whole
// region, lit and seen from above at an angle, is written to PICTURE (a PNG). Prints one line a check, with a figure; exits
// with 1 if one has failed.
const fs = require("fs");
const http = require("http");
const os = require("os");
const path = require("path");
const { createRequire } = require("module");
const { pixelsOf } = require("./browser.js");

const [modules, folder, picture] = process.argv.slice(2);
const load = createRequire(path.resolve(modules, "node_modules", "x"));
const puppeteer = load("puppeteer-core");
const esbuild = load("esbuild");
const FLAGS = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const SIZE = { width: 1600, height: 1000, deviceScaleFactor: 1 };
// Heights are below 10 km, where a number of 32 bits tells a millimetre.
const EXACT_M = 1e-3;
const WEIGHTS = ["_ground", "_cover"];
// On a shore, between the vertices of the raster, each of the eight is rounded by itself to 255ths.
const WEIGHTS_OFF = 2 / 255;
const PARTS = `
  export * as THREE from "three";
  export { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
  export { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";`;
const PAGE = `<!doctype html><link rel="icon" href="data:,"><style>body { margin: 0 }</style><script src="/client.js"></script>`;

let [done, failed] = [0, 0];
function check(good, what, figure) {
  done += 1;
  failed += !good;
  console.log(`${good ? "ok    " : "FAILED"} ${what}: ${figure}`);
}

const sum = (numbers) => numbers.reduce((total, number) => total + number, 0);

// Serves the page, three.js in one file, and below /bake/ the bake, as a web server would: three.js fetches, and nothing
// may be fetched from a disk.
async function served() {
  const { outputFiles } = await esbuild.build({
    stdin: { contents: PARTS, resolveDir: path.resolve(modules) },
    bundle: true, write: false, minify: true, format: "iife", globalName: "client", logLevel: "error",
  });
  const types = { ".png": "image/png", ".gltf": "model/gltf+json", ".glb": "model/gltf-binary" };
  const server = http.createServer((request, response) => {
    const asked = decodeURIComponent(new URL(request.url, "http://x").pathname);
    const answer = (type, bytes) => response.writeHead(200, { "Content-Type": type }).end(bytes);
    if (asked === "/") return answer("text/html; charset=utf-8", PAGE);
    if (asked === "/client.js") return answer("text/javascript; charset=utf-8", outputFiles[0].text);
    const file = path.join(folder, asked.replace(/^\/bake\//, ""));
    if (!asked.startsWith("/bake/") || !fs.existsSync(file)) return response.writeHead(404).end();
    answer(types[path.extname(file)] ?? "application/octet-stream", fs.readFileSync(file));
  });
  await new Promise((listens) => server.listen(0, "127.0.0.1", listens));
  return server;
}

// What three.js makes of a file: its meshes in the order of the scene. Runs in the page.
async function read(url) {
  const { THREE, GLTFLoader, MeshoptDecoder } = client;
  const { scene } = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(url);
  scene.updateMatrixWorld(true);
  window.loaded = scene;
  const meshes = [];
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { position, normal } = mesh.geometry.attributes;
    // The box of the places themselves, not of the corners of a box that was turned or scaled.
    const box = new THREE.Box3().setFromObject(mesh, true);
    const weights = {};
    for (const name of Object.keys(mesh.geometry.attributes).filter((name) => name.startsWith("_"))) {
      const { normalized, itemSize, count } = mesh.geometry.attributes[name];
      weights[name] = { normalized, size: itemSize, count };
    }
    // The least and the most that all weights of a vertex make, as a shader gets them.
    const made = [Infinity, -Infinity];
    const them = Object.keys(weights).map((name) => mesh.geometry.attributes[name]);
    for (let vertex = 0; them.length > 0 && vertex < position.count; vertex++) {
      const total = them.reduce((total, it) => total + it.getX(vertex) + it.getY(vertex) + it.getZ(vertex) + it.getW(vertex), 0);
      made[0] = Math.min(made[0], total);
      made[1] = Math.max(made[1], total);
    }
    let flattest = normal ? 1 : null;
    for (let vertex = 0; normal && vertex < normal.count; vertex++) {
      const length = Math.hypot(normal.getX(vertex), normal.getY(vertex), normal.getZ(vertex));
      flattest = Math.min(flattest, length, 2 - length);
    }
    meshes.push({
      name: mesh.name, vertices: position.count, triangles: mesh.geometry.index.count / 3, min: box.min.toArray(),
      max: box.max.toArray(), step: position.array instanceof Float32Array ? 0 : Math.max(...mesh.scale.toArray()),
      weights, made, flattest, image: mesh.material.map ? [mesh.material.map.image.width, mesh.material.map.image.height] : null,
    });
  });
  return meshes;
}

// Draws what was read last: the sun in the south-west, the camera in the south-east. Runs in the page.
function draw(width, height) {
  const { THREE } = client;
  // What is loaded is a group, and the sky needs a scene.
  const scene = new THREE.Scene().add(window.loaded);
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  renderer.setSize(width, height);
  document.body.append(renderer.domElement);
  const box = new THREE.Box3().setFromObject(scene);
  const [middle, size] = [box.getCenter(new THREE.Vector3()), box.getSize(new THREE.Vector3())];
  const wide = Math.max(size.x, size.z);
  scene.background = new THREE.Color(0xb8cbe0);
  scene.add(new THREE.HemisphereLight(0xdde8ff, 0x6b6455, 1.2));
  const sun = new THREE.DirectionalLight(0xfff1dc, 2.6);
  sun.position.set(-1, 0.9, 0.6);
  scene.add(sun);
  const camera = new THREE.PerspectiveCamera(36, width / height, wide / 100, wide * 5);
  camera.position.set(middle.x + 0.3 * wide, middle.y + 0.8 * wide, middle.z + 1.15 * wide);
  camera.lookAt(middle.x - 0.05 * wide, box.min.y, middle.z + 0.1 * wide);
  renderer.render(scene, camera);
  const { calls, triangles } = renderer.info.render;
  return { calls, triangles, error: renderer.getContext().getError() };
}

// How many colours a screenshot has, and how much of it the most frequent one.
async function colours(page, bytes) {
  const pixels = await pixelsOf(page, bytes);
  const times = new Map();
  for (const pixel of pixels) times.set(pixel, (times.get(pixel) ?? 0) + 1);
  return { count: times.size, most: Math.max(...times.values()) / pixels.length };
}

// The name of a tile's land: the first level of detail has no ending.
function landName(file, first) {
  const { tile, mesh } = file;
  return `land_x${tile.x}_y${tile.y}` + (file.export === "collision" ? "-colonly" : mesh.lod === first ? "" : `_lod${mesh.lod}`);
}

// How far a land's box is from the manifest's.
function offBox(land, { min_m, max_m }) {
  const off = (a, b) => Math.max(...a.map((metres, axis) => Math.abs(metres - b[axis])));
  return Math.max(off(land.min, min_m), off(land.max, max_m));
}

// Lands of one file or level of detail, against the manifest's files of their tiles.
function checkLands(what, lands, files, first) {
  const names = lands.map((land) => land.name).sort();
  const expected = files.map((file) => landName(file, first)).sort();
  check(String(names) === String(expected), `${what}: names of lands`, `${names.length}, ${names[0]} to ${names[names.length - 1]}`);
  const found = files.map((file) => [file.mesh, lands.find((land) => land.name === landName(file, first))]).filter(([, land]) => land);
  const same = found.every(([mesh, land]) => mesh.vertices === land.vertices && mesh.triangles === land.triangles);
  check(same, `${what}: vertices and triangles of lands`,
    `${sum(lands.map((land) => land.vertices))}, ${sum(lands.map((land) => land.triangles))}`);
  const off = found.map(([mesh, land]) => [offBox(land, mesh), land.step]);
  check(off.every(([off_m, step_m]) => off_m <= EXACT_M + step_m / 2), `${what}: boxes of lands`,
    `${Math.max(...off.map(([off_m]) => off_m)).toFixed(6)} m off, steps of ${Math.max(...off.map(([, step_m]) => step_m))} m`);
}

// What is told at every vertex of a land: the weights of materials make 1, normals have a length of 1.
function checkVertices(what, lands) {
  const all = lands.flatMap((land) => WEIGHTS.map((name) => [land, land.weights[name]]));
  const good = all.every(([land, it]) => it && it.normalized && it.size === 4 && it.count === land.vertices);
  const made = [Math.min(...lands.map((land) => land.made[0])), Math.max(...lands.map((land) => land.made[1]))];
  check(good && made.every((total) => Math.abs(total - 1) < WEIGHTS_OFF + 1e-6), `${what}: _ground and _cover are normalised`,
    `weights make ${made.map((total) => total.toFixed(4)).join(" to ")}`);
  const flattest = Math.min(...lands.map((land) => land.flattest));
  // Whole numbers of 8 bits make a length no nearer to 1.
  check(flattest > 0.985, `${what}: normals have a length of 1`, `${(1 - flattest).toFixed(4)} off`);
  const images = lands.map((land) => String(land.image));
  check(lands.every((land) => land.image) && new Set(images).size === 1, `${what}: lands have a picture`, `${images[0]} pixels`);
}

async function main() {
  const { files, meshes } = JSON.parse(fs.readFileSync(path.join(folder, "bake.json"), "utf8"));
  const first = Math.min(...meshes.lods);
  const server = await served();
  const origin = `http://127.0.0.1:${server.address().port}`;
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), "terrane-three-"));
  const browser = await puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    headless: true,
    userDataDir: profile,
    args: FLAGS,
    // A large region takes a while to draw without a GPU.
    protocolTimeout: 600000,
  });
  const faults = [];
  try {
    const page = await browser.newPage();
    page.on("pageerror", (error) => faults.push(String(error)));
    page.on("console", (message) => ["error", "warn", "warning", "assert"].includes(message.type()) && faults.push(message.text()));
    page.on("requestfailed", (request) => faults.push(`${request.url()} ${request.failure()?.errorText}`));
    page.on("response", (response) => response.status() >= 400 && faults.push(`${response.url()} ${response.status()}`));
    const ours = (url) => url.startsWith(origin) || /^(data|blob):/.test(url);
    page.on("request", (request) => ours(request.url()) || faults.push(`network: ${request.url()}`));
    await page.setViewport(SIZE);
    await page.goto(origin);
    const revision = await page.evaluate(() => client.THREE.REVISION);
    const loaded = (file) => page.evaluate(read, `/bake/${file}`);
    const land = (mesh) => mesh.name.startsWith("land");

    for (const kind of ["gltf", "collision"]) {
      for (const lod of meshes.lods) {
        const tiles = files.filter((file) => file.export === kind && file.mesh?.lod === lod && file.path.endsWith(".glb"));
        if (tiles.length === 0) continue;
        const found = [];
        for (const file of tiles) found.push(...(await loaded(file.path)));
        const what = `three.js r${revision}, ${kind === "gltf" ? "tiles" : kind} of LOD ${lod}`;
        checkLands(what, found.filter(land), tiles, first);
        if (kind === "collision") continue;
        checkVertices(what, found.filter(land));
        // The same as one file, in two forms.
        const region = `mesh/region${lod === first ? "" : `_lod${lod}`}`;
        const whole = await loaded(`${region}.gltf`);
        checkLands(`${region}.gltf`, whole.filter(land), tiles, first);
        const one = await loaded(`${region}.glb`);
        checkLands(`${region}.glb`, one.filter(land), tiles, first);
        checkVertices(`${region}.glb`, one.filter(land));
        const told = (them) => JSON.stringify(them.map((it) => [it.name, it.vertices, it.triangles, it.min, it.max]));
        const triangles = [found, whole, one].map((them) => sum(them.map((mesh) => mesh.triangles)));
        check(told(whole) === told(one) && new Set(triangles).size === 1, `LOD ${lod}: tiles, .gltf and .glb are the same`,
          `${one.length} meshes, ${triangles.join(", ")} triangles`);
      }
    }

    const one = await loaded("mesh/region.glb");
    const drawn = await page.evaluate(draw, SIZE.width, SIZE.height);
    check(drawn.calls === one.length && drawn.triangles === sum(one.map((mesh) => mesh.triangles)) && drawn.error === 0,
      "all of the region is drawn", `${drawn.calls} meshes, ${drawn.triangles} triangles, error ${drawn.error}`);
    const screenshot = await page.screenshot();
    fs.writeFileSync(picture, screenshot);
    const { count, most } = await colours(page, screenshot);
    check(count > 5000 && most < 0.7, "it is a picture", `${count} colours, the most frequent on ${(100 * most).toFixed(0)} %`);
  } finally {
    await browser.close();
    server.close();
    fs.rmSync(profile, { recursive: true, force: true });
  }
  check(faults.length === 0, "no error, no warning and no network", [...new Set(faults)].slice(0, 5).join("; ") || "none");
  console.log(`${done} checks, ${failed} failed`);
  process.exitCode = failed > 0 ? 1 : 0;
}

main();
